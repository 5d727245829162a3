"""Likelihood of a record under three experiments: imposed torque, imposed angle, or neither.

Per line, ``s = i w``: limb ``v = Z Theta - Tau``, device ``u = Tau + Z_d Theta``, each of second
order; v is the subject's own torque, u the perturbation. Both are Gaussian and independent, their
spectra S_u, S_v piecewise linear in the logarithms (hats, see `weights`). With y = (u, v) = M x of
the measured x = (Tau, Theta), whose sensors' noise has N = diag(s_tau^2, s_theta^2):

    -l = sum ln det C + y^H C^-1 y - ln |det M|^2,   C = diag(S_u, S_v) + M N M^H.

An imposed torque, Z_d = 0, and an imposed angle, Z_d infinite and u the angle itself, are limits
of the same density, so the three likelihoods can be compared (P. Whittle, Ark. Mat. 2, 1953, for
the likelihood of periodograms). They are maximised by Fisher's scoring.

All three assume a limb of second order. If the true impedance departs from that (a reflex, soft
tissue), the experiment whose error has a similar shape fits best, right or wrong. `departure`
measures this misfit in nats; smaller differences between the experiments decide nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.stationary.band import Band, Bins, Complex, band_of, real_rows
from armimpedance.joint.elbow.stationary.estimate import without
from armimpedance.joint.elbow.stationary.instruments import explained_motion
from armimpedance.joint.elbow.stationary.preparation import PreparedSamples

Rig = Literal["torque", "angle", "both"]

_STEPS: Final = 60
_HALVINGS: Final = 12
_LONGEST: Final = 1.0
#: The search ends when a step gains less than this many nats.
_SETTLED: Final = 0.05
#: Factor on Fisher's covariance, which is too small because the spectra are estimated together with
#: I, B, K: of 120 records with five devices, 84 % lay within 2 of its standard deviations, and the
#: tails were longer than those of a normal distribution.
SLACK: Final = 2.5
#: Range of the powers of s in the leakage from the ends of u; the second is excluded.
_LEAKS: Final = (-4, 2)
#: Number of lowest knots of a spectrum whose power may be leakage from the ends.
_LOWEST: Final = 2
#: Least sensor noise, as a share of the channel's power: it keeps C regular.
_LEAST: Final = 1e-12


@dataclass(frozen=True, eq=False)
class RigFit:
    """Most likely parameters under one experiment.

    `nats`: ``-l``; a smaller value is more likely.
    `values` (3,): I, B, K of the limb.
    `covariance` (3, 3): inverse of Fisher's information, times `SLACK`.
    """

    nats: float
    values: FloatArray
    covariance: FloatArray


@dataclass(frozen=True, eq=False)
class _Lines:
    """Spectral lines of all trials, N in all.

    `x` (N, 2): torque and angle. `powers` (N, 3): s^2, s, 1. `hats` (N, k): shape functions of the
    spectra. `noise` (2,): power of the sensors' noise. `ends`: leakage terms of u and v, per trial.

    `base` (N,): an impedance whose real and imaginary part the hats modify, instead of I, B, K.
    """

    x: Complex
    powers: Complex
    hats: FloatArray
    noise: FloatArray
    ends: tuple[tuple[Complex, Complex], ...]
    rig: Rig
    base: Complex | None = None

    @property
    def impedances(self) -> int:
        """Number of parameters of limb and device; those of S_u and S_v follow them."""
        if self.base is not None:
            return 2 * self.hats.shape[1]
        return 6 if self.rig == "both" else 3

    def limb(self, eta: FloatArray) -> tuple[Complex, Complex]:
        """Impedance Z (N,) of the limb and its derivatives by the limb's parameters (N, q)."""
        if self.base is None:
            slope = self.powers * np.exp(eta[:3])
            return slope.sum(axis=1), slope
        slope = self.base[:, None] * np.concatenate([self.hats, 1j * self.hats], axis=1)
        return self.base + slope @ eta[: self.impedances], slope


