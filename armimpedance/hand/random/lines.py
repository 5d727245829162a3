"""Fourier lines of motion, force and command, tapered against leakage from the ends of a record.

The taper v is 1 except at its smooth ends. With the derivatives on the taper,

    sum v x' e = -sum (v e)' x,   sum v x'' e = sum (v e)'' x,   e = exp(-i w t),

the lines of velocity and acceleration hold for any motion, whatever it does at the ends. Lines are
divided by the root of the number of samples: pieces of any length have the same spectra.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.core.trials import trial_slices

Complex = NDArray[np.complex128]

#: The taper rises over this time (s), or over this share of a short piece.
EDGE_S: Final = 1.0
EDGE_PART: Final = 0.125
#: Pieces between two gaps that are shorter than this (s) are left out.
SHORTEST_S: Final = 4.0
#: A pause of the clock longer than so many samples is a gap.
GAP_SAMPLES: Final = 1.5
#: Lines of the default band have at least this share of the command's greatest power, and lie below
#: HIGHEST_HZ.
LEAST_POWER: Final = 1e-3
HIGHEST_HZ: Final = 25.0
#: Width (Hz) over which the power is averaged for the default band.
POWER_WIDTH_HZ: Final = 0.5

_STEP: Final = Polynomial([0, 0, 0, 0, 35, -84, 70, -20])


@dataclass(frozen=True, eq=False)
class Lines(FrozenRecord):
    """L lines of all pieces of a group of trials, in the order of their frequency; d axes.

    `frequency_hz` (L,).
    `trial` (L,) int: number of each line's trial.
    `motion` (3, L, d) complex: displacement, velocity, acceleration.
    `force` (L, d) complex: by the limb on the device.
    `command` (L, c) complex: the instruments, usually the robot's commands.
    `per_hz`: lines in one Hz: the length of all pieces, s.
    `widening`: ratio of an estimate's variance to that from independent lines: the cost of the
    taper.
    """

    frequency_hz: Annotated[FloatArray, "L"]
    trial: Annotated[IntArray, "L"]
    motion: Complex
    force: Complex
    command: Complex
    per_hz: float
    widening: float

    @property
    def axes(self) -> int:
        """Number d of axes."""
        return int(self.force.shape[1])

    @property
    def s(self) -> Complex:
        """``i w`` of each line, (L, 1)."""
        return np.asarray(2j * np.pi * self.frequency_hz[:, None])

    def within(self, band_hz: tuple[float, float]) -> Lines:
        """Select the lines inside a band.

        Raises InputError: the band is empty or holds too few lines.
        """
        low, high = band_hz
        if not 0 < low < high:
            raise InputError(f"band {low:g} to {high:g} Hz", expected="0 < low < high")
        inside = (self.frequency_hz >= low) & (self.frequency_hz <= high)
        needed = 16 * self.axes**2
        if inside.sum() < needed:
            raise InputError(
                f"{int(inside.sum())} lines between {low:.3g} and {high:.3g} Hz",
                expected=f"{needed} or more: a longer record or a wider band",
            )
        picked: dict[str, Any] = {
            name: getattr(self, name)[inside]
            for name in ("frequency_hz", "trial", "force", "command")
        }
        return replace(self, motion=self.motion[:, inside], **picked)

    def excited_band(self) -> tuple[float, float]:
        """Band in which the command has power, Hz."""
        power = (np.abs(self.command) ** 2).sum(axis=1)
        cell = np.floor(self.frequency_hz / POWER_WIDTH_HZ).astype(np.int64)
        mean = np.bincount(cell, power) / np.maximum(np.bincount(cell), 1)
        seen = np.flatnonzero(mean > LEAST_POWER * mean.max())
        low, high = seen[0] * POWER_WIDTH_HZ, (seen[-1] + 1) * POWER_WIDTH_HZ
        return max(float(low), POWER_WIDTH_HZ), min(float(high), HIGHEST_HZ)


def lines_of(recording: Recording, rows: IntArray, command: FloatArray) -> Lines:
    """Compute the lines of a group of trials.

    Parameters
    ----------
    recording : Recording
    rows : (T,) int
        Trials of the group.
    command : (N, c)
        Commands at all samples of the recording.

    Returns
    -------
    Lines

    Raises
    ------
    InputError
        No trial holds a piece of 4 s without a gap.
    """
    slices, numbers = trial_slices(recording.offsets), recording.trials["trial"]
    return lines_in(recording, [(int(numbers.iloc[row]), slices[row]) for row in rows], command)


def lines_in(
    recording: Recording, stretches: Sequence[tuple[int, slice]], command: FloatArray
) -> Lines:
    """Compute the lines of stretches of samples, each with a number for `trial`.

    Raises InputError: none holds a piece of 4 s without a gap.
    """
    rate = recording.sample_rate_hz
    parts, total, squares, fourths = [], 0, 0.0, 0.0
    for number, stretch in stretches:
        for piece in _pieces(recording.time_s, stretch, rate):
            taper = _taper(piece.stop - piece.start, rate)
            channels = recording.position[piece], recording.force[piece], command[piece]
            parts.append((number, *_transformed(taper, channels, rate)))
            total += piece.stop - piece.start
            squares += float((taper[0] ** 2).sum())
            fourths += float((taper[0] ** 4).sum())
    if not parts:
        raise InputError(
            f"no trial lasts {SHORTEST_S:g} s without a gap", expected="one long trial or several"
        )
    frequency = np.concatenate([part[1] for part in parts])
    order = np.argsort(frequency, kind="stable")
    trial = np.concatenate([np.full(len(part[1]), part[0]) for part in parts])
    motion = np.concatenate([part[2] for part in parts], axis=1)[:, order]
    force, commands = (np.concatenate([part[i] for part in parts])[order] for i in (3, 4))
    widening = total * fourths / squares**2
    return Lines(frequency[order], trial[order], motion, force, commands, total / rate, widening)


def _pieces(time_s: FloatArray, trial: slice, rate: float) -> Iterator[slice]:
    """Yield the pieces between the gaps of a trial's clock that are long enough."""
    pause = np.diff(time_s[trial]) * rate
    cuts = np.flatnonzero((pause > GAP_SAMPLES) | (pause < 0.5)) + 1 + trial.start
    for first, last in zip([trial.start, *cuts], [*cuts, trial.stop], strict=True):
        if last - first >= SHORTEST_S * rate:
            yield slice(int(first), int(last))


