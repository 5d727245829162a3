from .arm_errors import with_arm_errors as with_arm_errors
from .joint import force_term as force_term, to_hand as to_hand, to_joint as to_joint
from .muscle_map import MuscleEstimate as MuscleEstimate, to_muscle as to_muscle
from .muscle_share import (
    Combination as Combination,
    FeasibleRange as FeasibleRange,
    MuscleShare as MuscleShare,
)
from .posture import arm_posture_for as arm_posture_for, kinematic_arm as kinematic_arm
from .redundant import feasible_joint_stiffness as feasible_joint_stiffness
from .spatial_posture import (
    is_in_space as is_in_space,
    spatial_arm as spatial_arm,
    spatial_posture_for as spatial_posture_for,
)
from .symmetry import antisymmetric_part as antisymmetric_part, symmetric_part as symmetric_part
from .tension import tensions_for as tensions_for
