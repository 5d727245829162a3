from .anthropometry import (
    WINTER as WINTER,
    SegmentRatios as SegmentRatios,
    arm_of as arm_of,
    hand_rod as hand_rod,
)
from .muscular_arms import arm_named as arm_named
from .polynomial_paths import (
    MuscularArm as MuscularArm,
    PolynomialPaths as PolynomialPaths,
    fit_paths as fit_paths,
    monomial_exponents as monomial_exponents,
)
from .rods import (
    FREE_WRIST as FREE_WRIST,
    IN_SPACE as IN_SPACE,
    LOCKED_WRIST as LOCKED_WRIST,
    Arm as Arm,
)
from .skeleton_model import skeleton_model as skeleton_model
from .skeletons import body_skeleton as body_skeleton, elbow_skeleton as elbow_skeleton
from .spatial_arm import (
    FREE as FREE,
    HELD as HELD,
    SpatialArm as SpatialArm,
    joints_that_move as joints_that_move,
)
from .two_link import (
    SINGULAR_CONDITION as SINGULAR_CONDITION,
    TwoLinkArm as TwoLinkArm,
    hand_inertia as hand_inertia,
    require_full_rank as require_full_rank,
)
