from .activation.fit import fit_activation_model as fit_activation_model
from .activation.model import ActivationModel as ActivationModel
from .activation.models import ACTIVATION_MODELS as ACTIVATION_MODELS
from .activation.quality import element_fits as element_fits
from .combined.fit import (
    TypicalMuscles as TypicalMuscles,
    fit_muscle_model as fit_muscle_model,
    typical_muscles as typical_muscles,
)
from .combined.model import MuscleModel as MuscleModel
from .fitted_model import (
    ElementQuality as ElementQuality,
    FittedModel as FittedModel,
    correlation as correlation,
)
from .from_estimates import (
    HandRows as HandRows,
    joint_rows as joint_rows,
    rows_of_hand as rows_of_hand,
)
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
from .prediction import (
    HandPrediction as HandPrediction,
    JointPrediction as JointPrediction,
    Predicted as Predicted,
    at_hand as at_hand,
    hand_motion as hand_motion,
)
from .rows import ELEMENTS as ELEMENTS, JointRows as JointRows
from .workspace import (
    AngleScaling as AngleScaling,
    Region as Region,
    angle_columns as angle_columns,
)
