"""What a column may hold, from its name: the words that labs use, in a few languages."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final, Literal

from armimpedance.recordings.mapped.text_layout import stated_unit
from armimpedance.recordings.mapped.units import known_unit

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
    "condition": "cond condition conditions bedingung phase type typ",
    "set": "set block session run",
    "direction": "dir direction directions richtung",
    "onset": "onset onsets",
    "trigger": "trigger trig perturb perturbation pert pulse disturbance sync stim stimulus ttl",
    "rate": "fs rate samplerate hz srate freq frequency sampling",
    "position": "pos position positions hand handle endpoint ee tip tool tcp ort weg x y z px py "
    "pz xyz xy displacement cursor",
}  # fmt: skip
_ROLE_OF: Final = {word: role for role, words in _WORDS.items() for word in words.split()}
#: The role that counts where a name has words of several: hand_velocity_x is no position.
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
#: Units that names end in; "min" and "in" are other words there.
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
#: Words that say nothing of a column where they name the struct that it is part of.
_OF_TRIALS: Final = ("trial", "set", "condition", "sample")


@dataclass(frozen=True)
class ReadName:
    """What a name says.

    Attributes
    ----------
    name : str
    role : str
    axis : str
        "x", "y", "z", a number, or "" where it says none.
    stem : str
        The words without the axis: columns of one stem belong together.
    unit : str or None
        As the name or the file states it.
    """

    name: str
    role: Role
    axis: str
    stem: str
    unit: str | None


def read_name(name: str, unit: str | None = None) -> ReadName:
    """Read a column's name.

    Parameters
    ----------
    name : str
    unit : str, optional
        As the file states it; the name may state one too.
    """
    bare, own = _without_unit(name)
    *parents, last = bare.split(".")
    # trials.pos is a position, of a struct of trials.
    above = [w for part in parents for w in words_of(part) if _ROLE_OF.get(w) not in _OF_TRIALS]
    words = [*above, *words_of(last)]
    roles = [_ROLE_OF[w] for w in words if w in _ROLE_OF]
    role: Role = next((r for r in _ORDER if r in roles), "unknown")
    if words in (["fs"], ["f", "s"]) or {"rate", "hz", "freq", "frequency"} & set(words):
        role = "rate"
    axis = next((_AXIS[w] for w in words if w in _AXIS), "")
    number = next((w for w in reversed(words) if w.isdigit()), "")
    axis = axis or number
    stem = " ".join(rest for w in words if (rest := _without_axis(w, number)))
    stated = unit if unit is not None else own
    if role == "unknown" and stated is not None:
        role = _role_of_unit(stated)
    return ReadName(name, role, axis, stem, stated)


def _without_axis(word: str, number: str) -> str:
    """What of a word is not the axis: the f of fx."""
    if word == number:
        return ""
    if word not in _AXIS:
        return word
    return word[0] if len(word) == 2 and word[1] in "xyz" else ""


def words_of(name: str) -> list[str]:
    """The words of a name, in small letters: ``Right_HandX`` gives right, hand, x."""
    text = re.sub(r"(?<=[a-zäöüé])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", name)
    text = re.sub(r"(?<=[A-Za-z])(?=\d)|(?<=\d)(?=[A-Za-z])", " ", text)
    found = [word.lower() for word in re.findall(r"[^\W\d_]+|\d+", text)]
    joined: list[str] = []
    for word in found:
        if joined and joined[-1] == "l" and word.isdigit():
            joined[-1] = f"l{word}"
        elif joined and joined[-1] in ("l1", "l2") and word == "ang":
            joined[-1] += "ang"
        else:
            joined.append(word.lstrip("0") or "0" if word.isdigit() else word)
    return joined


def _without_unit(name: str) -> tuple[str, str | None]:
    """A name and the unit that stands in it: ``x_mm``, ``Fx [N]``, ``time_s``."""
    stated = stated_unit(name)
    if stated is not None:
        return name[: name.rindex(stated)].rstrip(" ([/").removesuffix(" in"), stated
    match = re.fullmatch(r"(.+)[_ .](\w+)", name)
    if match and match.group(2) in _ENDINGS:
        return match.group(1), match.group(2)
    return name, None


def _role_of_unit(unit: str) -> Role:
    known = known_unit(unit)
    dimension = "" if known is None else known.dimension
    roles: dict[str, Role] = {
        "time": "time",
        "length": "position",
        "force": "force",
        "torque": "torque",
        "angle": "angle",
    }
    return roles.get(dimension, "unknown")
