from .explore_verb import write_explore as write_explore
from .maps_plot import Predicted as Predicted, plot_map as plot_map
from .plot import (
    PARAMETERS as PARAMETERS,
    activation_surfaces as activation_surfaces,
    half_width_surface as half_width_surface,
    plot_ellipse_surfaces as plot_ellipse_surfaces,
    posture_points as posture_points,
    posture_surfaces as posture_surfaces,
)
from .predictions_plot import (
    plot_model_fit as plot_model_fit,
    plot_predicted_against_measured as plot_predicted_against_measured,
    plot_predictions as plot_predictions,
)
from .predictions_verb import at_hand as at_hand, predict as predict
from .rows_csv import read_joint_rows as read_joint_rows
from .verb import (
    fit_activation as fit_activation,
    fit_model as fit_model,
    fit_muscles as fit_muscles,
    fit_posture as fit_posture,
    free_hand_rows as free_hand_rows,
)
