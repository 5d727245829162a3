from .arm.calibrate import (
    ArmCalibration as ArmCalibration,
    AxisCalibration as AxisCalibration,
    identify_arm as identify_arm,
)
from .arm.mockup import (
    MockupCheck as MockupCheck,
    check_mockup as check_mockup,
    pipe as pipe,
    source_mockup as source_mockup,
)
from .arm.movements import movement_torques as movement_torques
from .arm.passive_arm import MASS_SD as MASS_SD, ArmSegment as ArmSegment, PassiveArm as PassiveArm
from .arm.person import segments_of as segments_of, upper_arm_length as upper_arm_length
from .arm.torques import MovementTorques as MovementTorques
from .arm.verdict import (
    WIDEST_REST_RAD as WIDEST_REST_RAD,
    WIDEST_STIFFNESS as WIDEST_STIFFNESS,
    WIDEST_STIFFNESS_SHARE as WIDEST_STIFFNESS_SHARE,
)
from .live.replay import replay as replay
from .robot.calibrate import RobotCalibration as RobotCalibration, identify_robot as identify_robot
from .robot.checks import check_recording as check_recording
from .robot.holds import SpringHolds as SpringHolds
from .robot.rigid import robot_bodies as robot_bodies
from .robot.sliding import slides as slides
from .robot.smooth import (
    SmoothTrial as SmoothTrial,
    kernels_for as kernels_for,
    smooth_trials as smooth_trials,
)
from .robot.sweeps import AxisSweeps as AxisSweeps
from .robot.therapy_robot import (
    FOREARM as FOREARM,
    SPRING_TERMS as SPRING_TERMS,
    UPPER_ARM as UPPER_ARM,
    TherapyRobot as TherapyRobot,
)
from .robot.validation import (
    LEAST_SPEED_RAD_S as LEAST_SPEED_RAD_S,
    AxisValidation as AxisValidation,
    validate_robot as validate_robot,
)
from .share.metric import (
    STEADY_S as STEADY_S,
    Contribution as Contribution,
    SampleContribution as SampleContribution,
    contribution_of as contribution_of,
    contribution_so_far as contribution_so_far,
    sample_contribution as sample_contribution,
    usable_elastic as usable_elastic,
)
from .share.uncertainty import PARTS as PARTS