def _taper(samples: int, rate: float) -> FloatArray:
    """The taper and its first two derivatives, (3, S)."""
    t = np.arange(samples) / rate
    edge = min(EDGE_S, EDGE_PART * t[-1])
    parts = np.zeros((3, samples))
    up, down = np.clip(t / edge, 0, 1), np.clip((t[-1] - t) / edge, 0, 1)
    for n in range(3):
        step = _STEP.deriv(n) if n else _STEP
        sign = (-1) ** n
        parts[n] = (step(up) + sign * step(down)) / edge**n
    parts[0] -= 1.0
    return parts


def _transformed(
    taper: FloatArray, channels: tuple[FloatArray, ...], rate: float
) -> tuple[FloatArray, Complex, Complex, Complex]:
    """Frequencies, motion (3, L, d), force and command of one piece."""
    motion, force, command = (_without_line(channel) for channel in channels)
    count = len(motion)
    frequency: FloatArray = np.fft.rfftfreq(count, 1 / rate)[:, None].astype(float)
    v, dv, ddv = (part[:, None] for part in taper)

    def lines(values: FloatArray) -> Complex:
        return np.asarray(np.fft.rfft(values, axis=0) / np.sqrt(count))

    s = 2j * np.pi * frequency
    X = lines(v * motion)
    X1 = lines(dv * motion)
    # (v e)' = (v' - s v) e,  (v e)'' = (v'' - 2 s v' + s^2 v) e
    velocity = s * X - X1
    acceleration = lines(ddv * motion) - 2 * s * X1 + s**2 * X
    positive = slice(1, None)
    moved = np.stack([X, velocity, acceleration])[:, positive]
    return (
        np.asarray(frequency[positive, 0]),
        moved,
        lines(v * force)[positive],
        lines(v * command)[positive],
    )