def most_likely(floors: Band, rig: Rig, *starts: FloatArray) -> RigFit:
    """Fit one experiment to a band whose sensor noise is known.

    `rig`: what was imposed; "both": neither, the device's impedance is fitted as well.
    `starts`: one or several start values (3,): I, B, K of the limb; with "both" (6,): also those of
    the device.
    """
    lines = _lines(floors, rig)
    return min((_search(lines, np.log(start)) for start in starts), key=lambda fit: fit.nats)


def departure(floors: Band, fits: Mapping[Rig, RigFit]) -> float:
    """Nats, beyond chance, by which a free impedance is likelier than the best of the fits.

    The impedance of the likelier of the two limits is modified, in real and imaginary part, by
    as many hats as a spectrum has: 2 k parameters, which gain k nats by chance. With the torque or
    the angle imposed, such a limb describes any two channels.
    """
    rig: Rig = "torque" if fits["torque"].nats < fits["angle"].nats else "angle"
    lines = _lines(floors, rig)
    count = lines.hats.shape[1]
    bendable = replace(lines, base=lines.powers @ fits[rig].values)
    eta = np.concatenate([np.zeros(2 * count), _start_spectra(bendable, np.zeros(2 * count))])
    _, state = _climb(bendable, eta)
    best = min(fit.nats for fit in fits.values())
    return max(best - state.nats - count, 0.0)


def _lines(floors: Band, rig: Rig) -> _Lines:
    from armimpedance.joint.elbow.stationary.weights import hats, knots_of

    x = np.concatenate([np.stack([b.torque, b.angle], axis=1) for b in floors.trials])
    frequency = np.concatenate([b.frequency_hz for b in floors.trials])
    least = _LEAST * (np.abs(x) ** 2).mean(axis=0)
    return _Lines(
        x,
        np.concatenate([b.powers for b in floors.trials]),
        hats(np.log(frequency), np.log(knots_of(frequency))),
        np.maximum([floors.torque_noise, floors.angle_noise], least),
        tuple((_leakage(b), b.ends) for b in floors.trials),
        rig,
    )


def _leakage(bins: Bins) -> Complex:
    """Leakage (n, 6) of a signal whose ends differ: jumps of it and its derivatives, 1/s^j."""
    relative = bins.s / np.abs(bins.s[-1])
    return np.asarray(relative[:, None] ** np.arange(*_LEAKS), dtype=np.complex128)


@dataclass(frozen=True, eq=False)
class _State:
    """Likelihood at given parameters: M, C (N, 2, 2), y without the ends (N, 2), spectra (N, 2)."""

    M: Complex
    C: Complex
    y: Complex
    spectra: FloatArray
    nats: float


def _state(lines: _Lines, eta: FloatArray) -> _State:
    device = lines.impedances
    Z, _ = lines.limb(eta)
    M = np.zeros((len(Z), 2, 2), dtype=complex)
    M[:, 1, 0], M[:, 1, 1] = -1, Z
    M[:, 0, 0] = 0 if lines.rig == "angle" else 1
    M[:, 0, 1] = 1 if lines.rig == "angle" else 0
    if lines.rig == "both":
        M[:, 0, 1] = lines.powers @ np.exp(eta[3:device])
    logs = eta[device:].reshape(2, -1)
    spectra = np.exp(lines.hats @ logs.T)
    # C (N, 2, 2) = diag(S) + M N M^H
    C: Complex = np.asarray((M * lines.noise) @ np.conj(M).transpose(0, 2, 1), dtype=complex)
    C[:, [0, 1], [0, 1]] += spectra
    y = _without_ends(lines, (M @ lines.x[..., None])[..., 0], C)
    det_C = (C[:, 0, 0] * C[:, 1, 1]).real - np.abs(C[:, 0, 1]) ** 2
    det_M = M[:, 0, 0] * M[:, 1, 1] - M[:, 0, 1] * M[:, 1, 0]
    squares = (
        C[:, 1, 1].real * np.abs(y[:, 0]) ** 2
        + C[:, 0, 0].real * np.abs(y[:, 1]) ** 2
        - 2 * (np.conj(y[:, 0]) * C[:, 0, 1] * y[:, 1]).real
    ) / det_C
    nats = float((np.log(det_C) + squares - 2 * np.log(np.abs(det_M))).sum())
    return _State(M, C, y, spectra, nats)


