from .base_parameters import (
    MotionChoice as MotionChoice,
    base_parameters as base_parameters,
    choose_motions as choose_motions,
    essential_base_parameters as essential_base_parameters,
    motion_conditions as motion_conditions,
)
from .checks import check_plates as check_plates
from .equations import (
    BodyEquations as BodyEquations,
    BodyValidation as BodyValidation,
    body_equations as body_equations,
)
from .estimate import fit_base as fit_base
from .identify import identify_body as identify_body
from .methods import METHODS as METHODS
from .regressor import inertial_parameters as inertial_parameters
from .result import BodyFit as BodyFit
from .rows import RowChoice as RowChoice, each_trial as each_trial
