from .chart import Chart as Chart
from .components import fit_components as fit_components, total_covariance as total_covariance
from .cones import (
    NearestMatrices as NearestMatrices,
    Place as Place,
    nearest_semidefinite as nearest_semidefinite,
)
from .covariance import CovarianceKind as CovarianceKind
from .diagnose import (
    Conditioning as Conditioning,
    conditioning as conditioning,
    refuse_rank_loss as refuse_rank_loss,
)
from .equations import (
    WORST_CONDITION as WORST_CONDITION,
    Solution as Solution,
    TrialEquations as TrialEquations,
    equations_of as equations_of,
    leave_one_out_shift as leave_one_out_shift,
    solve_equations as solve_equations,
    solve_total as solve_total,
)
from .errors_in_regressors import (
    DOUBTFUL as DOUBTFUL,
    Corrected as Corrected,
    ErrorMoments as ErrorMoments,
    refuse_unreliable as refuse_unreliable,
    small_sample_term as small_sample_term,
    solve_corrected as solve_corrected,
)
from .factors import (
    TrialFactors as TrialFactors,
    prediction_quality as prediction_quality,
    ragged_factors as ragged_factors,
    split_blocks as split_blocks,
    trial_factors as trial_factors,
)
from .parameters import (
    NamedParameter as NamedParameter,
    Parameters as Parameters,
    t_factor as t_factor,
    t_interval as t_interval,
)
from .pooled import pool as pool
from .resample import bootstrap as bootstrap, leave_one_out as leave_one_out
from .result import (
    Fit as Fit,
    Validation as Validation,
    with_covariance as with_covariance,
)
from .solve import fit as fit
from .summary import FitSummary as FitSummary
