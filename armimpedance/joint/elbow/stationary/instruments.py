"""Instruments: columns that follow the motion but are free of its noise.

``sum Z^H W (Tau - X p) = 0`` over the coefficients of the band, ``X = [s^2 s 1] Theta``: the
equation of motion in continuous time (see `band`), without hold or bilinear warping, at any sample
rate. If the recording has the device's perturbation, Z comes from the angle that a joint of second
order, limb and device together, makes of it. This angle is free of sensor noise and of the
subject's own torque, which the measured torque is not. Else Z comes from the measured torque,
corrected for the noise that the residual shows. Model, instruments and weights are refined in turn
(P. C. Young, Recursive Estimation and Time-Series Analysis, 2nd ed. 2011, chapters 7, 8; with a
reference signal in the frequency domain: R. Pintelon, J. Schoukens, System Identification, 2nd ed.
2012, chapter 9).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError
from armimpedance.joint.elbow.elbow_result import NAMES, UNITS
from armimpedance.joint.elbow.stationary.band import Band, Bins, Complex, in_time, real_rows
from armimpedance.joint.elbow.stationary.estimate import (
    Estimate,
    Rows,
    Solved,
    estimate_of,
    solve_rows,
    without,
)

# I, B and K of a band: linear least squares as a start, then output error.
#
# Output error minimises ``sum |Z Theta - Tau|^2 / (s_theta^2 |Z|^2 + s_tau^2)``, summed over the
# coefficients of the band, by I, B, K. Without torque noise this is the error of the simulated
# angle, ``|Theta - Tau / Z|^2``; with noise of both channels it is the maximum of the likelihood
# for any true motion (R. Pintelon, J. Schoukens, System Identification, 2nd ed. 2012, chapter 9).

_STARTS: Final = 6
_STEPS: Final = 60
_HALVINGS: Final = 30
#: The search ends when the step of the logarithms is below this.
_SETTLED_FIT: Final = 1e-9
_LONGEST: Final = 1.0


def start_values(band: Band) -> FloatArray:
    """Rough positive I, B, K (3,) by linear least squares, weighted by the previous fit.

    Raises EstimationError: the torque takes energy from the joint over all frequencies, so its sign
    is wrong.
    """
    _refuse_wrong_sign(band)
    columns = [np.column_stack([b.powers * b.angle[:, None], b.torque]) for b in band.trials]
    weights = [b.weight(_rough(b)) for b in band.trials]
    values = np.ones(3)
    for _ in range(_STARTS):
        trials = zip(band.trials, columns, weights, strict=True)
        table = np.concatenate([bins.free(w, c) for bins, c, w in trials])
        scale = np.linalg.norm(table[:, :3], axis=0)
        # X (n, 3) [I B K] (3,) = Tau (n,)
        values = np.linalg.lstsq(table[:, :3] / scale, table[:, 3], rcond=None)[0] / scale
        # A parameter lost in the noise starts small, at a tenth of a detectable value.
        values = np.maximum(values, 0.1 * np.linalg.norm(table[:, 3]) / scale / 10)
        weights = [b.weight(b.impedance(values)) for b in band.trials]
    return np.asarray(values)


def _rough(bins: Bins) -> Complex:
    """Rough |Z| (n,) from smoothed powers."""
    kernel = np.ones(5) / 5
    torque = np.convolve(np.abs(bins.torque) ** 2, kernel, mode="same")
    angle = np.convolve(np.abs(bins.angle) ** 2, kernel, mode="same")
    return np.sqrt(torque / np.maximum(angle, np.finfo(float).tiny)).astype(complex)


def _refuse_wrong_sign(band: Band) -> None:
    work = sum(float((b.torque * np.conj(b.s * b.angle)).real.sum()) for b in band.trials)
    size = sum(float(np.abs(b.torque * b.s * b.angle).sum()) for b in band.trials)
    if work < -0.1 * size:
        raise EstimationError(
            "B comes out negative: the torque takes energy from the joint; it seems to have the "
            "wrong sign (force_by), or the subject drives the motion"
        )


def fit_band(band: Band) -> FloatArray:
    """I, B, K (3,) by output error, at the minimum nearest to `start_values`.

    Raises EstimationError: the search does not converge, or the torque has the wrong sign.
    """
    logs = np.log(start_values(band))
    cost = _cost(band, logs)
    for _ in range(_STEPS):
        parts = [linearised(bins, np.exp(logs)) for bins in band.trials]
        J, e = (np.concatenate([p[i] for p in parts]) for i in range(2))
        # J (n, 3) step (3,) = -e (n,)
        step = np.linalg.lstsq(J, -e, rcond=None)[0]
        step *= min(1.0, _LONGEST / max(float(np.abs(step).max()), 1e-300))
        for _ in range(_HALVINGS):
            better = _cost(band, logs + step)
            if better <= cost:
                break
            step = step / 2
        else:
            step = np.zeros(3)
            better = cost
        logs, cost = logs + step, better
        if np.abs(step).max() < _SETTLED_FIT:
            return np.asarray(np.exp(logs))
    raise EstimationError(
        f"output error does not settle within {_STEPS} steps: the record does not hold I, B and K "
        "of one joint"
    )


def _cost(band: Band, logs: FloatArray) -> float:
    return sum(float((b.residual(np.exp(logs)) ** 2).sum()) for b in band.trials)


def linearised(bins: Bins, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Weighted residual (2 n,) and its derivative by the logarithms of I, B, K (2 n, 3), in reverse
    order.
    """
    Z = bins.impedance(values)
    power, weight = bins.noise_power(Z), bins.weight(Z)
    slope = bins.powers * values
    # d|Z|^2 / d ln p_j = 2 Re(conj(Z) s^j p_j); its factor is the angle's noise alone
    d_power = 2 * bins.angle_noise[:, None] * (np.conj(Z)[:, None] * slope).real
    e = bins.residual(values)
    J = real_rows(slope * (bins.angle * weight)[:, None])
    J = J - 0.5 * e[:, None] * np.concatenate([d_power / power[:, None]] * 2)
    return without(real_rows(bins.ends * weight[:, None]), J)[0], e


