__version__: str

from .app.inspection import inspect as inspect
from .app.report.write import write_report as write_report
from .app.study import discriminate as discriminate
from .core.errors import (
    ArmImpedanceError as ArmImpedanceError,
    EstimationError as EstimationError,
    InputError as InputError,
    NotIdentifiableError as NotIdentifiableError,
)
from .core.motion import MarkerRecording as MarkerRecording, MotionRecording as MotionRecording
from .core.records import (
    ImpedanceEstimate as ImpedanceEstimate,
    Recording as Recording,
    Subject as Subject,
)
from .core.skeleton import Skeleton as Skeleton
from .hand.adaptive.show import next_trials as next_trials
from .hand.comparison.show import (
    Comparison as Comparison,
    compare as compare,
    plot_comparison as plot_comparison,
)
from .hand.ellipses import Ellipse as Ellipse, ellipse as ellipse, ellipse_of as ellipse_of
from .hand.levels.show import to_hand as to_hand, to_joint as to_joint, to_muscle as to_muscle
from .hand.planning import Plan as Plan
from .hand.planning.show import plan as plan, plan_figure as plan_figure
from .hand.random.show import random as random
from .hand.reaching.show import movement as movement, plan_movement as plan_movement
from .hand.show import (
    Estimates as Estimates,
    LabelledEstimate as LabelledEstimate,
    LabelledMatrix as LabelledMatrix,
    plot_ellipse as plot_ellipse,
    plot_ellipses as plot_ellipses,
    plot_ellipses_over_levels as plot_ellipses_over_levels,
    plot_intervals as plot_intervals,
    read_results as read_results,
)
from .hand.still.show import (
    ReflexVerdicts as ReflexVerdicts,
    estimate as estimate,
    estimate_all as estimate_all,
    plot_reflex as plot_reflex,
    reflex as reflex,
)
from .joint.body import BodyFit as BodyFit
from .joint.body.show import body as body, body_figure as body_figure
from .joint.elbow import (
    ElbowFit as ElbowFit,
    EmgLaw as EmgLaw,
    VaryingImpedance as VaryingImpedance,
)
from .joint.elbow.show import (
    elbow as elbow,
    elbow_over_time as elbow_over_time,
    emg_law as emg_law,
    plot_emg_law as plot_emg_law,
    plot_frequency_response as plot_frequency_response,
    plot_varying_both as plot_varying_both,
)
from .joint.relaxed import PassiveFit as PassiveFit, PassiveFits as PassiveFits
from .joint.relaxed.show import passive as passive, plot_passive_fits as plot_passive_fits
from .joint.therapy import PassiveArm as PassiveArm, TherapyRobot as TherapyRobot
from .joint.therapy.show import (
    Contributions as Contributions,
    calibrate_arm as calibrate_arm,
    calibrate_robot as calibrate_robot,
    contribution as contribution,
    plot_feedback as plot_feedback,
    plot_passive_arm as plot_passive_arm,
    plot_robot_calibration as plot_robot_calibration,
    read_arm as read_arm,
    read_robot as read_robot,
)
from .limb.arm import arm_named as arm_named
from .muscles.live import Live as Live
from .muscles.models import (
    ActivationModel as ActivationModel,
    JointPrediction as JointPrediction,
    MuscleModel as MuscleModel,
    PostureModel as PostureModel,
    read_model as read_model,
)
from .muscles.show import (
    at_hand as at_hand,
    fit_activation as fit_activation,
    fit_muscles as fit_muscles,
    fit_posture as fit_posture,
    plot_predicted_against_measured as plot_predicted_against_measured,
    predict as predict,
    read_joint_rows as read_joint_rows,
)
from .numerics.regression import NamedParameter as NamedParameter, Parameters as Parameters
from .recordings import recording as recording, write_recording as write_recording
from .show.plots import save as save
from .show.verbs.inspected import Inspection as Inspection
from .show.verbs.results import read as read
