"""Output error of a hinge: the swing that the parameters would make, fitted to the measured one.

The hinge is simulated forward from free initial conditions with the other coordinates as measured
and compared with the measured angle, unfiltered: no derivative of a noisy signal enters, and no
sign. Long trials are cut into pieces with a start of their own: noise of the other coordinates
drives the simulation away from the measured swing, but not for longer than a piece. Gauss-Newton
from the `parallel` estimate.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.errors import EstimationError, InputError
from armimpedance.passive.equations import Equations, parallel_equations
from armimpedance.passive.hinge import HingeDynamics
from armimpedance.passive.linear import TwoFits, solve_linear
from armimpedance.passive.samples import PassiveSamples
from armimpedance.passive.swing import simulate_swings
from armimpedance.passive.terms import Terms
from armimpedance.regression import Fit

_MOST_STEPS: Final = 30
_MOST_HALVINGS: Final = 8

#: Differences for sensitivities: of parameters in standard errors, of the start in rad and rad/s.
_DIFFERENCE: Final = 1.0
_START_DIFFERENCES: Final = (1e-4, 1e-3)

#: Done when the step, in standard errors along its own direction, is shorter than this, or than
#: a billionth of the parameters.
_STILL: Final = 0.02
_STILL_EXACT: Final = 1e-9

#: A step that does not lower the residual, as a reversal that just happens or just does not may
#: bring about, ends the search if it promised less than one observation's share of the residual,
#: or is no longer than this part of the robust standard errors.
_STILL_ENOUGH: Final = 1.0
_STILL_ROBUST: Final = 0.25

#: Longest piece with a start of its own, s. An elbow forgets its start in some 4 s.
LONGEST_PIECE_S: Final = 3.0


@dataclass(frozen=True)
class Swings:
    """What a simulation of all pieces of one hinge's trials needs; T pieces.

    Attributes
    ----------
    coefficients : (points, 7, T)
        Shorter pieces hold their last row.
    measured : tuple of T arrays (S_t,)
    terms : Terms
    sample_rate_hz : float
    """

    coefficients: FloatArray
    measured: tuple[FloatArray, ...]
    terms: Terms
    sample_rate_hz: float

    def simulate(self, parameters: FloatArray, start: FloatArray) -> FloatArray:
        """Angles (S, V, T) of V variants: parameters (p, V), start (2, V, T)."""
        V, T = parameters.shape[1], len(self.measured)
        angles = simulate_swings(
            np.tile(self.coefficients, (1, 1, V)),
            np.repeat(parameters, T, axis=1),
            start.reshape(2, V * T),
            self.terms,
            self.sample_rate_hz,
        )
        return angles.reshape(-1, V, T)

    def residual(self, angles: FloatArray) -> list[FloatArray]:
        """Measured less simulated (S, T), per trial (S_t,)."""
        return [m - angles[: len(m), t] for t, m in enumerate(self.measured)]


def solve_swing(samples: PassiveSamples, terms: Terms) -> TwoFits:
    """Fit the swing of a single joint whose hinge dynamics are known.

    Raises
    ------
    EstimationError
        The simulated swing does not settle on the measured one.
    NotIdentifiableError, InputError
        The same cases as in `solve_linear`, which finds the `parallel` start.
    """
    first = solve_linear(parallel_equations(samples, terms), samples.sample_rate_hz).classical
    seconds = int(samples.offsets[-1]) / samples.sample_rate_hz
    samples = in_pieces(samples, LONGEST_PIECE_S)
    if samples.n_trials < 2:
        raise InputError(
            f"{samples.joints[0]}: one swing of {seconds:.1f} s has no spread to see",
            expected=f"more than {LONGEST_PIECE_S:g} s, or several trials, for output-error",
        )
    swings = _swings(samples, terms)
    x = first.parameters.copy()
    start = np.array([[samples.q[s.start, 0], samples.qd[s.start, 0]] for s in samples.slices()]).T
    sd = first.sd
    for _ in range(_MOST_STEPS):
        steps = np.maximum(np.concatenate([_DIFFERENCE * sd, _START_DIFFERENCES]), 1e-7)
        angles, W_x, W_start = _sensitivities(swings, x, start, steps)
        E = swings.residual(angles)
        fits, moves = _linearised(swings, x, E, W_x, W_start)
        change = fits.classical.parameters - x
        length = _length(change, fits.classical)
        if length <= _STILL or (np.abs(change) <= _STILL_EXACT * np.abs(x)).all():
            return fits
        lower = _descend(swings, x, start, change, moves, _squares(E))
        if lower is None and (
            length <= _STILL_ENOUGH or (np.abs(change) <= _STILL_ROBUST * fits.robust.sd).all()
        ):
            return fits
        if lower is None:
            raise EstimationError(
                f"{samples.joints[0]}: no step brings the simulated swing nearer to the measured"
            )
        (x, start), sd = lower, fits.classical.sd
    raise EstimationError(
        f"{samples.joints[0]}: the simulated swing did not settle in {_MOST_STEPS} steps"
    )


def in_pieces(samples: PassiveSamples, longest_s: float) -> PassiveSamples:
    """The same samples, every trial cut into equal pieces no longer than this."""
    hinges: list[list[FloatArray]] = [[] for _ in samples.hinges or ()]
    ends = [0]
    for t, part in enumerate(samples.slices()):
        count = part.stop - part.start
        pieces = int(np.ceil(count / max(longest_s * samples.sample_rate_hz, 2)))
        edges = np.linspace(0, count, pieces + 1).astype(int).tolist()
        ends += [part.start + e for e in edges[1:]]
        for pieces_so_far, hinge in zip(hinges, samples.hinges or (), strict=True):
            pieces_so_far += hinge.select([t]).cut(edges).coefficients
    return replace(
        samples,
        offsets=np.array(ends),
        hinges=tuple(HingeDynamics(tuple(own)) for own in hinges) or None,
        trials=(),
    )


def _swings(samples: PassiveSamples, terms: Terms) -> Swings:
    if samples.hinges is None:
        raise InputError("no skeleton to simulate", expected="samples from a motion recording")
    parts = samples.hinges[0].coefficients
    longest = max(len(c) for c in parts)
    padded = [np.pad(c, ((0, longest - len(c)), (0, 0)), mode="edge") for c in parts]
    measured = tuple(samples.measured_q[s, 0] for s in samples.slices())
    return Swings(np.stack(padded, axis=2), measured, terms, samples.sample_rate_hz)


def _sensitivities(
    swings: Swings, x: FloatArray, start: FloatArray, steps: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Angles (S, T), and their derivatives by parameters (S, p, T) and start (S, 2, T)."""
    p = len(x)
    X = np.repeat(x[:, None], 1 + p + 2, axis=1)
    begin = np.repeat(start[:, None, :], 1 + p + 2, axis=1)
    for j in range(p):
        X[j, 1 + j] += steps[j]
    for j in range(2):
        begin[j, 1 + p + j] += steps[p + j]
    angles = swings.simulate(X, begin)
    slopes = (angles[:, 1:] - angles[:, :1]) / steps[:, None]
    if not np.isfinite(slopes).all():
        raise EstimationError("the simulated swing runs away")
    return angles[:, 0], slopes[:, :p], slopes[:, p:]


