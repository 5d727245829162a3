from .plot import body_figure as body_figure, plot_row as plot_row, row_labels as row_labels
from .verb import body as body
