from .base_parameters import (
    base_parameters as base_parameters,
    essential_base_parameters as essential_base_parameters,
)
from .checks import check_plates as check_plates
from .equations import BodyEquations as BodyEquations, body_equations as body_equations
from .estimate import fit_base as fit_base
from .exciting import (
    MotionChoice as MotionChoice,
    choose_motions as choose_motions,
    motion_conditions as motion_conditions,
)
from .identify import identify_body as identify_body
from .methods import METHODS as METHODS
from .parameters import inertial_parameters as inertial_parameters
from .result import BodyFit as BodyFit
from .rows import RowChoice as RowChoice, each_trial as each_trial
from .validation import BodyValidation as BodyValidation