def _linearised(
    swings: Swings,
    x: FloatArray,
    E: list[FloatArray],
    W_x: FloatArray,
    W_start: FloatArray,
) -> tuple[TwoFits, list[tuple[FloatArray, FloatArray]]]:
    """The Gauss-Newton step as a regression, and per trial what moves the start with it."""
    W, Y, moves = [], [], []
    for t, e in enumerate(E):
        # e (S,) = W_x (S, p) dx + W_start (S, 2) ds: the start is projected out of each trial
        w_x, w_start = W_x[: len(e), :, t], W_start[: len(e), :, t]
        Q, R = np.linalg.qr(w_start)
        moves.append((np.linalg.solve(R, Q.T @ e), np.linalg.solve(R, Q.T @ w_x)))
        W.append(w_x - Q @ (Q.T @ w_x))
        Y.append((e - Q @ (Q.T @ e) + W[-1] @ x)[:, None])
    equations = Equations(swings.terms.columns, swings.terms.column_units, tuple(W), tuple(Y))
    return _both(equations), moves


def _both(equations: Equations) -> TwoFits:
    """Both covariances of the linearised fit; the robust one takes a piece as one observation.

    The other coordinates' noise drives the joint at its own resonance, so that a residual
    remembers as long as the swing does; a piece with its own start forgets what was before.
    """
    return TwoFits(equations.fit("classical", 2), equations.fit("cr3", 2))


def _descend(
    swings: Swings,
    x: FloatArray,
    start: FloatArray,
    change: FloatArray,
    moves: list[tuple[FloatArray, FloatArray]],
    squares: float,
) -> tuple[FloatArray, FloatArray] | None:
    """The step, halved until the residual falls; None if it never does."""
    begin = np.stack([alone - along @ change for alone, along in moves], axis=1)
    parts = 0.5 ** np.arange(_MOST_HALVINGS)
    for part in parts:
        x1, start1 = x + part * change, start + part * begin
        angles = swings.simulate(x1[:, None], start1[:, None, :])[:, 0]
        if np.isfinite(angles).all() and _squares(swings.residual(angles)) < squares:
            return x1, start1
    return None


def _length(change: FloatArray, fit: Fit) -> float:
    """``sqrt(dx^T C^-1 dx)`` of a step (p,): standard errors along its own direction."""
    # C^-1 (p, p) = R^T R / sigma^2
    sigma = max(fit.residual_sd, np.finfo(np.float64).tiny)
    return float(np.linalg.norm(fit.triangle @ change) / sigma)


def _squares(E: list[FloatArray]) -> float:
    return float(sum(e @ e for e in E))
