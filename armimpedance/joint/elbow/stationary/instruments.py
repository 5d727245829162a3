"""Instruments: columns that follow the motion but none of its noise.

``sum Z^H W (Tau - X p) = 0`` over the coefficients of the band, ``X = [s^2 s 1] Theta``: the
equation of motion in continuous time (see `band`), without hold or bilinear warping, at whatever
rate the samples come. Where the recording holds the device's perturbation, Z is made of the angle
that a joint of second order, limb and device together, makes of it: neither the sensors' noise
nor the subject's own torque, to which the measured one reacts, is in it. Else it is made of the
measured torque, whose noise inside the band remains. Model, instruments and weights are refined
in turn (P. C. Young, Recursive Estimation and Time-Series Analysis, 2nd ed. 2011, chapters 7, 8;
with a reference signal in the frequency domain: R. Pintelon, J. Schoukens, System Identification,
2nd ed. 2012, chapter 9).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError
from armimpedance.joint.elbow.experiment.local_fit import explained_motion
from armimpedance.joint.elbow.result import NAMES, UNITS
from armimpedance.joint.elbow.stationary.band import Band, Bins, Complex, in_time
from armimpedance.joint.elbow.stationary.estimate import Estimate, estimate_of
from armimpedance.joint.elbow.stationary.joint_fit import fit_band
from armimpedance.joint.elbow.stationary.rows import Rows, Solved, solve_rows

ROUNDS: Final = 60
#: Rounds that start from what the one before gave; later ones start half way.
_FREE_ROUNDS: Final = 4
#: A parameter that a round finds at or below zero starts the next at this part of what it was.
_SHRUNK: Final = 0.1
#: Rounds settle once no parameter moves by more than this part of itself ...
_SETTLED: Final = 1e-6
#: ... or of its standard error, whichever is larger.
_SETTLED_SD: Final = 1e-3

#: Lines on each side over which a residual's power is taken for constant.
_BESIDE: Final = 25


@dataclass(frozen=True)
class Driver:
    """What the angle of the instruments is made from, and by what.

    Attributes
    ----------
    band : Band or None
        With the perturbation for the torque; None = the measured torque.
    values : (3,) or None
        I, B, K of limb and device together, under the perturbation; None = the limb's own.
    motion : tuple of (n,) complex, or None
        What a command explains of each trial's angle.
    imposed : bool
        The measured angle is imposed, and serves itself.
    """

    band: Band | None = None
    values: FloatArray | None = None
    motion: tuple[Complex, ...] | None = None
    imposed: bool = False

    @property
    def simulates(self) -> bool:
        """Whether the angle is that of a model under a torque."""
        return self.motion is None and not self.imposed

    def angle(self, row: int, bins: Bins, limb: FloatArray) -> Complex:
        """The angle without noise of trial `row`, (n,); `limb` is I, B, K (3,) so far."""
        if self.motion is not None:
            return self.motion[row]
        if self.imposed:
            Z = bins.impedance(limb)
            return bins.angle + imposed_correction(bins, Z, bins.torque - Z * bins.angle)
        torque = bins.torque if self.band is None else self.band.trials[row].torque
        return np.asarray(torque / bins.impedance(limb if self.values is None else self.values))


def imposed_correction(bins: Bins, Z: Complex, residual: Complex) -> Complex:
    """By how much the expected angle differs from the measured one where it is imposed, (n,).

    The residual ``e = Tau - Z Theta`` of a limb of impedance Z tells of the angle's own noise:
    ``s_theta^2 conj(Z) e / (s_theta^2 |Z|^2 + s_tau^2)``. With it the instrument is uncorrelated
    with the noise of the equation, as the likelihood of both channels has it. Where the residual is
    larger than the band's weights say, the rest is the subject's own torque, which tells nothing.

    Parameters
    ----------
    bins : Bins
    Z, residual : (n,)
    """
    power = bins.noise_power(Z)
    level = _beside(np.abs(residual) ** 2) / _beside(power)
    share = bins.angle_noise * np.conj(Z) / (power * np.maximum(level, 1.0))
    return np.asarray(share * residual)


def _beside(power: FloatArray) -> FloatArray:
    """Mean over the lines beside each, itself left out, (n,)."""
    kernel = np.ones(2 * _BESIDE + 1)
    kernel[_BESIDE] = 0
    count = np.convolve(np.ones(len(power)), kernel)[_BESIDE:-_BESIDE]
    return np.asarray(np.convolve(power, kernel)[_BESIDE:-_BESIDE] / count)


def driver_of(band: Band) -> Driver:
    """What the band's source moves."""
    if band.source == "angle":
        return Driver(imposed=True)
    if band.source == "command":
        return _of_lines(band, [bins.command for bins in band.trials])
    under = band.under_perturbation if band.source == "perturbation" else None
    if under is None:
        return Driver()
    try:
        return Driver(under, fit_band(under))
    except EstimationError:
        # A device that is no joint of second order: what each line's neighbours tell.
        return _of_lines(band, [bins.perturbation for bins in band.trials])


def _of_lines(band: Band, told: Sequence[Complex | None]) -> Driver:
    """The motion that a command or perturbation explains, whatever the device."""
    pairs = zip(band.trials, told, strict=True)
    return Driver(motion=tuple(explained_motion(b.angle, r) for b, r in pairs if r is not None))


def round_of(band: Band, driver: Driver, values: FloatArray) -> Solved:
    """One round: instruments and weights of I, B, K (3,), then the equations' solution."""
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
    """Rounds of instruments, each from what the one before gave, until they settle.

    Raises
    ------
    EstimationError
        I, B or K is not positive at the end, or the rounds do not settle.
    """
    values = start
    for number in range(ROUNDS):
        solved = solve_from(values)
        new = solved.parameters.values
        if _settled(solved, values) or (number > _FREE_ROUNDS and (new <= 0).any()):
            return estimate_of(solved)
        new = positive(solved, values)
        # Half way, after the first rounds, should they swing.
        values = np.sqrt(values * new) if number >= _FREE_ROUNDS else new
    raise EstimationError(
        f"the instruments do not settle within {ROUNDS} rounds: is the perturbation "
        "strong enough? try method output-error"
    )


def positive(solved: Solved, before: FloatArray) -> FloatArray:
    """I, B, K (3,) to start the next round from; those before it bound them from below."""
    return np.maximum(solved.parameters.values, _SHRUNK * before)


def _settled(solved: Solved, before: FloatArray) -> bool:
    """Whether a round moved I, B, K by less than matters."""
    values, sd = solved.parameters.values, solved.parameters.sd
    allowed = np.maximum(_SETTLED * np.abs(values), _SETTLED_SD * sd)
    return bool((np.abs(values - before) <= allowed).all())