def _without_ends(lines: _Lines, y: Complex, C: Complex) -> Complex:
    """Return y without the polynomial that each trial's ends leave in either row."""
    out, first = np.empty_like(y), 0
    for leakages in lines.ends:
        at = slice(first, first + len(leakages[0]))
        first = at.stop
        for row, ends in enumerate(leakages):
            weight = 1 / np.sqrt(C[at, row, row].real)
            columns = real_rows(ends * weight[:, None])
            residual = without(columns, real_rows(y[at, row] * weight))[0]
            out[at, row] = (residual[: len(ends)] + 1j * residual[len(ends) :]) / weight
    return out


def _search(lines: _Lines, start: FloatArray) -> RigFit:
    eta, state = _climb(lines, np.concatenate([start, _start_spectra(lines, start)]))
    return _fit_of(lines, eta, state)


def _climb(lines: _Lines, eta: FloatArray) -> tuple[FloatArray, _State]:
    """Return the most likely parameters near `eta`, and their likelihood."""
    state = _state(lines, eta)
    for _ in range(_STEPS):
        information, score = _normal(lines, eta, state)
        # information (p, p) step (p,) = score (p,)
        step = np.linalg.lstsq(information, score, rcond=1e-14)[0]
        step *= min(1.0, _LONGEST / max(float(np.abs(step).max()), 1e-300))
        for _ in range(_HALVINGS):
            better = _state(lines, eta + step)
            if better.nats < state.nats:
                break
            step = step / 2
        gain = state.nats - better.nats
        if gain > 0:
            eta, state = eta + step, better
        if gain < _SETTLED:
            break
    return eta, state


def _fit_of(lines: _Lines, eta: FloatArray, state: _State) -> RigFit:
    information, _ = _normal(lines, eta, state)
    values = np.exp(eta[:3])
    # d(I, B, K) = diag(I, B, K) d(logarithms)
    inverse = np.linalg.pinv(information, rcond=1e-12, hermitian=True)[:3, :3]
    return RigFit(state.nats, values, SLACK * inverse * np.outer(values, values))


def _start_spectra(lines: _Lines, start: FloatArray) -> FloatArray:
    """Logarithms (2 k,) of S_u, S_v at the start: the mean power about each knot.

    The lowest knots start no higher than the next one above: leakage from the ends is then removed
    first, and the search still finds a spectrum that does rise there.
    """
    count = lines.hats.shape[1]
    flat = _state(lines, np.concatenate([start, np.zeros(2 * count)]))
    weight = lines.hats / lines.hats.sum(axis=0)
    logs = np.log(weight.T @ np.abs(flat.y) ** 2)
    logs[:_LOWEST] = np.minimum(logs[:_LOWEST], logs[_LOWEST])
    return np.asarray(logs.T.ravel())


