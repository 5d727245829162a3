from .ellipses.ellipse import (
    plot_ellipse as plot_ellipse,
    plot_ellipses_in_workspace as plot_ellipses_in_workspace,
)
from .ellipses.parts import one_legend as one_legend
from .ellipses.series import (
    plot_ellipse_rose as plot_ellipse_rose,
    plot_ellipses_over_levels as plot_ellipses_over_levels,
)
from .estimates import Estimates as Estimates
from .intervals_plot import plot_intervals as plot_intervals
from .labelled import LabelledEstimate as LabelledEstimate, LabelledMatrix as LabelledMatrix
from .options import add_by as add_by, add_force_by as add_force_by
from .outline import confidence_band as confidence_band
from .quantities import limits_of as limits_of, principal_values as principal_values
from .result_row import (
    Cells as Cells,
    ellipse_cells as ellipse_cells,
    ellipsoid_cells as ellipsoid_cells,
)
from .results_csv import read_results as read_results, write_results as write_results
from .verb import plot_ellipses as plot_ellipses
