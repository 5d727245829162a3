from .bound import bound as bound, bound_of as bound_of, inverse_information as inverse_information
from .checks import check_response as check_response
from .doubts.allowance import allowing as allowing
from .doubts.departures import largest_conditions as largest_conditions
from .doubts.filter import in_step as in_step
from .doubts.foretold import (
    expected_mean_squares as expected_mean_squares,
    foretold_allowance as foretold_allowance,
)
from .doubts.inner import (
    WRIST as WRIST,
    Elbow as Elbow,
    averaged_inner as averaged_inner,
    elbow_told as elbow_told,
    is_wrist_free as is_wrist_free,
    with_inner as with_inner,
)
from .doubts.inner_fit import InnerFits as InnerFits
from .doubts.inner_modes import (
    INNER_DIRECTIONS as INNER_DIRECTIONS,
    INNER_MODES as INNER_MODES,
    half_sphere as half_sphere,
)
from .doubts.knowledge import Knowledge as Knowledge
from .doubts.model import Model as Model, knowledge_by_trial as knowledge_by_trial
from .estimation import (
    Options as Options,
    estimate as estimate,
    estimate_window as estimate_window,
    groups_of as groups_of,
    in_order as in_order,
)
from .methods import METHODS as METHODS
from .modal import modal_equation as modal_equation
from .reflex import guard_window as guard_window
from .reflex_verdict import ReflexVerdict as ReflexVerdict
from .result import Group as Group
from .weighing import (
    FEWEST_TRIALS as FEWEST_TRIALS,
    NoiseModel as NoiseModel,
    force_covariance as force_covariance,
    through_impedance as through_impedance,
)
