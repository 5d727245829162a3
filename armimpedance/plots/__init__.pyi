from .body import body_figure as body_figure, plot_row as plot_row, row_labels as row_labels
from .comparison import plot_comparison as plot_comparison
from .discrimination import plot_discrimination as plot_discrimination
from .elbow import (
    plot_emg_law as plot_emg_law,
    plot_frequency_response as plot_frequency_response,
    plot_varying as plot_varying,
    plot_varying_both as plot_varying_both,
)
from .ellipses.ellipse import (
    plot_ellipse as plot_ellipse,
    plot_ellipses_in_workspace as plot_ellipses_in_workspace,
)
from .ellipses.fields import Predicted as Predicted
from .ellipses.parts import default_scale as default_scale, one_legend as one_legend
from .ellipses.series import (
    plot_ellipse_rose as plot_ellipse_rose,
    plot_ellipses_over_levels as plot_ellipses_over_levels,
)
from .maps import plot_map as plot_map
from .movement import plot_movement as plot_movement
from .muscles import (
    PARAMETERS as PARAMETERS,
    activation_surfaces as activation_surfaces,
    half_width_surface as half_width_surface,
    plot_ellipse_surfaces as plot_ellipse_surfaces,
    posture_points as posture_points,
    posture_surfaces as posture_surfaces,
)
from .outline import confidence_band as confidence_band
from .paper.captions import save_with_caption as save_with_caption
from .passive import (
    plot_emg_level as plot_emg_level,
    plot_passive_fit as plot_passive_fit,
    plot_passive_fits as plot_passive_fits,
)
from .plan import plan_figure as plan_figure
from .predicted import plot_predicted_against_measured as plot_predicted_against_measured
from .quality import plot_intervals as plot_intervals
from .random_hand import plot_response_matrix as plot_response_matrix
from .reflex import MOST_GROUPS as MOST_GROUPS, plot_reflex as plot_reflex
from .results.estimates import (
    plot_estimates as plot_estimates,
    plot_motion_and_force as plot_motion_and_force,
)
from .results.mapped import (
    plot_force_term as plot_force_term,
    plot_muscle_ranges as plot_muscle_ranges,
)
from .results.predictions import (
    plot_model_fit as plot_model_fit,
    plot_predictions as plot_predictions,
)
from .session.aligned import (
    Aligned as Aligned,
    aligned_group as aligned_group,
    outlying_trials as outlying_trials,
)
from .session.fit import plot_fit as plot_fit, plot_residuals as plot_residuals
from .session.quality import plot_quality as plot_quality
from .session.trials import plot_trials as plot_trials
from .style import (
    OKABE_ITO as OKABE_ITO,
    TWO_COLUMNS_IN as TWO_COLUMNS_IN,
    drawn_for as drawn_for,
    new_figure as new_figure,
    print_style as print_style,
    save as save,
)
from .surfaces import MeasuredPoints as MeasuredPoints, Surface as Surface
from .tables import TableBlock as TableBlock, TableRow as TableRow, plot_table as plot_table
from .therapy import (
    plot_feedback as plot_feedback,
    plot_friction as plot_friction,
    plot_passive_arm as plot_passive_arm,
    plot_robot_calibration as plot_robot_calibration,
)
