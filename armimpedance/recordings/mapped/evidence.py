"""Evidence on the meaning of a column, from its name and its numbers."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.arrays import FloatArray
from armimpedance.recordings.mapped.mapping import known_unit
from armimpedance.recordings.mapped.text_layout import stated_unit

#: Range of sample rates in recordings of arms.
SLOWEST_HZ, FASTEST_HZ = 15.0, 12_000.0
#: Span of a hand's record: in m below the first, in mm above the second, in between unclear.
SPAN_M, SPAN_MM = 0.4, 100.0
#: Angles beyond a full turn are degrees.
_TURN: Final = 2.0 * np.pi
#: Least share of the force that the motion must explain for evidence on its sign.
_SAYS_LITTLE: Final = 0.2
#: Most trials, most samples of a trial, and fewest samples of a trial for this evidence.
_MOST_PIECES, _LONGEST, _SHORTEST = 60, 20_000, 30


@dataclass(frozen=True)
class FoundMeaning:
    """A word for the mapping and the reason; None if the data do not show it."""

    word: str | None
    why: str


def finite_part(values: NDArray[Any]) -> FloatArray:
    """Return the finite numbers among the values."""
    numbers = np.asarray(values, dtype=np.float64)
    return numbers[np.isfinite(numbers)]


#: Least share of rows with a number in a column of time.
_PRESENT: Final = 0.5


def time_steps(values: NDArray[Any]) -> tuple[float, float] | None:
    """Usual step, and share of steps within 10 % of it; None if the values are not like time."""
    numbers = np.asarray(values, dtype=np.float64)
    present = ~np.isnan(numbers)  # rows that fill a trial up may have none
    if np.count_nonzero(present) < max(3, _PRESENT * len(numbers)):
        return None
    numbers = numbers[present]
    if not np.isfinite(numbers).all():
        return None
    numbers = numbers[: measured_rows(numbers)]
    with np.errstate(over="ignore", invalid="ignore"):
        step = np.diff(numbers)
    forward = step[step > 0]
    if len(forward) < 0.9 * len(step) or not np.isfinite(forward).all():
        return None
    usual = float(np.median(forward))
    return usual, float(np.mean(np.abs(step - usual) < 0.1 * usual))


def measured_rows(values: FloatArray) -> int:
    """Number of rows of (N,) or (N, d) without repeated rows at the end."""
    if len(values) < 2:
        return len(values)
    equal = (np.diff(values, axis=0) == 0).reshape(len(values) - 1, -1).all(axis=1)
    changes = np.flatnonzero(~equal)
    filled = len(values) - (int(changes[-1]) + 1 if len(changes) else 0)
    return len(values) - filled if 1 < filled < _PRESENT * len(values) else len(values)


def time_unit(step: float) -> FoundMeaning:
    """Unit of time for which a step gives a plausible rate."""
    units = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
    fits = [u for u, per in units.items() if SLOWEST_HZ <= per / step <= FASTEST_HZ]
    reason = f"a step of {step:.6g}"
    if len(fits) != 1:
        return FoundMeaning(None, f"{reason} fits {' and '.join(fits) or 'no unit of time'}")
    return FoundMeaning(fits[0], f"{reason} makes {units[fits[0]] / step:.6g} Hz")


def length_unit(columns: Sequence[NDArray[Any]]) -> FoundMeaning:
    """Metres or millimetres, from the span of a hand's record."""
    spans = [float(np.ptp(v)) for c in columns if len(v := finite_part(c))]
    span = max(spans, default=0.0)
    reason = f"the hand's record spans {span:.3g}"
    if span > SPAN_MM:
        return FoundMeaning("mm", reason)
    largest = max(
        (float(np.abs(finite_part(c)).max()) for c in columns if len(finite_part(c))), default=0
    )
    if 0 < span < SPAN_M and largest < 2.0:
        return FoundMeaning("m", reason)
    return FoundMeaning(None, f"{reason}: m, cm and mm are possible")


def angle_unit(columns: Sequence[NDArray[Any]]) -> FoundMeaning:
    """Degrees if the values exceed a full turn in radians."""
    values = [v for c in columns if len(v := finite_part(c))]
    largest = max((float(np.abs(v).max()) for v in values), default=0.0)
    span = max((float(np.ptp(v)) for v in values), default=0.0)
    reason = f"values to {largest:.3g}, spanning {span:.3g}"
    if largest > _TURN:
        return FoundMeaning("deg", f"{reason}: more than a turn in rad")
    return FoundMeaning(None, f"{reason}: rad and deg are possible")


