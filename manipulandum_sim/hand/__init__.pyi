from .arm_plant import (
    Arm as Arm,
    Motion as Motion,
    MuscleCommand as MuscleCommand,
    basis_at as basis_at,
    force_on_handle as force_on_handle,
    muscle_stretch as muscle_stretch,
)
from .compiled import integrate_compiled as integrate_compiled
from .coupled import (
    CoupledPlant as CoupledPlant,
    Course as Course,
    Track as Track,
    integrate as integrate,
)
from .disturbances import (
    DISTURBANCES as DISTURBANCES,
    Disturbance as Disturbance,
    custom as custom,
    smooth_step as smooth_step,
)
from .emg import REST_V as REST_V, raw_emg as raw_emg
from .equilibrium import (
    COCONTRACTION_SHARE as COCONTRACTION_SHARE,
    hand_jacobian as hand_jacobian,
    muscle_command as muscle_command,
)
from .experiments import (
    EXPERIMENTS as EXPERIMENTS,
    Condition as Condition,
    find_experiment as find_experiment,
    hand_force as hand_force,
    nominal_hand as nominal_hand,
)
from .muscles import joint_basis as joint_basis
from .noise import (
    LED_EVERY as LED_EVERY,
    NOMINAL as NOMINAL,
    Draws as Draws,
    NoiseLevel as NoiseLevel,
    find_noise as find_noise,
    quantised as quantised,
    voluntary_force as voluntary_force,
)
from .one_by_one import (
    AskedArm as AskedArm,
    AskedPush as AskedPush,
    RecordedPush as RecordedPush,
    conditions_named as conditions_named,
)
from .rig import ONSET_S as ONSET_S, RATE_HZ as RATE_HZ, Reflex as Reflex, Rig as Rig
from .robot import IDEAL as IDEAL, Servo as Servo, servo_gains as servo_gains
from .schedule import Run as Run, Schedule as Schedule, make_schedule as make_schedule
from .simulate import simulate as simulate, simulate_condition as simulate_condition
from .subjects import (
    FOREARM_HAND_COM as FOREARM_HAND_COM,
    FOREARM_HAND_GYRATION as FOREARM_HAND_GYRATION,
    FOREARM_HAND_MASS as FOREARM_HAND_MASS,
    FOREARM_LENGTH as FOREARM_LENGTH,
    SUBJECTS as SUBJECTS,
    UPPER_ARM_COM as UPPER_ARM_COM,
    UPPER_ARM_GYRATION as UPPER_ARM_GYRATION,
    UPPER_ARM_MASS as UPPER_ARM_MASS,
    SimulatedSubject as SimulatedSubject,
    find_subject as find_subject,
)
from .trials import Batch as Batch, make_course as make_course
from .truth import (
    STEP_M as STEP_M,
    STEP_RAD as STEP_RAD,
    STEP_RATE as STEP_RATE,
    Truth as Truth,
    derivative as derivative,
    find_truth as find_truth,
    joint_angles as joint_angles,
)
from .two_link import EndMotion as EndMotion
