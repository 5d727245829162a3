from .plot import plot_force_term as plot_force_term
from .verb import to_hand as to_hand, to_joint as to_joint, to_muscle as to_muscle
