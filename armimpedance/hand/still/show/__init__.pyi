from .aligned_trials import outlying_trials as outlying_trials
from .gate import checked_response as checked_response
from .hand_page import of_estimates as of_estimates
from .linked_trials import write_choice as write_choice
from .options import COVARIANCE as COVARIANCE
from .plot import plot_estimates as plot_estimates, plot_motion_and_force as plot_motion_and_force
from .quality_plot import plot_quality as plot_quality
from .reflex_plot import plot_reflex as plot_reflex
from .reflex_verb import ReflexVerdicts as ReflexVerdicts, reflex as reflex
from .session_plot import plot_session as plot_session
from .trials_plot import (
    plot_fit as plot_fit,
    plot_residuals as plot_residuals,
    plot_trials as plot_trials,
)
from .verb import estimate as estimate, estimate_all as estimate_all
