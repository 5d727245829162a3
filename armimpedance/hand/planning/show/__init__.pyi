from .options import PLAN as PLAN
from .plot import plan_figure as plan_figure
from .text import plan_text as plan_text
from .verb import plan as plan
