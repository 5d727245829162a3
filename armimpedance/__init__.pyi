__version__: str

from .analyses import (
    Comparison as Comparison,
    Contributions as Contributions,
    Estimates as Estimates,
    Inspection as Inspection,
    LabelledEstimate as LabelledEstimate,
    LabelledMatrix as LabelledMatrix,
    ReflexVerdicts as ReflexVerdicts,
    at_hand as at_hand,
    body as body,
    calibrate_arm as calibrate_arm,
    calibrate_robot as calibrate_robot,
    compare as compare,
    contribution as contribution,
    discriminate as discriminate,
    elbow as elbow,
    elbow_over_time as elbow_over_time,
    emg_law as emg_law,
    estimate as estimate,
    estimate_all as estimate_all,
    fit_activation as fit_activation,
    fit_muscles as fit_muscles,
    fit_posture as fit_posture,
    inspect as inspect,
    movement as movement,
    passive as passive,
    plan as plan,
    plan_movement as plan_movement,
    plot_ellipses as plot_ellipses,
    predict as predict,
    random as random,
    read as read,
    reflex as reflex,
    to_hand as to_hand,
    to_joint as to_joint,
    to_muscle as to_muscle,
)
from .arm import arm_named as arm_named
from .body import BodyFit as BodyFit
from .elbow import ElbowFit as ElbowFit, EmgLaw as EmgLaw, VaryingImpedance as VaryingImpedance
from .ellipses import Ellipse as Ellipse, ellipse as ellipse, ellipse_of as ellipse_of
from .errors import (
    ArmImpedanceError as ArmImpedanceError,
    EstimationError as EstimationError,
    InputError as InputError,
    NotIdentifiableError as NotIdentifiableError,
)
from .files import (
    read_arm as read_arm,
    read_joint_rows as read_joint_rows,
    read_model as read_model,
    read_results as read_results,
    read_robot as read_robot,
)
from .live import Live as Live
from .motion import MarkerRecording as MarkerRecording, MotionRecording as MotionRecording
from .muscles import (
    ActivationModel as ActivationModel,
    JointPrediction as JointPrediction,
    MuscleModel as MuscleModel,
    PostureModel as PostureModel,
)
from .pages import write_report as write_report
from .passive import PassiveFit as PassiveFit, PassiveFits as PassiveFits
from .planning import Plan as Plan
from .plots import (
    body_figure as body_figure,
    plan_figure as plan_figure,
    plot_comparison as plot_comparison,
    plot_ellipse as plot_ellipse,
    plot_ellipses_over_levels as plot_ellipses_over_levels,
    plot_emg_law as plot_emg_law,
    plot_feedback as plot_feedback,
    plot_frequency_response as plot_frequency_response,
    plot_intervals as plot_intervals,
    plot_passive_arm as plot_passive_arm,
    plot_passive_fits as plot_passive_fits,
    plot_predicted_against_measured as plot_predicted_against_measured,
    plot_reflex as plot_reflex,
    plot_robot_calibration as plot_robot_calibration,
    plot_varying_both as plot_varying_both,
    save as save,
)
from .recordings import write_recording as write_recording
from .records import (
    ImpedanceEstimate as ImpedanceEstimate,
    Recording as Recording,
    Subject as Subject,
)
from .regression import NamedParameter as NamedParameter, Parameters as Parameters
from .skeleton import Skeleton as Skeleton
from .therapy import PassiveArm as PassiveArm, TherapyRobot as TherapyRobot
