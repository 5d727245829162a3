from .body import body as body
from .comparison import compare as compare
from .discrimination import discriminate as discriminate
from .drawing import plot_ellipses as plot_ellipses
from .elbow import elbow as elbow
from .elbow_emg import emg_law as emg_law
from .elbow_over_time import elbow_over_time as elbow_over_time
from .hand import (
    estimate as estimate,
    estimate_all as estimate_all,
)
from .inspection import Inspection as Inspection, inspect as inspect
from .levels import (
    arm_of_whose as arm_of_whose,
    moving_joints as moving_joints,
    to_hand as to_hand,
    to_joint as to_joint,
    to_muscle as to_muscle,
)
from .models import (
    fit_activation as fit_activation,
    fit_model as fit_model,
    fit_muscles as fit_muscles,
    fit_posture as fit_posture,
    free_hand_rows as free_hand_rows,
)
from .movement import movement as movement, plan_movement as plan_movement
from .passive import passive as passive
from .plan import plan as plan
from .predictions import at_hand as at_hand, predict as predict
from .random_hand import RandomEstimates as RandomEstimates, random as random
from .reflexes import ReflexVerdicts as ReflexVerdicts, reflex as reflex
from .results.compared import Comparison as Comparison
from .results.compared_methods import ComparedMethods as ComparedMethods
from .results.contributions import Contributions as Contributions
from .results.estimates import Estimates as Estimates
from .results.labelled import LabelledEstimate as LabelledEstimate, LabelledMatrix as LabelledMatrix
from .sources import (
    naming as naming,
    read as read,
    read_recording as read_recording,
    without_trials as without_trials,
)
from .therapy import (
    calibrate_arm as calibrate_arm,
    calibrate_robot as calibrate_robot,
    contribution as contribution,
)
from .therapy_mockup import check_mockup as check_mockup