def _without_line(values: FloatArray) -> FloatArray:
    """Samples (S, d) minus the straight line through them."""
    t = np.linspace(-1, 1, len(values))[:, None]
    slope = (t * values).sum(axis=0) / (t**2).sum()
    return np.asarray(values - values.mean(axis=0) - slope * t)


# Parts of motion and force explained by the commands, smooth in frequency, each line from others.
# The response to the commands is a cubic spline of the frequency, for any robot between command and
# hand. The noise of a line (of sensors and person) does not affect its explained part, so that the
# explained motion is a valid instrument in a closed loop.

#: Distance of the knots (Hz), or number of lines for each coefficient.
KNOTS_HZ: Final = 0.75
LINES_EACH: Final = 8.0
#: Combinations of commands whose squared size is below this share of the largest are left out.
ALIKE: Final = 1e-10
#: Largest leverage of a line that is used in leaving it out.
HIGHEST_LEVERAGE: Final = 0.9


@dataclass(frozen=True, eq=False)
class Explained:
    """Part of each line that the commands explain.

    `motion`, `force` (L, d) complex: each line from the others.
    `coefficients`: number for each command's response.
    """

    motion: Complex
    force: Complex
    coefficients: int


def explained_by(lines: Lines) -> Explained:
    """Regress motion and force on the commands, leaving out one line at a time.

    `lines`: of the band.
    """
    basis = _basis(lines)
    c, L = lines.command.shape[1], len(basis)
    Phi = (basis[:, :, None] * lines.command[:, None]).reshape(L, -1)
    size = np.linalg.norm(Phi, axis=0)
    Phi = Phi / np.where(size > 0, size, 1.0)
    # orthogonal columns, without those of commands that are collinear or zero
    values, V = np.linalg.eigh(Phi.conj().T @ Phi)
    seen = values > ALIKE * values[-1]
    U = Phi @ (V[:, seen] / np.sqrt(values[seen]))
    leverage = np.minimum((np.abs(U) ** 2).sum(axis=1), HIGHEST_LEVERAGE)[:, None]
    y = np.hstack([lines.motion[0], lines.force])
    # y_i without line i: y_i - (y_i - yhat_i) / (1 - h_i)
    left_out = y - (y - U @ (U.conj().T @ y)) / (1 - leverage)
    d = lines.axes
    return Explained(left_out[:, :d], left_out[:, d:], U.shape[1] // c)


def itself(lines: Lines) -> Explained:
    """Explained part without commands: all motion is caused by the robot."""
    return Explained(lines.motion[0], lines.force, 1)


def _basis(lines: Lines) -> FloatArray:
    """Cubic B-splines of the frequency at every line, (L, k)."""
    f = lines.frequency_hz
    apart = max(KNOTS_HZ, LINES_EACH * lines.command.shape[1] / lines.per_hz)
    inner = np.linspace(f[0], f[-1], max(2, 1 + int((f[-1] - f[0]) / apart)))
    knots = np.concatenate([[inner[0]] * 3, inner, [inner[-1]] * 3])
    return np.asarray(BSpline.design_matrix(f, knots, 3).toarray())


def share_explained(measured: Complex, explained: Complex) -> FloatArray:
    """Explained share of the power of each axis (d,); below 0 if nothing is explained."""
    residual = (np.abs(measured - explained) ** 2).sum(axis=0)
    return np.asarray(1 - residual / np.maximum((np.abs(measured) ** 2).sum(axis=0), 1e-300))
