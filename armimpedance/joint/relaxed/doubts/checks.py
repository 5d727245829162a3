"""Test the assumptions of a passive joint's model.

Each check states its detection limit. An error of the mass and a constant torque of the person
cannot be detected. All torques of a free limb are proportional to its mass, so a heavier limb with
larger k, h and f swings alike; a constant torque acts like a change of the rest angle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.special import chdtrc, fdtrc

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import ArmImpedanceError
from armimpedance.core.findings import Finding
from armimpedance.joint.relaxed.doubts.rivals import cause_findings
from armimpedance.joint.relaxed.equations import Terms
from armimpedance.joint.relaxed.methods import METHODS
from armimpedance.joint.relaxed.samples import PassiveSamples
from armimpedance.numerics.criticism import change_over_trials

if TYPE_CHECKING:
    from armimpedance.joint.relaxed.linear import TwoFits

#: Significance level of the checks.
_LEVEL: Final = 0.002

#: Factor by which a single trial's standard errors may be too small if the torque was measured:
#: chi^2 of 60 clean sessions of three trials was 1 to 86, where 8 is expected.
MISJUDGED: Final = 3.0

#: Relative sd of a table's mass of forearm and hand: that of the three rows of
#: `limb.arm.anthropometry` about their mean (Winter .0220, de Leva .0223 and .0194 of the body's
#: mass).
TABLE_MASS_SD: Final = 0.075


def mass_finding(stated: float | None) -> Finding:
    """Finding on the limb's mass: its stated sd as a fraction, or None."""
    if stated is not None:
        return Finding("mass", "ok", f"known to {100 * stated:g} %, which the intervals count")
    return Finding(
        "mass",
        "cannot tell",
        "a free swing does not show it, and k, h and f move by 1 % per 1 % of it; the intervals "
        f"allow for {100 * TABLE_MASS_SD:g} % as between tables of masses (--mass-sd-percent or "
        "mass_sd_kg of the subject says it better)",
    )


def doubts(
    samples: PassiveSamples, terms: Terms, method: str, fits: TwoFits, elsewhere: str | None
) -> tuple[Finding, ...]:
    """Run the checks of one joint that its samples allow.

    `samples`: of this joint only.
    `fits`: the method's fit of the columns.
    `elsewhere`: sentence on the rest angle if the data contradict the stated one.
    """
    findings = list(_causes(samples, terms))
    raw = samples.hinges is not None or samples.measured_torque is not None
    if raw and method == "output-error":
        findings.append(trials_finding(samples, terms, method))
    if method == "ls":
        findings.append(_filter_finding(samples, terms, fits))
    if not terms.free and elsewhere is None:
        findings.append(Finding("rest angle", "ok", "the data do not contradict the stated one"))
    return tuple(findings)


def _causes(samples: PassiveSamples, terms: Terms) -> tuple[Finding, ...]:
    """Findings on causes that the samples can separate; without raw data only on the stiffness."""
    try:
        if samples.hinges is None and samples.measured_torque is None:
            return (_stiffness_finding(samples, terms),)
        return cause_findings(samples, terms)
    except ArmImpedanceError as failed:
        return (Finding("amplitude", "cannot tell", f"whether the model holds ({failed})"),)


def _stiffness_finding(samples: PassiveSamples, terms: Terms) -> Finding:
    """Test if the stiffness is the same over the whole motion, by the filtered columns."""
    name = "amplitude"
    more = replace(terms, quadratic=True, cubic=True)
    extra = [more.columns.index(column) for column in ("K", "C") if column not in terms.columns]
    fit = METHODS["parallel"].solve(samples, more).robust
    size, spread = fit.parameters[extra], fit.covariance[np.ix_(extra, extra)]
    # F = x^T (m,) C^-1 (m, m) x / m
    chance = fdtrc(len(extra), fit.dof, float(size @ np.linalg.solve(spread, size)) / len(extra))
    if chance >= _LEVEL:
        return Finding(name, "ok", "the stiffness is the same all over the motion")
    return Finding(
        name,
        "warning",
        "the stiffness changes with the angle: k, h, f and q_r are those of a straight line "
        "through a curve, and smaller swings show less of it",
    )