def _normal(lines: _Lines, eta: FloatArray, state: _State) -> tuple[FloatArray, FloatArray]:
    """Fisher's information (p, p) and the score (p,).

    A parameter a moves the covariance Sigma of x by dSigma_a, ``T_a = M dSigma_a M^H`` is
    ``diag(dS_a) - dM_a M^-1 diag(S) - (...)^H``, and ``L^-1 T_a L^-H`` with ``C = L L^H`` is W_a (4
    N,). The information is W^T W; a column of a spectrum, or of a modified impedance, is an
    (N, 4) array times a hat.
    """
    M, S, H = state.M, state.spectra, lines.hats
    inverse, G = _inverse_root(state.C), np.linalg.inv(M) * S[:, None, :]

    # dM has a single entry, a slope in column Theta: -slope a b^H + (...)^H, a and b (N, 2)
    b = (inverse @ np.conj(G[:, 1])[..., None])[..., 0]
    limb, device = (inverse[:, :, row, None] * np.conj(b)[:, None, :] for row in (1, 0))
    plain, bent = [], []
    if lines.base is None:
        plain = [_both(-slope, limb) for slope in lines.limb(eta)[1].T]
        if lines.rig == "both":
            plain += [_both(-slope, device) for slope in (lines.powers * np.exp(eta[3:6])).T]
    else:
        bent = [_both(-slope, limb) for slope in (lines.base, 1j * lines.base)]
    for row in range(2):
        a = inverse[:, :, row]
        bent.append(_both(S[:, row] / 2, a[:, :, None] * np.conj(a)[:, None, :]))
    z = (inverse @ state.y[..., None])[..., 0]
    R = _flat(z[:, :, None] * np.conj(z)[:, None, :] - np.eye(2))
    A = np.stack(plain).reshape(len(plain), -1) if plain else np.zeros((0, R.size))
    P = np.stack(bent)
    # (A P_b) H (m, k) for each b, H^T diag(P_a P_b) H (k, k) for each pair
    sides = [A.reshape(len(A), *R.shape) * part for part in P]
    across = np.concatenate([side.sum(axis=2) @ H for side in sides], axis=1)
    blocks = [[H.T @ ((left * right).sum(axis=1)[:, None] * H) for right in P] for left in P]
    information = np.block([[A @ A.T, across], [across.T, np.block(blocks)]])
    score = np.concatenate([A @ R.ravel(), *[(part * R).sum(axis=1) @ H for part in P]])
    return information, score


def _inverse_root(C: Complex) -> Complex:
    """Inverse of the lower triangular L of ``C = L L^H``, (N, 2, 2)."""
    first = np.sqrt(C[:, 0, 0].real)
    across = C[:, 1, 0] / first
    second = np.sqrt(C[:, 1, 1].real - np.abs(across) ** 2)
    inverse = np.zeros_like(C)
    inverse[:, 0, 0], inverse[:, 1, 1] = 1 / first, 1 / second
    inverse[:, 1, 0] = -across / (first * second)
    return inverse


def _both(factor: Complex | FloatArray, A: Complex) -> FloatArray:
    """``f A + (f A)^H`` in the coordinates of `_flat`; `factor` (N,), `A` (N, 2, 2)."""
    A = factor[:, None, None] * A
    off = np.sqrt(2) * (A[:, 0, 1] + np.conj(A[:, 1, 0]))
    return np.stack([2 * A[:, 0, 0].real, 2 * A[:, 1, 1].real, off.real, off.imag], axis=1)


def _flat(A: Complex) -> FloatArray:
    """Hermitian matrices (N, 2, 2) as vectors (N, 4); inner products equal the traces of
    products."""
    off = np.sqrt(2) * A[:, 0, 1]
    return np.stack([A[:, 0, 0].real, A[:, 1, 1].real, off.real, off.imag], axis=1)


# Does the joint follow the recorded command? If it does not, the command cannot be an instrument.

#: A command that explains a smaller share of the angle's power than this is not used.
LEAST: Final = 0.1


def with_usable_command(prepared: PreparedSamples) -> PreparedSamples:
    """Return the samples without a command that the joint does not follow; a note says so."""
    samples = prepared.source
    if samples.command is None:
        return prepared
    share = follows(band_of(prepared, "command"))
    if share >= LEAST:
        return prepared
    note = f"the commanded angle explains {100 * max(share, 0.0):.0f} % of the motion: not used"
    return replace(prepared, source=replace(samples, command=None, notes=(*samples.notes, note)))


def follows(band: Band) -> float:
    """Share of the angle's power in the band that the command explains."""
    unexplained = whole = 0.0
    for bins in band.trials:
        if bins.command is not None:
            error = bins.angle - explained_motion(bins.angle, bins.command)
            unexplained += float((np.abs(error) ** 2).sum())
            whole += float((np.abs(bins.angle) ** 2).sum())
    return 1 - unexplained / whole if whole else 0.0
