from .ellipse_map_plot import plot_ellipses as plot_ellipses
from .ellipse_plot import (
    plot_ellipse as plot_ellipse,
    plot_ellipse_rose as plot_ellipse_rose,
    plot_ellipses_over_levels as plot_ellipses_over_levels,
)
from .ellipse_plot_parts import confidence_band as confidence_band, one_legend as one_legend
from .estimates import (
    Estimates as Estimates,
    estimates_of as estimates_of,
    read_results as read_results,
)
from .intervals_plot import plot_intervals as plot_intervals
from .labelled import LabelledEstimate as LabelledEstimate, LabelledMatrix as LabelledMatrix
from .options import BY as BY, FORCE_BY as FORCE_BY
from .quantities import (
    Cells as Cells,
    ellipse_cells as ellipse_cells,
    ellipsoid_cells as ellipsoid_cells,
    limits_of as limits_of,
    principal_values as principal_values,
)
from .results_csv import is_results_file as is_results_file, write_results as write_results
from .text import summary_table as summary_table
