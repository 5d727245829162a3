from .base_parameters import (
    BaseParameters as BaseParameters,
    base_parameters as base_parameters,
    essential_base_parameters as essential_base_parameters,
)
from .checks import check_body as check_body
from .equations import BodyEquations as BodyEquations, body_equations as body_equations
from .estimate import fit_base as fit_base
from .exciting import (
    MotionChoice as MotionChoice,
    choose_motions as choose_motions,
    motion_conditions as motion_conditions,
)
from .identify import (
    CUTOFF_HZ as CUTOFF_HZ,
    METHODS as METHODS,
    NOISE_DRAWS as NOISE_DRAWS,
    identify_body as identify_body,
)
from .joint_terms import passive_terms as passive_terms, robot_terms as robot_terms
from .parameters import (
    PARAMETERS as PARAMETERS,
    inertial_parameters as inertial_parameters,
    moving_segments as moving_segments,
)
from .result import BodyFit as BodyFit
from .rows import RowChoice as RowChoice, TrialRows as TrialRows, each_trial as each_trial
from .validation import BodyValidation as BodyValidation, validate as validate
