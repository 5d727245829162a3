from .activation.design import joint_columns as joint_columns, muscle_patterns as muscle_patterns
from .activation.elements import element_fits as element_fits
from .activation.fit import fit_activation_model as fit_activation_model
from .activation.model import ActivationModel as ActivationModel
from .angle_scaling import AngleScaling as AngleScaling, measured_scaling as measured_scaling
from .at_hand import HandPrediction as HandPrediction, at_hand as at_hand
from .combined.fit import fit_muscle_model as fit_muscle_model
from .combined.model import MuscleModel as MuscleModel
from .from_estimates import joint_rows as joint_rows
from .posture.certificate import smallest_eigenvalues as smallest_eigenvalues
from .posture.data import PostureData as PostureData, stiffness_data as stiffness_data
from .posture.fit import fit_posture_model as fit_posture_model
from .posture.gram import STRUCTURES as STRUCTURES
from .posture.model import PostureModel as PostureModel
from .posture.polynomial import fit_polynomial as fit_polynomial
from .posture.program import GramProgram as GramProgram
from .posture.sos import choose as choose, posterior as posterior
from .posture.terms import exponents as exponents, monomials as monomials
from .prediction import JointPrediction as JointPrediction, Predicted as Predicted
from .quality import ElementQuality as ElementQuality, correlation as correlation
from .region import Region as Region
from .rows import (
    ELEMENTS as ELEMENTS,
    JointRows as JointRows,
    matrix as matrix,
    triple as triple,
    triple_sd as triple_sd,
)
