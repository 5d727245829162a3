"""Is the limb the one that the model says? Late force, reflex, amplitude, what repeats unexplained.

Each departure from ``M x'' + B x' + K x = y``, y = -f, is one more column z with one number k:

- delay: a force that comes late by k seconds, ``z = -y'``;
- reflex: an answer to the displacement of d seconds before, ``z = K x(t - d)``;
- amplitude: a stiffness that changes with the deflection, ``z = K x |x|^2 / A^2``.

y and K are those that the plain fit finds; the rows are weighted by its noise, and k has a standard
error clustered by trial. Departures resemble each other, so the one that explains most is named,
and another one beside it only where it is needed too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.special import fdtrc, stdtrit

from armimpedance.arrays import FloatArray
from armimpedance.conventions import Kind
from armimpedance.errors import ArmImpedanceError
from armimpedance.findings import Finding
from armimpedance.impedance.estimation import DEFAULT_BY, groups_of
from armimpedance.impedance.weighing.expected_motion import expected_motion
from armimpedance.impedance.weighing.modal import ModalEquation, weighted_equations
from armimpedance.impedance.weighing.weighted_fit import compensated_equations, weighted_fit
from armimpedance.records import Recording, Window
from armimpedance.regression import TrialEquations, solve_equations
from armimpedance.signals import cut_windows, delayed, disturbance_times

#: Delays of a reflex that are tried (s).
REFLEX_S: Final = (0.035, 0.045, 0.055, 0.065, 0.080, 0.100)
#: The delay for which the smallest visible reflex is said (s).
USUAL_S: Final = 0.055
#: What to do about a departure.
ADVICE: Final = {
    "delay": "a millisecond makes B wrong by percents: put the sensors in step, and take dry "
    "friction out of handle and seat, which looks like an early force",
    "reflex": "`reflex` says more; disturb for a shorter time",
    "amplitude": "K of small deflections asks for smaller disturbances",
}
#: A departure is told where chance alone does as much less often than this.
LEVEL: Final = 0.01
#: Of the best of several delays chance makes more.
LEVEL_OF_REFLEX: Final = 0.006
#: Lack of fit has no size to weigh, and one recording has few: chance must do much less.
LEVEL_OF_REPEATS: Final = 0.003
#: A second cause is told if it explains this part of the first one's standard errors beside it.
BESIDE: Final = 1 / 3
#: Smaller changes of K (parts of K) and smaller delays (s) matter to nobody.
LEAST_SHARE: Final = 0.01
LEAST_DELAY_S: Final = 5e-5
#: What repeats unexplained is told from this part of the response on.
LEAST_REPEATED: Final = 0.03
#: With fewer trials nothing can be told; of more conditions than this the longest are judged.
FEWEST_TRIALS: Final = 8
MOST_CONDITIONS: Final = 4


@dataclass(frozen=True)
class Departure:
    """The number of one departure.

    Attributes
    ----------
    size, error : float
        k and its standard error.
    share : float
        By how much of K (of B, for a delay) the plain fit is wrong for each unit of k.
    known : float
        Standard error of that matrix along itself, as a part of it: what is less does not matter.
    dof : float
    level : float
        How often chance alone may reach `limit`.
    """

    size: float
    error: float
    share: float
    known: float
    dof: float
    level: float = LEVEL

    @property
    def t(self) -> float:
        """Size in standard errors; those of a normal distribution, whatever the dof."""
        return self.size / self.error

    @property
    def limit(self) -> float:
        """What chance alone does not reach, of size."""
        return float(stdtrit(self.dof, 1 - self.level / 2)) * self.error


def check_departures(recording: Recording) -> tuple[Finding, ...]:
    """Delay between force and motion, reflex, amplitude, lack of fit; over all conditions together.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    tuple of Finding
        "delay", "reflex", "amplitude" and "lack of fit", each with the smallest violation that it
        would have seen; empty where the perturbation is stochastic.
    """
    if recording.perturbation != "returning":
        return ()
    models = _models(recording)
    if not models:
        text = f"no condition of {FEWEST_TRIALS} trials to judge by"
        return tuple(Finding(name, "ok", text) for name in ("delay", "reflex", "amplitude"))
    late = max(REFLEX_S, key=lambda d: _pooled(models, _reflex(d)).t)
    names = {"delay": "delay", "reflex": _reflex(late), "amplitude": "amplitude"}
    single = {name: _pooled(models, column) for name, column in names.items()}
    told = _told(models, names, single)
    if "reflex" not in told:
        late = USUAL_S
        single["reflex"] = _pooled(models, _reflex(late))
    way = float(np.median([model.way for model in models]))
    size = f"{1e3 * way:.1f} {'mm' if recording.kind == 'hand' else 'mrad'}"
    sentences = {
        "delay": _delay_text(single["delay"]),
        "reflex": _share_text(f"an answer some {1e3 * late:.0f} ms late", single["reflex"]),
        "amplitude": _share_text(f"a law that is not linear over {size}", single["amplitude"]),
    }
    found = [
        Finding(name, "warning", f"{text}; {ADVICE[name]}", smallest)
        if name in told
        else Finding(name, "ok", text, smallest)
        for name, (text, smallest) in sentences.items()
    ]
    return (*found, *_lack_of_fit(models, explained=bool(told)))


def _reflex(delay_s: float) -> str:
    """Name of the column of a reflex."""
    return f"reflex {delay_s}"


def _told(
    models: Sequence[_Model], names: dict[str, str], single: dict[str, Departure]
) -> tuple[str, ...]:
    """The departure that explains most, and those that are needed beside it."""
    seen = {name: one for name, one in single.items() if _matters(name, one)}
    if not seen:
        return ()
    first = max(seen, key=lambda name: abs(seen[name].t))
    told = [first]
    for name in seen:
        if name == first:
            continue
        beside = _pooled(models, names[name], names[first])
        needed = BESIDE * abs(seen[first].t)
        if _matters(name, beside) and abs(beside.t) > needed:
            told.append(name)
    return tuple(told)


def _matters(name: str, one: Departure) -> bool:
    """Whether this is no chance, and more than a standard error of what it makes wrong."""
    if name == "reflex" and one.size < 0:
        return False
    if abs(one.share * one.size) < one.known:
        return False
    least = LEAST_DELAY_S if name == "delay" else LEAST_SHARE / max(abs(one.share), 1e-9)
    return abs(one.size) > max(one.limit, least)


def _delay_text(one: Departure) -> tuple[str, str]:
    """What was found, and the smallest delay that would have been seen."""
    which = "late" if one.size >= 0 else "early"
    text = f"force {1e3 * abs(one.size):.2f} ms (sd {1e3 * one.error:.2f}) {which} on the motion"
    return text, f"{1e3 * max(one.limit, LEAST_DELAY_S):.2f} ms"


def _share_text(what: str, one: Departure) -> tuple[str, str]:
    """What was found in parts of K, and the smallest part that would have been seen."""
    percent = 100 * one.share
    text = f"{what} makes K {percent * one.size:+.1f} % (sd {abs(percent) * one.error:.1f}) wrong"
    return text, f"{max(abs(percent) * one.limit, 100 * LEAST_SHARE):.2g} % of K"


def _models(recording: Recording) -> list[_Model]:
    """The conditions with most trials, each fitted; all trials together where none can be."""
    timing = disturbance_times(recording)
    for by in (DEFAULT_BY, ()):
        found = []
        groups = sorted(groups_of(recording, by), key=lambda group: -len(group[1]))
        for _, rows in groups[:MOST_CONDITIONS]:
            try:
                window = cut_windows(recording, rows, timing)
                if window.usable.sum() >= FEWEST_TRIALS:
                    found.append(_Model.of(window, recording.kind))
            except ArmImpedanceError:
                continue
        if found:
            return found
    return []


def _pooled(models: Sequence[_Model], column: str, beside: str | None = None) -> Departure:
    """One departure over all conditions, weighted by what each knows of it."""
    found = [model.departure(column, beside) for model in models]
    weight = np.array([1 / one.error**2 for one in found])
    total = float(weight.sum())
    return Departure(
        size=float(weight @ [one.size for one in found]) / total,
        error=total**-0.5,
        share=float(weight @ [one.share for one in found]) / total,
        known=float(np.median([one.known for one in found])),
        dof=sum(one.dof for one in found),
        level=LEVEL_OF_REFLEX if column.startswith("reflex") else LEVEL,
    )


@dataclass(frozen=True, eq=False)
class _Model:
    """A condition's weighted fit and the columns of the departures.

    Attributes
    ----------
    equation : ModalEquation
    weight : (d n, d n)
        V, the inverse of the noise's covariance.
    instruments : (T, 3 d, n) or None
    equations : TrialEquations
        The plain fit's, W against Z.
    parameters : (3 d^2,)
        Theirs.
    covariance : (3 d^2, 3 d^2)
    columns : mapping str -> (T, d, n)
    way : float
        Median peak displacement.
    """

    equation: ModalEquation
    weight: FloatArray
    instruments: FloatArray | None
    equations: TrialEquations
    parameters: FloatArray
    covariance: FloatArray
    columns: dict[str, FloatArray]
    way: float

    @classmethod
    def of(cls, window: Window, kind: Kind) -> _Model:
        """Fit the window without departures, and make their columns."""
        found = weighted_fit(window, kind)
        V = np.linalg.inv(found.noise.covariance(found.parameters))
        V = (V + V.T) / 2
        Z = expected_motion(found.equation)
        plain = compensated_equations(found.equation, found.noise, V, Z, kind)
        solved = solve_equations(plain)
        columns, way = _columns(window, found.equation, Z, solved.parameters)
        theta, covariance = solved.parameters, solved.covariance
        return cls(found.equation, V, Z, plain, theta, covariance, columns, way)

    def departure(self, column: str, beside: str | None = None) -> Departure:
        """The number k of one departure, with another one in the model beside it or without."""
        columns = [column] if beside is None else [column, beside]
        p, T = len(self.parameters), self.equation.trials
        size = p + len(columns)
        A, b = np.empty((T, size, size)), np.empty((T, size))
        A[:, :p, :p], b[:, :p] = self.equations.A, self.equations.b
        y = self.equation.force.reshape(T, -1)
        flat = [self.columns[name].reshape(T, -1) for name in columns]
        for i, name in enumerate(columns):
            A[:, p + i, :p], A[:, :p, p + i] = self._cross(name)
            weighted = flat[i] @ self.weight
            b[:, p + i] = (weighted * y).sum(axis=1)
            for j, other in enumerate(flat):
                A[:, p + i, p + j] = (weighted * other).sum(axis=1)
        names = (*self.equations.names, *columns)
        units = (*self.equations.units, *("" for _ in columns))
        # [[Z^T V W, Z^T V z], [z^T V W, z^T V z]] (p + 1, p + 1) [theta; k] = [Z^T V y; z^T V y]
        solved = solve_equations(TrialEquations(A, b, names, units))
        k, error = float(solved.parameters[p]), float(np.sqrt(solved.covariance[p, p]))
        which = slice(p // 3, 2 * p // 3) if column == "delay" else slice(2 * p // 3, p)
        own, apart = self.parameters[which], solved.parameters[which]
        share = float((own - apart) @ own / (own @ own)) / k if k else 0.0
        known = float(np.sqrt(own @ self.covariance[which, which] @ own)) / float(own @ own)
        return Departure(k, max(error, 1e-300), share, known, solved.dof)

    def _cross(self, name: str) -> tuple[FloatArray, FloatArray]:
        """``z^T V W`` and ``Z^T V z`` of every trial, (T, p) each."""
        moved = replace(self.equation, force=self.columns[name])
        kind: Kind = "hand"  # only names the parameters
        own = weighted_equations(moved, self.weight, kind).b
        if self.instruments is None:
            return own, own
        return own, weighted_equations(moved, self.weight, kind, instruments=self.instruments).b


def _columns(
    window: Window, equation: ModalEquation, Z: FloatArray | None, theta: FloatArray
) -> tuple[dict[str, FloatArray], float]:
    """The columns z (T, d, n) of all departures, and the median peak displacement."""
    d, used, smooth = equation.axes, window.usable, equation.modes.smooth
    M_B_K = theta.reshape(3, d, d)
    x = window.position[used] - window.position_at_onset[used][:, None]
    squared = (x**2).sum(axis=2, keepdims=True)
    way = float(np.sqrt(np.median(squared.max(axis=(1, 2)))))

    def bears(displacement: FloatArray) -> FloatArray:
        # K (d, d) times the modes (n, S) of a displacement (T, S, d)
        modes = np.tensordot(displacement, smooth, axes=(1, 1))
        return np.tensordot(modes, M_B_K[2], axes=(1, 1)).transpose(0, 2, 1)

    columns = {"amplitude": bears(x * squared / way**2)}
    for late in REFLEX_S:
        before = delayed(x.transpose(0, 2, 1), late * window.sample_rate_hz)
        columns[_reflex(late)] = bears(before.transpose(0, 2, 1))
    # [M B K] (d, 3 d) times the motion (3 d, n), free of its own noise where Z is
    force = M_B_K.transpose(1, 0, 2).reshape(d, 3 * d) @ (equation.regressors if Z is None else Z)
    columns["delay"] = -force @ (equation.modes.first @ smooth.T).T
    return columns, way


def _lack_of_fit(models: Sequence[_Model], *, explained: bool) -> tuple[Finding, ...]:
    """What repeats in each disturbance beyond the fit, beside what differs between repeats."""
    found = [one for model in models if (one := _repeated(model)) is not None]
    if not found:
        return ()
    part, p_value, least = (float(np.median(column)) for column in np.transpose(found))
    told = part > LEAST_REPEATED and p_value < LEVEL_OF_REPEATS and not explained
    text = (
        f"{100 * part:.1f} % of the response repeats in each direction and is not explained by "
        "M, B and K" + ("; look at it (`--method all`, `reflex`)" if told else "")
    )
    smallest = f"{100 * max(least, LEAST_REPEATED):.2g} % of the response"
    return (Finding("lack of fit", "warning" if told else "ok", text, smallest=smallest),)


def _repeated(model: _Model) -> tuple[float, float, float] | None:
    """Repeated part of the response, p of none, and the least part seen; None without repeats."""
    labels = model.equation.disturbance
    if labels is None:
        return None
    root = np.linalg.cholesky(model.weight)
    # white residuals r_t^T L (d n,), V = L L^T
    white = model.equation.residual(model.parameters) @ root
    counts = np.bincount(labels)
    chosen = counts[labels] > 1
    if not chosen.any():
        return None
    sums = np.zeros((len(counts), white.shape[1]))
    np.add.at(sums, labels, white)
    mean = (sums / np.maximum(counts, 1)[:, None])[labels]
    groups, rows = int((counts > 1).sum()), white.shape[1]
    between, within = (mean[chosen] ** 2).sum(), ((white - mean)[chosen] ** 2).sum()
    free = groups * rows - len(model.parameters), (int(chosen.sum()) - groups) * rows
    if free[0] <= 0:
        return None
    noise = within / free[1]
    response = float(((model.equation.force.reshape(len(white), -1) @ root)[chosen] ** 2).sum())
    part = float(np.sqrt(max(between - free[0] * noise, 0.0) / response))
    p_value = float(fdtrc(free[0], free[1], between / free[0] / noise))
    least = float(np.sqrt(3 * np.sqrt(2 * free[0]) * noise / response))
    return part, p_value, least
