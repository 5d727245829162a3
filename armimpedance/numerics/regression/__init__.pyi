from .covariance import (
    CovarianceKind as CovarianceKind,
    bootstrap as bootstrap,
    leave_one_out as leave_one_out,
    long_run_covariance as long_run_covariance,
)
from .diagnose import (
    Conditioning as Conditioning,
    conditioning as conditioning,
    pool as pool,
    refuse_rank_loss as refuse_rank_loss,
)
from .equations import (
    WORST_CONDITION as WORST_CONDITION,
    TrialEquations as TrialEquations,
    leave_one_out_shift as leave_one_out_shift,
    solve_equations as solve_equations,
    solve_total as solve_total,
)
from .errors_in_regressors import (
    Corrected as Corrected,
    ErrorMoments as ErrorMoments,
    refuse_unreliable as refuse_unreliable,
    small_sample_term as small_sample_term,
    solve_corrected as solve_corrected,
)
from .factors import (
    TrialFactors as TrialFactors,
    ragged_factors as ragged_factors,
    trial_factors as trial_factors,
)
from .parameters import (
    PARAMETER_ROW as PARAMETER_ROW,
    Derived as Derived,
    NamedParameter as NamedParameter,
    Parameters as Parameters,
    parameter_rows as parameter_rows,
    t_factor as t_factor,
    t_interval as t_interval,
    with_derived as with_derived,
)
from .result import Fit as Fit, FitSummary as FitSummary, Validation as Validation
from .solve import fit as fit, split_blocks as split_blocks
