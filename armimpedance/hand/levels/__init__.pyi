from .joint import force_term as force_term, to_hand as to_hand, to_joint as to_joint
from .posture import (
    Elbow as Elbow,
    Whose as Whose,
    arm_of_whose as arm_of_whose,
    arm_posture_for as arm_posture_for,
    kinematic_arm as kinematic_arm,
    moving_joints as moving_joints,
)
from .redundant import feasible_joint_stiffness as feasible_joint_stiffness
from .symmetry import antisymmetric_part as antisymmetric_part, symmetric_part as symmetric_part
from .tension import tensions_for as tensions_for
