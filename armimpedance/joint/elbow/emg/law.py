"""Fit K and B as linear laws of the EMG amplitudes of flexor and extensor, Ruiz (2011), (4).

    K = k0 + kF s_F + kE s_E,   B = b0 + bF s_F + bE s_E

Amplitudes are estimates with errors, and least squares, which the source uses, therefore biases the
slopes towards zero. Here these errors are accounted for
(`numerics.regression.errors_in_regressors`); the result of plain least squares is reported too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, frozen_array
from armimpedance.core.errors import InputError
from armimpedance.joint.elbow.elbow_result import ElbowFit
from armimpedance.joint.elbow.emg.crosstalk import SUPPOSED
from armimpedance.joint.elbow.emg.curvature import (
    Bend,
    bend_of,
    error_covariance,
    error_moments,
    settled_variance,
)
from armimpedance.joint.elbow.emg.law_result import LAWS, EmgLaw, LinearLaw, constant_and
from armimpedance.joint.elbow.emg.roles import Action, check_names, refuse_alike
from armimpedance.numerics.regression import (
    Corrected,
    Parameters,
    small_sample_term,
    solve_corrected,
)


def fit_emg_law(
    stiffness: ArrayLike,
    stiffness_sd: ArrayLike,
    amplitude: ArrayLike,
    amplitude_sd: ArrayLike,
    *,
    viscosity: ArrayLike | None = None,
    viscosity_sd: ArrayLike | None = None,
    muscles: Sequence[str] = ("flexor", "extensor"),
    crosstalk_sd: float = SUPPOSED,
) -> EmgLaw:
    """Fit (4) to L operating points.

    `stiffness`, `stiffness_sd` (L,): N m/rad, and standard errors (0: not known, equal weights).
    `amplitude` (L, m): shares of the maximum contraction.
    `amplitude_sd` (L, m), (m,) or (): standard errors.
    `viscosity`, `viscosity_sd` (L,): N m s/rad.
    `crosstalk_sd`: prior sd of the share of another muscle's amplitude in a channel, for which the
    intervals of single muscles allow; 0: no crosstalk, or it was removed.
    Raises InputError: shapes that do not match, negative errors, no more points than coefficients.
    Raises NotIdentifiableError: amplitudes that do not vary, that vary together, or that are mostly
    errors.
    Raises EstimationError: weights and slopes do not converge.
    """
    K = fit_law("K", stiffness, stiffness_sd, amplitude, amplitude_sd, muscles=muscles)
    B = None
    if viscosity is not None:
        sd = np.zeros(len(np.asarray(viscosity))) if viscosity_sd is None else viscosity_sd
        B = fit_law("B", viscosity, sd, amplitude, amplitude_sd, muscles=muscles)
    return EmgLaw(K, B).with_crosstalk(crosstalk_sd)


def fit_emg_law_of(
    fits: Sequence[ElbowFit],
    amplitude: ArrayLike,
    amplitude_sd: ArrayLike,
    *,
    muscles: Sequence[str] = ("flexor", "extensor"),
    torque: ArrayLike | None = None,
    roles: Mapping[str, Action] | None = None,
    crosstalk_sd: float = SUPPOSED,
) -> EmgLaw:
    """Fit K and B as linear laws of the amplitudes, from one fit per operating point.

    Parameters
    ----------
    fits : sequence of L ElbowFit
        Their robust standard errors are the points' weights.
    amplitude : (L, m)
        Shares of the maximum contraction.
    amplitude_sd : (L, m), (m,) or float
        Standard errors.
    muscles : sequence of m str
    torque : (L,), optional
        Mean torque of the limb on the device, N m, flexion positive, up to a constant: the torque
        that the muscles hold. The muscles' names are checked against its sign.
    roles : mapping of muscle to "flexor" or "extensor", optional
        For muscles whose names do not show their role.
    crosstalk_sd : float
        Prior sd of the share of another muscle's amplitude in a channel, for which the intervals of
        single muscles allow; 0 if there is no crosstalk, or it was removed.

    Returns
    -------
    EmgLaw

    Raises
    ------
    InputError, NotIdentifiableError, EstimationError
        As `fit_emg_law`.
    """
    K, B = [f.stiffness for f in fits], [f.viscosity for f in fits]
    law = fit_emg_law(
        [k.value for k in K],
        [k.sd_robust for k in K],
        amplitude,
        amplitude_sd,
        viscosity=[b.value for b in B],
        viscosity_sd=[b.sd_robust for b in B],
        muscles=muscles,
        crosstalk_sd=crosstalk_sd,
    )
    if torque is None:
        return law
    torque_law = fit_law("torque", torque, 0.0, amplitude, amplitude_sd, muscles=muscles)
    return replace(law, of_trials=(*law.of_trials, check_names(torque_law, roles)))


def fit_law(
    symbol: str,
    value: ArrayLike,
    value_sd: ArrayLike,
    amplitude: ArrayLike,
    amplitude_sd: ArrayLike,
    *,
    muscles: Sequence[str],
) -> LinearLaw:
    """Fit one linear law of m amplitudes.

    Parameters
    ----------
    symbol : {"K", "B", "torque"}
    value, value_sd : (L,)
        Values and standard errors (0: not known, equal weights).
    amplitude, amplitude_sd
        As `fit_emg_law`.
    muscles : sequence of m str

    Returns
    -------
    LinearLaw

    Raises
    ------
    InputError, NotIdentifiableError, EstimationError
        As `fit_emg_law`; InputError also for an unknown symbol.

    Notes
    -----
    A point's weight is ``1 / (sd^2 + sum_i (c_i sd_i)^2 + scatter^2)``. The scatter is chosen so
    that the weighted squares of the residuals sum to the degrees of freedom. If squares of the
    amplitudes are significant, the coefficients' intervals cover those of the bent law too, and a
    finding reports it.
    """
    if symbol not in LAWS:
        raise InputError(f"unknown law {symbol!r}", expected=f"one of {', '.join(LAWS)}")
    y, sd, s, s_sd = _points(value, value_sd, amplitude, amplitude_sd, muscles)
    names = ("constant", *muscles)
    conds = refuse_alike(s, s_sd, tuple(muscles))
    W, S = constant_and(s), error_covariance(s_sd)
    variance, scatter = settled_variance(W, y, sd, S, names)
    moments = error_moments(W, y, S, variance, names)
    solved = solve_corrected(moments, small_sample_term(moments))
    residual = y - W @ solved.coefficients
    weight = 1 / variance
    deviation = y - np.average(y, weights=weight)
    bend = bend_of(symbol, W, y, variance, solved.coefficients[1:])
    law = LinearLaw(
        symbol=symbol,
        muscles=tuple(muscles),
        parameters=_parameters(symbol, muscles, solved, bend),
        covariance=solved.covariance,
        bend=bend,
        naive=solved.naive,
        scatter=scatter,
        r2=1 - float(weight @ residual**2) / max(float(weight @ deviation**2), 1e-300),
        cond_raw=conds[0],
        cond_scaled=conds[1],
        reliability=solved.reliability,
        lowest=s.min(axis=0),
        highest=s.max(axis=0),
        n=len(y),
    )
    return _warned(law, solved)


def _parameters(symbol: str, muscles: Sequence[str], solved: Corrected, bend: Bend) -> Parameters:
    """Parameters ``k0, k_<muscle>, ...``: the symbol in lower case (torque: a)."""
    letter, means = LAWS[symbol]
    return Parameters(
        names=(f"{letter}0", *(f"{letter}_{muscle}" for muscle in muscles)),
        units=(means.unit,) * (1 + len(muscles)),
        values=solved.coefficients,
        covariance=solved.covariance + bend.covariance,
        covariance_kind="cr3",
        dof=solved.dof,
        plain_covariance=solved.naive_covariance,
    )


def _points(
    value: ArrayLike,
    value_sd: ArrayLike,
    amplitude: ArrayLike,
    amplitude_sd: ArrayLike,
    muscles: Sequence[str],
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return checked values and errors (L,), amplitudes and errors (L, m)."""
    y = frozen_array(value, "values", (None,))
    s = frozen_array(amplitude, "amplitudes", (len(y), len(muscles)))
    if len(y) < s.shape[1] + 2:
        raise InputError(
            f"{len(y)} operating points for {s.shape[1] + 1} coefficients",
            expected=f"{s.shape[1] + 2} or more",
        )
    try:
        sd = np.broadcast_to(np.asarray(value_sd, dtype=np.float64), y.shape)
        s_sd = np.broadcast_to(np.asarray(amplitude_sd, dtype=np.float64), s.shape)
    except ValueError as error:
        raise InputError(f"standard errors do not fit the points: {error}") from error
    for name, errors in (("values", sd), ("amplitudes", s_sd)):
        if not (np.isfinite(errors).all() and (errors >= 0).all()):
            raise InputError(f"a standard error of the {name} is negative or not finite")
    return y, sd, s, s_sd


def _warned(law: LinearLaw, solved: Corrected) -> LinearLaw:
    """Return the law with its warnings."""
    warnings = []
    if solved.doubtful:
        warnings.append(
            f"errors explain {100 - 100 * law.reliability:.0f} % of how the amplitude of "
            f"{' and '.join(solved.least_certain)} varies: least squares is flattened by it, and "
            "the correction is rough"
        )
    if law.symbol in ("K", "B"):
        warnings += _negative(law)
    return replace(law, warnings=tuple(warnings))


def _negative(law: LinearLaw) -> list[str]:
    """Warnings on muscles that seem to lower K or B."""
    warnings = []
    for term in list(law.parameters)[1:]:
        if term.value < 0:
            low, high = term.ci95
            sure = "surely so" if high < 0 else "perhaps by its errors"
            warnings.append(
                f"{term.name} is negative ({term.value:.3g}, {low:.3g} to {high:.3g}; {sure}): a "
                "muscle does "
                f"not lower {law.symbol} as it becomes more active"
            )
    return warnings
