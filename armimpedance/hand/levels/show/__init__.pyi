from .plot import plot_force_term as plot_force_term
from .verb import (
    Elbow as Elbow,
    Whose as Whose,
    arm_of_whose as arm_of_whose,
    moving_joints as moving_joints,
    to_hand as to_hand,
    to_joint as to_joint,
    to_muscle as to_muscle,
)
