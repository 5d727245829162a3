from .compared import Comparison as Comparison
from .discrimination_plot import plot_discrimination as plot_discrimination
from .discrimination_text import discrimination_text as discrimination_text
from .plot import plot_comparison as plot_comparison
from .verb import compare as compare
