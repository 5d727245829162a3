from .activation.elements import element_fits as element_fits
from .activation.fit import fit_activation_model as fit_activation_model
from .activation.model import ActivationModel as ActivationModel
from .activation.models import ACTIVATION_MODELS as ACTIVATION_MODELS
from .angle_scaling import AngleScaling as AngleScaling, angle_columns as angle_columns
from .at_hand import (
    HandPrediction as HandPrediction,
    at_hand as at_hand,
    hand_motion as hand_motion,
)
from .combined.fit import fit_muscle_model as fit_muscle_model
from .combined.model import MuscleModel as MuscleModel
from .combined.typical import TypicalMuscles as TypicalMuscles, typical_muscles as typical_muscles
from .fitted_model import FittedModel as FittedModel
from .from_estimates import joint_rows as joint_rows
from .from_hand import rows_of_hand as rows_of_hand
from .hand_rows import HandRows as HandRows
from .kinds import MODEL_KINDS as MODEL_KINDS, kind_of as kind_of
from .model_json import read_model as read_model, write_model as write_model
from .packed import (
    congruence as congruence,
    elements as elements,
    kept_elements as kept_elements,
    matrix as matrix,
    triple as triple,
    unpacked as unpacked,
)
from .posture.fit import fit_posture_model as fit_posture_model
from .posture.model import PostureModel as PostureModel
from .posture.models import POSTURE_MODELS as POSTURE_MODELS
from .posture.program import GramProgram as GramProgram
from .prediction import JointPrediction as JointPrediction, Predicted as Predicted
from .quality import ElementQuality as ElementQuality, correlation as correlation
from .region import Region as Region
from .rows import ELEMENTS as ELEMENTS, JointRows as JointRows