# The motion that a command explains, from neighbouring frequencies only.
#
# Near line k the response to a command is nearly constant: ``Theta_j = (g0 + g1 d + g2 d^2) R_j +
# t0 + t1 d``, ``d = j - k``, over the neighbouring lines; t0, t1 describe the leakage from the
# record's ends (the local polynomial method: R. Pintelon, J. Schoukens, System Identification, 2nd
# ed. 2012, chapter 7). Line k itself is left out, so ``g0 R_k`` is free of its noise, from sensors
# or the subject, whatever device lies between command and joint.

#: Number of lines on each side in the local fit.
SIDE: Final = 10
#: Relative ridge on the squares of its columns, so that lines without command explain nothing.
_RIDGE: Final = 1e-9


def explained_motion(angle: Complex, command: Complex) -> Complex:
    """Part of the angle that the command explains; each line is left out of its own fit.

    `angle`, `command` (n,) complex: neighbouring Fourier coefficients of one trial.
    Returns: (n,) complex.
    """
    n = len(angle)
    width = min(2 * SIDE + 1, n)
    first = np.clip(np.arange(n) - width // 2, 0, n - width)
    window = first[:, None] + np.arange(width)
    d = (window - np.arange(n)[:, None]) / SIDE
    R = command[window]
    # X (n, width, 5) [g0 g1 g2 t0 t1] (5,) = Theta (n, width), line k itself with weight zero
    size = np.sqrt((np.abs(R) ** 2).mean(axis=1, keepdims=True)) + np.finfo(float).tiny
    X = np.stack([R, R * d, R * d**2, size + 0 * d, size * d], axis=-1)
    X = X * (d != 0)[..., None]
    across = np.conj(X).transpose(0, 2, 1)
    gram = across @ X
    scale = np.trace(gram, axis1=1, axis2=2).real[:, None, None] + np.finfo(float).tiny
    gram = gram + _RIDGE * scale * np.eye(5)
    fitted = np.linalg.solve(gram, across @ angle[window][..., None])[..., 0]
    return np.asarray(fitted[:, 0] * command)


ROUNDS: Final = 60
#: Rounds that start from the previous result; later rounds start half way, against oscillation.
_FREE_ROUNDS: Final = 4
#: A parameter that becomes zero or negative restarts at this share of its previous value.
_SHRUNK: Final = 0.1
#: The rounds have converged once no parameter moves by more than this share of itself ...
_SETTLED: Final = 1e-6
#: ... or of its standard error, whichever is larger.
_SETTLED_SD: Final = 1e-3

#: Number of lines on each side over which a residual's power is assumed constant.
_BESIDE: Final = 25


@dataclass(frozen=True)
class Driver:
    """Source of the noise-free angle from which the instruments are made.

    `band`: with the perturbation in place of the torque; None: the measured torque is used.
    `values` (3,) or None: I, B, K of limb and device together, under the perturbation; None: those
    of the limb.
    `motion` tuple of (n,) complex, or None: part of each trial's angle that a command explains.
    `imposed`: True if the measured angle is imposed, and is its own instrument.
    `torque_floor`: variance of the torque sensor's noise.
    """

    band: Band | None = None
    values: FloatArray | None = None
    motion: tuple[Complex, ...] | None = None
    imposed: bool = False
    torque_floor: float = 0.0

    @property
    def simulates(self) -> bool:
        """True if the angle is simulated by a model under a torque."""
        return self.motion is None and not self.imposed

    def angle(self, row: int, bins: Bins, limb: FloatArray) -> Complex:
        """Noise-free angle of trial `row`, (n,); `limb` (3,): present I, B, K."""
        if self.motion is not None:
            return self.motion[row]
        if self.imposed:
            Z = bins.impedance(limb)
            return bins.angle + imposed_correction(bins, Z, bins.torque - Z * bins.angle)
        if self.band is None:
            Z = bins.impedance(limb)
            residual = bins.torque - Z * bins.angle
            return np.asarray((bins.torque + self.torque_correction(bins, Z, residual)) / Z)
        torque = self.band.trials[row].torque
        return np.asarray(torque / bins.impedance(limb if self.values is None else self.values))

    def torque_correction(self, bins: Bins, Z: Complex, residual: Complex) -> Complex:
        """Difference (n,) of the expected from the measured torque, if the torque is imposed.

        The residual ``e = Tau - Z Theta`` predicts the torque sensor's own noise: ``-s_tau^2 e /
        power``. With this correction the instrument is uncorrelated with the noise of the equation.

        `Z`, `residual` (n,).
        """
        return np.asarray(-self.torque_floor * residual / _seen_power(bins, Z, residual))


def imposed_correction(bins: Bins, Z: Complex, residual: Complex) -> Complex:
    """Difference (n,) of the expected from the measured angle, if the angle is imposed.

    The residual ``e = Tau - Z Theta`` of a limb of impedance Z predicts the angle's own noise:
    ``s_theta^2 conj(Z) e / (s_theta^2 |Z|^2 + s_tau^2)``. With this correction the instrument is
    uncorrelated with the noise of the equation, as in the likelihood of both channels. If the
    residual is larger than the band's weights predict, the rest is the subject's own torque.

    `Z`, `residual` (n,).
    """
    share = bins.angle_noise * np.conj(Z) / _seen_power(bins, Z, residual)
    return np.asarray(share * residual)


def _seen_power(bins: Bins, Z: Complex, residual: Complex) -> FloatArray:
    """Power of a residual (n,): that of the band's weights, or of neighbouring lines, if larger."""
    power = bins.noise_power(Z)
    level = _beside(np.abs(residual) ** 2) / _beside(power)
    return np.asarray(power * np.maximum(level, 1.0))


def _beside(power: FloatArray) -> FloatArray:
    """Mean over the lines near each line, without itself, (n,)."""
    kernel = np.ones(2 * _BESIDE + 1)
    kernel[_BESIDE] = 0
    count = np.convolve(np.ones(len(power)), kernel)[_BESIDE:-_BESIDE]
    return np.asarray(np.convolve(power, kernel)[_BESIDE:-_BESIDE] / count)


def driver_of(band: Band) -> Driver:
    """Return the driver for the band's source."""
    if band.source == "angle":
        return Driver(imposed=True)
    if band.source == "command":
        return _of_lines(band, [bins.command for bins in band.trials])
    under = band.under_perturbation if band.source == "perturbation" else None
    if under is None:
        return Driver(torque_floor=band.torque_noise)
    try:
        return Driver(under, fit_band(under))
    except EstimationError:
        # The device is not a joint of second order: use the local fit over neighbouring lines.
        return _of_lines(band, [bins.perturbation for bins in band.trials])


def _of_lines(band: Band, references: Sequence[Complex | None]) -> Driver:
    """Driver from the motion that a command or perturbation explains, for any device."""
    pairs = zip(band.trials, references, strict=True)
    return Driver(motion=tuple(explained_motion(b.angle, r) for b, r in pairs if r is not None))


def round_of(band: Band, driver: Driver, values: FloatArray) -> Solved:
    """One round: instruments and weights from I, B, K (3,), then the solution of the equations."""
    rows = []
    for row, bins in enumerate(band.trials):
        clean = driver.angle(row, bins, values)
        columns = np.column_stack(
            [bins.powers * bins.angle[:, None], bins.powers * clean[:, None], bins.torque]
        )
        series = in_time(bins.free(bins.weight(bins.impedance(values)), columns))
        rows.append(Rows(series[:, :3], series[:, 3:6], series[:, 6], bins.seconds))
    return solve_rows(rows, NAMES, UNITS)


def refined(solve_from: Callable[[FloatArray], Solved], start: FloatArray) -> Estimate:
    """Repeat rounds of instruments, each from the previous result, until they converge.

    Raises EstimationError: I, B or K is not positive at the end, or the rounds do not converge.
    """
    values = start
    for number in range(ROUNDS):
        solved = solve_from(values)
        new = solved.parameters.values
        if _settled(solved, values) or (number > _FREE_ROUNDS and (new <= 0).any()):
            return estimate_of(solved)
        new = positive(solved, values)
        # Half way, after the first rounds, in case they oscillate.
        values = np.sqrt(values * new) if number >= _FREE_ROUNDS else new
    raise EstimationError(
        f"the instruments do not settle within {ROUNDS} rounds: is the perturbation "
        "strong enough? try method output-error"
    )


def positive(solved: Solved, before: FloatArray) -> FloatArray:
    """I, B, K (3,) to start the next round; a share of the previous values is a lower bound."""
    return np.maximum(solved.parameters.values, _SHRUNK * before)


def _settled(solved: Solved, before: FloatArray) -> bool:
    """Return True if a round changed I, B, K by a negligible amount."""
    values, sd = solved.parameters.values, solved.parameters.sd
    allowed = np.maximum(_SETTLED * np.abs(values), _SETTLED_SD * sd)
    return bool((np.abs(values - before) <= allowed).all())
