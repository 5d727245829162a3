from .arm.calibrate import identify_arm as identify_arm
from .arm.mockup import MockupCheck as MockupCheck, check_mockup as check_mockup, pipes as pipes
from .arm.movements import MovementTorques as MovementTorques, movement_torques as movement_torques
from .arm.passive_arm import (
    ArmSegment as ArmSegment,
    PassiveArm as PassiveArm,
    segments_of as segments_of,
)
from .arm.verdict import ArmCalibration as ArmCalibration, AxisCalibration as AxisCalibration
from .live_replay import replay as replay
from .robot.calibrate import RobotCalibration as RobotCalibration, identify_robot as identify_robot
from .robot.checks import AxisValidation as AxisValidation, validate_robot as validate_robot
from .robot.steady import (
    SmoothTrial as SmoothTrial,
    slides as slides,
    smooth_trials as smooth_trials,
)
from .robot.sweeps import AxisSweeps as AxisSweeps
from .robot.therapy_robot import (
    TherapyRobot as TherapyRobot,
    robot_bodies as robot_bodies,
)
from .share.of_movement import (
    STEADY_S as STEADY_S,
    contribution_of as contribution_of,
    sample_contribution as sample_contribution,
)
from .share.result import Contribution as Contribution