def moves(values: NDArray[Any]) -> bool:
    """Return True if a column changes."""
    numbers = finite_part(values)
    return len(numbers) > 1 and bool(np.ptp(numbers) > 0)


def stays(values: NDArray[Any]) -> bool:
    """Return True if a column holds a single number or text in all rows."""
    return len(values) > 1 and bool((values == values[0]).all())


def trial_numbers(values: NDArray[Any]) -> bool:
    """Return True if a column holds integers, or texts, that change rarely."""
    if values.dtype.kind == "U":
        changes = int((values[1:] != values[:-1]).sum())
        return 0 < changes < len(values) / 5
    numbers = finite_part(values)
    if len(numbers) < 10 or (numbers != np.round(numbers)).any():
        return False
    changes = int((np.diff(numbers) != 0).sum())
    return 0 < changes < len(numbers) / 5


def is_switch(values: NDArray[Any]) -> tuple[float, int] | None:
    """Middle of a column with two levels, and number of its rises; None if it has other values."""
    if values.dtype.kind == "U":
        return None
    numbers = finite_part(values)
    levels = np.unique(numbers[:: max(1, len(numbers) // 20_000)]) if len(numbers) else numbers
    if len(levels) != 2:
        return None
    middle = float(levels.mean())
    over = numbers > middle
    return middle, int((over[1:] & ~over[:-1]).sum())


def roughness(values: NDArray[Any]) -> float:
    """Relative change from sample to sample: small for positions, near 1 for noise."""
    numbers = finite_part(values)
    if len(numbers) < 3 or not np.ptp(numbers) > 0:
        return float("nan")
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.std(np.diff(numbers)) / np.std(numbers))


@dataclass(frozen=True)
class ForceLaw:
    """The force as a function of inertia, viscosity and stiffness: diagonal elements, per axis.

    `inertia`, `stiffness` (d,): in the units of the file.
    `explained` (d,): share of the force's variance.
    """

    inertia: FloatArray
    stiffness: FloatArray
    explained: FloatArray


def force_law(records: Sequence[tuple[FloatArray, FloatArray]], step_s: float) -> ForceLaw | None:
    """Fit the force's change in each trial as M x'' + B x' + K x; None without enough motion.

    `records` sequence of (N, d) and (N, d): position and force of each trial.
    """
    with np.errstate(all="ignore"):
        return _fitted(records[:_MOST_PIECES], step_s)


def _fitted(records: Sequence[tuple[FloatArray, FloatArray]], step_s: float) -> ForceLaw | None:
    motions, forces = [], []
    for position, force in records:
        x, f = _smooth(position[:_LONGEST]), _smooth(force[:_LONGEST])
        if len(x) > _SHORTEST and np.isfinite(x).all() and np.isfinite(f).all():
            v = np.gradient(x, step_s, axis=0)
            motion = np.hstack([x, v, np.gradient(v, step_s, axis=0)])[5:-5]
            motions.append(motion - motion.mean(axis=0))
            forces.append(f[5:-5] - f[5:-5].mean(axis=0))
    if not motions:
        return None
    W, y = np.concatenate(motions), np.concatenate(forces)
    scale = np.abs(W).max(axis=0)
    if not (scale > 0).all() or not (np.ptp(y, axis=0) > 0).all() or not np.isfinite(scale).all():
        return None
    if not np.isfinite(y).all():
        return None
    solution = np.linalg.lstsq(W / scale, y, rcond=None)[0] / scale[:, None]
    d, axes = y.shape[1], np.arange(y.shape[1])
    explained = 1.0 - np.var(y - W @ solution, axis=0) / np.var(y, axis=0)
    return ForceLaw(solution[2 * d + axes, axes], solution[axes, axes], explained)


def _smooth(values: FloatArray) -> FloatArray:
    """Mean over five samples, the same for position and force."""
    if len(values) < _SHORTEST:
        return values[:0]
    sums = np.cumsum(np.vstack([np.zeros((1, values.shape[1])), values]), axis=0)
    return (sums[5:] - sums[:-5]) / 5.0


def force_remarks(axes: Sequence[str], law: ForceLaw | None) -> tuple[str, ...]:
    """Sentences on the evidence of the fit for the force's sign."""
    if law is None:
        return ("The data say nothing of it: force or position hardly changes.",)
    shown = "; ".join(
        f"{axis}: M {m:+.3g}, K {k:+.3g}, {100 * max(e, 0.0):.0f} % explained"
        for axis, m, k, e in zip(axes, law.inertia, law.stiffness, law.explained, strict=True)
    )
    sentences = [f"The force as M x'' + B x' + K x has, in units of the file: {shown}."]
    if law.explained.min() < _SAYS_LITTLE or len(set(np.sign(law.inertia))) > 1:
        return (*sentences, "That does not speak for either.")
    word, opposite = ("limb", "device") if law.inertia[0] < 0 else ("device", "limb")
    sentences.append(f'If the device moved the limb, the sign of M speaks for "{word}";')
    return (*sentences, f'if the person moved the device, for "{opposite}".')


# Meaning of a column from its name: words of labs, in a few languages.

Role = Literal[
    "time", "sample", "position", "force", "angle", "torque", "emg", "trial", "condition",
    "set", "direction", "onset", "trigger", "commanded", "rate", "other", "unknown",
]  # fmt: skip

_WORDS: Final[dict[Role, str]] = {
    "other": "vel velocity speed velo geschwindigkeit vitesse acc accel acceleration "
    "beschleunigung jerk qd qdd dq ddq dx dy dz vx vy vz ax ay az quat quaternion "
    "temperature voltage current residual error status gaze eye pupil button",
    "commanded": "cmd command commanded des desired ref reference target goal setpoint soll "
    "sollwert consigne",
    "emg": "emg myo biceps triceps deltoid deltoideus pectoralis brachialis brachioradialis "
    "infraspinatus trapezius latissimus soleus gastrocnemius tibialis bic tri pec brd "
    "bizeps trizeps flexor extensor",
    "torque": "tau torque torques trq tq moment moments drehmoment couple mz",
    "force": "f force forces kraft fs load forcex forcey forcez fx fy fz",
    "angle": "q angle angles ang theta phi winkel gelenkwinkel joint joints shoulder elbow wrist "
    "knee ankle schulter ellbogen encoder l1ang l2ang",
    "time": "t time times zeit temps timestamp timestamps stamp seconds tiempo tempo",
    "sample": "sample samples frame frames index idx row nr",
    "trial": "trial trials trialnr trialno trialnum trialnumber trialid versuch essai rep "
    "repetition tr trl",
    "condition": "cond condition conditions bedingung phase type typ posture postures",
    "set": "set block session run",
    "direction": "dir direction directions richtung",
    "onset": "onset onsets",
    "trigger": "trigger trig perturb perturbation pert pulse disturbance sync stim stimulus ttl",
    "rate": "fs rate samplerate hz srate freq frequency sampling",
    "position": "pos position positions hand handle endpoint ee tip tool tcp ort weg x y z px py "
    "pz xyz xy displacement cursor",
}  # fmt: skip
_ROLE_OF: Final = {word: role for role, words in _WORDS.items() for word in words.split()}
#: Priority of roles if a name has words of several: hand_velocity_x is not a position.
_ORDER: Final[tuple[Role, ...]] = (
    "emg", "other", "commanded", "onset", "trigger", "direction", "torque", "force", "angle",
    "trial", "condition", "set", "time", "sample", "position", "rate",
)  # fmt: skip
_AXIS: Final = {
    **{w: a for a in "xyz" for w in (a, f"f{a}", f"p{a}", f"force{a}", f"m{a}", f"t{a}")},
    "shoulder": "1", "schulter": "1", "elbow": "2", "ellbogen": "2", "l1ang": "1", "l2ang": "2",
    # the two rotations of a wrist or an ankle
    **dict.fromkeys(("fe", "flexion", "dp", "dorsiflexion", "plantarflexion", "pf"), "1"),
    **dict.fromkeys(("rud", "deviation", "ie", "inversion", "eversion"), "2"),
}  # fmt: skip
#: Units at the end of names; "min" and "in" have other meanings there.
_ENDINGS: Final = (
    "s",
    "ms",
    "us",
    "m",
    "cm",
    "mm",
    "rad",
    "deg",
    "N",
    "mN",
    "Nm",
    "Nmm",
    "V",
    "mV",
    "uV",
)
#: Words for a disturbance; its angle is a direction.
_PUSHES: Final = {"pert", "perturb", "perturbation", "push", "pulse", "disturbance", "displacement"}
_ANGLES: Final = {"angle", "ang", "phi", "theta", "winkel", "dir", "direction"}
#: Dimension of a unit -> the roles that a column in it can have.
_BY_UNIT: Final[dict[str, tuple[Role, ...]]] = {
    "length": ("position", "commanded", "other"),
    "force": ("force", "commanded", "other"),
    "torque": ("torque", "commanded", "other"),
    "angle": ("angle", "direction", "commanded", "other"),
    "time": ("time", "onset", "trigger", "other"),
    "emg": ("emg", "force", "torque", "trigger", "other"),
}
#: Roles that are ignored in the name of a struct of which the column is a part.
_OF_TRIALS: Final = ("trial", "set", "condition", "sample")


@dataclass(frozen=True)
class ReadName:
    """Parts and meaning of a column's name.

    `axis`: "x", "y", "z", a number, or "" if there is none.
    `stem`: the words without the axis; columns with the same stem belong together.
    `unit`: as stated in the name or the file.
    `label`: the text that was read instead of the name, if the file has one.
    """

    name: str
    role: Role
    axis: str
    stem: str
    unit: str | None
    label: str = ""


def read_name(name: str, unit: str | None = None) -> ReadName:
    """Read a column's name.

    `unit`: the unit stated in the file; the name may state one too.
    """
    bare, unit_in_name = _without_unit(name)
    *parents, last = bare.split(".")
    # trials.pos is a position, in a struct of trials
    parent_words = [
        w for part in parents for w in words_of(part) if _ROLE_OF.get(w) not in _OF_TRIALS
    ]
    words = [*parent_words, *words_of(last)]
    axis = next((_AXIS[w] for w in words if w in _AXIS), "")
    number = next((w for w in reversed(words) if w.isdigit()), "")
    axis = axis or number
    stem = " ".join(remaining for w in words if (remaining := _without_axis(w, number)))
    stated = unit if unit is not None else unit_in_name
    return ReadName(name, _role_by_words(words, stated), axis, stem, stated)


def _role_by_words(words: Sequence[str], unit: str | None) -> Role:
    """Role of a column by the words of its name and its unit."""
    if words in (["fs"], ["f", "s"]) or {"rate", "hz", "freq", "frequency"} & set(words):
        role: Role = "rate"
    else:
        roles = [_ROLE_OF[w] for w in words if w in _ROLE_OF]
        role = next((r for r in _ORDER if r in roles), "unknown")
        role = "time" if role == "trial" and "time" in roles else role
    if _PUSHES & set(words) and _ANGLES & set(words):
        role = "direction"
    # a unit says more than a word: FrobX_N is a force
    return role if unit is None or role == "rate" else _role_in_unit(role, unit)


def _without_axis(word: str, number: str) -> str:
    """Rest of a word without the axis: the f of fx."""
    if word == number:
        return ""
    if word not in _AXIS:
        return word
    return word[0] if len(word) == 2 and word[1] in "xyz" else ""


def words_of(name: str) -> list[str]:
    """Split a name into words in lower case: ``Right_HandX`` gives right, hand, x."""
    text = re.sub(r"(?<=[a-zäöüé])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", name)
    text = re.sub(r"(?<=[A-Za-z])(?=\d)|(?<=\d)(?=[A-Za-z])", " ", text)
    words = [word.lower() for word in re.findall(r"[^\W\d_]+|\d+", text)]
    joined: list[str] = []
    for word in words:
        if joined and joined[-1] == "l" and word.isdigit():
            joined[-1] = f"l{word}"
        elif joined and joined[-1] in ("l1", "l2") and word == "ang":
            joined[-1] += "ang"
        else:
            joined.append(word.lstrip("0") or "0" if word.isdigit() else word)
    return joined


def _without_unit(name: str) -> tuple[str, str | None]:
    """Split a name into name and unit: ``x_mm``, ``Fx [N]``, ``time_s``."""
    # MATLAB's pos_mm(:,1)
    part = re.search(r"\([\d:*, ]+\)$", name)
    whole, at = (name, "") if part is None else (name[: part.start()], part.group())
    stated = stated_unit(whole)
    if stated is not None:
        return whole[: whole.rindex(stated)].rstrip(" ([/").removesuffix(" in") + at, stated
    match = re.fullmatch(r"(.+)[_ .](\w+)", whole)
    if match and match.group(2) in _ENDINGS:
        return match.group(1) + at, match.group(2)
    return name, None


def _role_in_unit(role: Role, unit: str) -> Role:
    """Role of a column with a stated unit: that of its name if the unit allows it."""
    known = known_unit(unit)
    possible = _BY_UNIT.get("" if known is None else known.dimension, ())
    if not possible or role in possible or role in ("trial", "condition", "set", "sample"):
        return role
    return possible[0] if possible[0] != "emg" else "unknown"
