from .comparison_page import differences_of as differences_of
from .plot import plot_comparison as plot_comparison, plot_discrimination as plot_discrimination
from .text import discrimination_text as discrimination_text
from .verb import Comparison as Comparison, compare as compare
