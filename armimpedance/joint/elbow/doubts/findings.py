"""Findings on reflex, skew, amplitude and band: one sentence each, and advice."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.findings import Finding
from armimpedance.joint.elbow.doubts.contest import NO_CHANCE
from armimpedance.joint.elbow.doubts.kinds import RATE_S
from armimpedance.joint.elbow.doubts.pathway import EARLIEST_S, LATEST_S, SLOWEST_S
from armimpedance.numerics.regression import Parameters

#: An answer below this share of K, or a skew below this share of a sample, is not reported.
LITTLE: Final = 0.01
LITTLE_SAMPLE: Final = 0.5
#: The time constant of a muscle is not reported if it is shorter, ms.
LITTLE_MUSCLE_MS: Final = 5.0
#: A pathway this near to the edge of the search may lie beyond it, s.
EDGE_S: Final = 1e-3
SURE: Final = 0.98
LIKELY: Final = 0.9


@dataclass(frozen=True)
class Lateness:
    """Lateness of the angle after the torque.

    `ci95_s` (2,).
    `probability`: that the angle is late or early at all.
    `if_late_s`: the lateness, given that there is one.
    `smallest_s`: smallest lateness that would have been detected.
    """

    value_s: float
    ci95_s: tuple[float, float]
    probability: float
    if_late_s: float
    smallest_s: float


@dataclass(frozen=True)
class LateAnswer:
    """One late answer, ``h (K_r theta + B_r theta')``; h a delay and a muscle, see `pathway`."""

    K_r: float
    B_r: float
    delay_s: float
    muscle_s: float


@dataclass(frozen=True)
class Reflex:
    """Reflex ``h (K_r theta + B_r theta')``, the parallel cascade's second path after I, B, K.

    `ci95` (2,), `B_r_ci95` (2,), `delay_ci95_s` (2,), `muscle_ci95_s` (2,).
    `K_r`: N m/rad, if there is an answer.
    `B_r`: N m s/rad, if there is an answer.
    `delay_s`, `muscle_s`: of its pathway h.
    `probability`: that there is an answer.
    `smallest`: smallest K_r with a delay of 60 ms that would have been detected.
    `total`, `total_ci95`: K and K_r together, the stiffness at rest, N m/rad.
    `likeliest`: K_r, B_r and the pathway of the single likeliest limb. The values above are means
    over all limbs, and together need not describe any one of them.
    """

    K_r: float
    ci95: tuple[float, float]
    B_r: float
    B_r_ci95: tuple[float, float]
    delay_s: float
    delay_ci95_s: tuple[float, float]
    muscle_s: float
    muscle_ci95_s: tuple[float, float]
    probability: float
    smallest: float
    total: float
    total_ci95: tuple[float, float]
    likeliest: LateAnswer


@dataclass(frozen=True)
class Amplitude:
    """Dependence of the joint on how far and how fast it moves.

    `stiffens`, `rubs`: True if terms of stiffness, or of friction, were detected.
    `more_stiffness`: stiffness at the rms deflection less that of small motion, N m/rad.
    `friction`: torque against the velocity's sign, N m.
    `deflection`: rms, rad.
    `smallest`: smallest change of the stiffness that would have been detected, as a share of it.
    """

    stiffens: bool
    rubs: bool
    more_stiffness: float
    friction: float
    deflection: float
    smallest: float


#: A hidden effect is reported if its interval reaches beyond that of the estimate by more than this
#: share of K.
_HIDES: Final = 0.05


@dataclass(frozen=True)
class Hidden:
    """Range of K if there were a late answer or a skew that the record does not exclude.

    `low`, `high`: N m/rad.
    `matters`: True if it reaches clearly beyond the estimate's own interval.
    """

    low: float
    high: float
    matters: bool

    @classmethod
    def of(cls, own: Parameters, allowing: Parameters) -> Hidden:
        """Compare the intervals without and with these effects."""
        (low, high), (first, last) = allowing.interval()[2], own.interval()[2]
        beyond = max(float(first - low), float(high - last))
        return cls(float(low), float(high), beyond > _HIDES * float(own.values[2]))

    def __str__(self) -> str:
        return f"K would be {self.low:.3g} to {self.high:.3g} N m/rad"


def findings(
    reflex: Reflex,
    late: Lateness,
    amplitude: Amplitude,
    parameters: Parameters,
    hidden: Hidden | None,
    neither: float,
    rate_hz: float,
) -> tuple[Finding, ...]:
    """Return the findings on reflex, skew and amplitude.

    `hidden`: None if an effect was detected, which the intervals then cover.
    `neither`: probability that there is neither a skew nor a late answer.
    `rate_hz`: sample rate; a skew below half a sample is reported without a warning.
    """
    K = float(parameters.values[2])
    either = neither < 1 - SURE
    return (
        _of_reflex(reflex, late, K, hidden, either),
        _of_skew(late, reflex, either, LITTLE_SAMPLE / rate_hz),
        _of_amplitude(amplitude, K),
    )


def _of_reflex(
    reflex: Reflex, late: Lateness, K: float, hidden: Hidden | None, either: bool
) -> Finding:
    size, edge = _size(reflex, K), _at_an_edge(reflex)
    matters = abs(reflex.K_r) + abs(reflex.B_r) / RATE_S > LITTLE * K
    smallest = f"{100 * reflex.smallest / K:.2g} % of K after 60 ms"
    if matters and reflex.probability > SURE:
        message = (
            f"the limb answers the motion (a reflex) {size}; I, B, K are those beside it, for any "
            f"of these; together K {_range(reflex.total, reflex.total_ci95)} at rest; a wider band "
            f"of the perturbation would part them better{edge}"
        )
        return Finding("reflex", "warning", message, smallest)
    # If the channels are surely out of step, that alone may explain the record.
    likely = LIKELY if late.probability > SURE else 1 - SURE
    if either and reflex.probability > likely and matters:
        message = (
            f"an answer to the motion (a reflex) {size}, or channels out of step by "
            f"{1e3 * late.if_late_s:+.2f} ms: the record does not tell which, the intervals hold "
            "both; measure the channels' delay with a known load"
        )
        return Finding("reflex", "cannot tell", message, smallest)
    if hidden is not None and hidden.matters:
        message = (
            "no late answer (reflex) is seen, but the record does not exclude one: were it there, "
            f"{hidden}; a wider band of the perturbation or a longer record would tell"
        )
        return Finding("reflex", "cannot tell", message, smallest)
    return Finding("reflex", "ok", "no late answer that matters", smallest)


def _size(reflex: Reflex, K: float) -> str:
    """Delay, muscle and gains with their intervals, as text."""
    low, high = (1e3 * d for d in reflex.delay_ci95_s)
    quick, slow = (1e3 * m for m in reflex.muscle_ci95_s)
    size = f"after {1e3 * reflex.delay_s:.0f} ms ({low:.0f} to {high:.0f})"
    if slow > LITTLE_MUSCLE_MS:
        size += f" by a muscle of {1e3 * reflex.muscle_s:.0f} ms ({quick:.0f} to {slow:.0f})"
    size += f" of K_r {_range(reflex.K_r, reflex.ci95)} N m/rad"
    if abs(reflex.B_r) > LITTLE * RATE_S * K:
        size += f" and B_r {_range(reflex.B_r, reflex.B_r_ci95)}"
    return size


def _range(value: float, limits: tuple[float, float]) -> str:
    return f"{value:.3g} ({limits[0]:.3g} to {limits[1]:.3g})"


def _at_an_edge(reflex: Reflex) -> str:
    """Remark if delay or muscle may lie beyond the range of the search; else an empty string."""
    answer = reflex.likeliest
    early, late = answer.delay_s <= EARLIEST_S + EDGE_S, answer.delay_s >= LATEST_S - EDGE_S
    if not (early or late or answer.muscle_s >= SLOWEST_S - EDGE_S):
        return ""
    return (
        f"; it lies at the edge of what is searched ({1e3 * EARLIEST_S:.0f} to "
        f"{1e3 * LATEST_S:.0f} ms, muscles up to {1e3 * SLOWEST_S:.0f} ms): its delay and K beside "
        "it may lie beyond these intervals"
    )


def _of_skew(late: Lateness, reflex: Reflex, either: bool, little_s: float) -> Finding:
    low, high = (1e3 * T for T in late.ci95_s)
    size = f"{1e3 * late.value_s:+.2f} ms ({low:+.2f} to {high:+.2f})"
    smallest = f"{1e3 * late.smallest_s:.2g} ms"
    if late.probability > SURE and abs(late.value_s) > little_s:
        message = (
            f"the angle comes {size} after the torque; the estimate allows for it; look for the "
            "filter or converter that delays one channel"
        )
        return Finding("skew", "warning", message, smallest)
    likely = LIKELY if reflex.probability > SURE else 1 - SURE
    if either and late.probability > likely and abs(late.if_late_s) > little_s:
        if reflex.probability > SURE:
            message = (
                f"beside the reflex the channels may be out of step: {size}; the intervals allow"
            )
            return Finding("skew", "cannot tell", f"{message} for it", smallest)
        message = (
            f"in step, or the angle {1e3 * late.if_late_s:+.2f} ms after the torque: see reflex; "
            "the intervals hold both"
        )
        return Finding("skew", "cannot tell", message, smallest)
    return Finding("skew", "ok", f"angle after torque by {size}", smallest)


def _of_amplitude(amplitude: Amplitude, K: float) -> Finding:
    smallest = f"{100 * amplitude.smallest:.2g} % of K at {amplitude.deflection:.2g} rad rms"
    messages = []
    if amplitude.stiffens:
        messages.append(
            f"the stiffness depends on the deflection: {amplitude.more_stiffness:+.3g} N m/rad at "
            f"{amplitude.deflection:.2g} rad rms; I, B, K are those of small motion, K {K:.3g}"
        )
    if amplitude.rubs:
        messages.append(
            f"the joint resists like friction, {amplitude.friction:.2g} N m against any motion; "
            "I, B, K are those beside it"
        )
    if messages:
        advice = "perturb by the amplitude that you ask about"
        return Finding("amplitude", "warning", "; ".join([*messages, advice]), smallest)
    return Finding("amplitude", "ok", "small and large motion give one limb", smallest)


def band_finding(parameters: Parameters, excess: FloatArray) -> Finding:
    """Report if I, B and K are the same in all parts of the band; `excess` of
    `excess_over_bands`."""
    smallest = f"{np.sqrt(NO_CHANCE):.0f} standard errors"
    if (excess == 1).all():
        return Finding("band", "ok", "every part of the band gives the same I, B and K", smallest)
    half = parameters.interval()[:, 1] - parameters.values
    steps = ", ".join(
        f"{name} {value:.3g} +- {limit:.2g}"
        for name, value, limit, factor in zip("IBK", parameters.values, half, excess, strict=True)
        if factor > 1
    )
    return Finding(
        "band",
        "warning",
        f"no limb that was fitted is the same in all parts of the band: {steps} from part to part, "
        "which the interval holds; soft tissue, a strap, a lag or a second joint; choose the band "
        "that you ask about with --lowest-hz and --cutoff-hz",
        smallest,
    )


def unlike_finding(own: Parameters, extended: Parameters) -> Finding:
    """Report that answer, skew and bend replaced the limb instead of adding to it."""
    pairs = zip("IBK", own.values, extended.values, strict=True)
    pair = ", ".join(f"{name} {without:.3g} or {added:.3g}" for name, without, added in pairs)
    return Finding(
        "band",
        "warning",
        f"no limb that was fitted describes the record: {pair}, without and with a late answer, a "
        "skew and a bend, and the interval holds both; soft tissue, a strap, a lag or "
        "the wrong rig; choose the band that you ask about with --lowest-hz and --cutoff-hz",
    )