def trials_finding(samples: PassiveSamples, terms: Terms, method: str) -> Finding:
    """Test if the trials (or thirds of a single one) have the same parameters."""
    parts = samples if samples.n_trials > 1 else samples.in_thirds()
    fits: list[tuple[str, FloatArray, FloatArray]] = []
    for row, name in enumerate(parts.trials):
        try:
            fit = METHODS[method].solve(parts.select([row]), terms).robust
            np.linalg.inv(fit.covariance)
        except (ArmImpedanceError, np.linalg.LinAlgError):
            continue
        label = name if samples.n_trials == 1 else f"trial {name}"
        fits.append((label, fit.parameters, fit.covariance))
    if len(fits) < 2:
        return Finding("trials", "missing", "no two trials that show all parameters each")
    values, weights = [x for _, x, _ in fits], [np.linalg.inv(C) for _, _, C in fits]
    # x (p,) = (sum P_t)^-1 sum P_t x_t, and chi^2 = sum (x_t - x)^T P_t (x_t - x)
    mean = np.linalg.solve(sum(weights), sum(P @ x for P, x in zip(weights, values, strict=True)))
    square = sum(float((x - mean) @ P @ (x - mean)) for P, x in zip(weights, values, strict=True))
    count = len(mean) * (len(values) - 1)
    smallest = "a trial that is off by four of its own standard errors"
    if samples.hinges is None:
        square /= MISJUDGED**2
    if chdtrc(count, square) >= _LEVEL:
        return Finding("trials", "ok", "one set of parameters does for all trials", smallest)
    k = ", ".join(f"{x[0]:.3g}" for x in values[:6])
    text = f"they contradict each other (chi^2 {square:.0f}, {count} expected; k {k})"
    return Finding("trials", "warning", f"{text}: {_why(fits, terms)}", smallest)


def _why(fits: Sequence[tuple[str, FloatArray, FloatArray]], terms: Terms) -> str:
    """Probable reason for a contradiction between trials, from the course of k, h and f."""
    many = "muscles that were not silent, a joint that changes, or markers that slide on the skin"
    scaled = [i for i, name in enumerate(terms.columns) if name in ("k", "h", "f")]
    sd = np.array([np.sqrt(np.diag(C)) for _, _, C in fits])[:, scaled]
    change = change_over_trials(np.array([x for _, x, _ in fits])[:, scaled], sd)
    if change is None or not change.seen:
        return many
    when = "slowly" if change.first is None else f"from {fits[change.first][0]} on"
    size = f"{100 * change.size:+.0f} % (sd {100 * change.error:.0f})"
    if change.alike:
        return f"k, h and f change alike {when} by {size}: a gain, or another person"
    return f"k changes {when} by {size}: {many}"


def _filter_finding(samples: PassiveSamples, terms: Terms, fits: TwoFits) -> Finding:
    """Effect of the source's unfiltered sign and of the trials' ends, compared with `parallel`."""
    try:
        beside = METHODS["parallel"].solve(samples, terms).robust
    except ArmImpedanceError as error:
        return Finding("filter", "cannot tell", f"what the filter costs ({error})")
    off = np.abs(fits.classical.parameters - beside.parameters) / beside.sd
    worst = int(np.argmax(off))
    if off[worst] < 1.0:
        return Finding("filter", "ok", "with every column filtered the parameters stay", "1 sd")
    name = terms.names[worst] if terms.columns[worst] != "offset" else "the offset"
    return Finding(
        "filter",
        "warning",
        "the sign of the velocity is not filtered as the torque is, and the trials' ends count: "
        f"{name} is {fits.classical.parameters[worst]:.3g} against {beside.parameters[worst]:.3g} "
        "by parallel; ls reproduces the source, use another method for the numbers",
        "1 sd",
    )
