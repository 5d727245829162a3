"""Which muscles flex, which extend, and whether their amplitudes can be told apart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.core.findings import Finding
from armimpedance.joint.elbow.emg.law_result import LinearLaw
from armimpedance.numerics.regression import ErrorMoments, refuse_unreliable, t_factor

Action = Literal["flexor", "extensor"]
#: Sign of a muscle's torque where flexion is positive.
SIGN: Final[dict[str, int]] = {"flexor": 1, "extensor": -1}


@dataclass(frozen=True)
class Role:
    """What a muscle does at the elbow; `biarticular` spans the shoulder too."""

    action: Action
    biarticular: bool = False

    @property
    def sign(self) -> int:
        """Of its torque: flexion positive."""
        return SIGN[self.action]


#: Names as they are usual; others are given by the caller.
ROLES: Final[dict[str, Role]] = {
    "flexor": Role("flexor"),
    "extensor": Role("extensor"),
    "brachioradialis": Role("flexor"),
    "brachialis": Role("flexor"),
    "biceps": Role("flexor", biarticular=True),
    "biceps_long": Role("flexor", biarticular=True),
    "biceps_short": Role("flexor", biarticular=True),
    "triceps_lateral": Role("extensor"),
    "triceps_medial": Role("extensor"),
    "anconeus": Role("extensor"),
    "triceps": Role("extensor", biarticular=True),
    "triceps_long": Role("extensor", biarticular=True),
}


def roles_of(
    muscles: tuple[str, ...], given: Mapping[str, Action] | None = None
) -> tuple[Role, ...]:
    """The role of each muscle: as given, else by its name.

    Raises InputError: a name that says nothing, a role that is none, or no flexor or no extensor
    among them.
    """
    given = {} if given is None else given
    roles = []
    for muscle in muscles:
        if muscle in given:
            if given[muscle] not in SIGN:
                raise InputError(
                    f"{muscle} as {given[muscle]!r}", expected="'flexor' or 'extensor'"
                )
            known = ROLES.get(muscle)
            roles.append(Role(given[muscle], known.biarticular if known else False))
        elif muscle in ROLES:
            roles.append(ROLES[muscle])
        else:
            raise InputError(
                f"not known whether {muscle} flexes or extends the elbow",
                expected=f"its role, or one of {', '.join(ROLES)}",
            )
    for action in SIGN:
        if all(role.action != action for role in roles):
            raise InputError(
                f"no {action} among {', '.join(muscles)}", expected="a flexor and an extensor"
            )
    return tuple(roles)


# Does each muscle pull the way its name says? The torque that the subject holds tells.
#
# A limb that is held still pushes against the device by what its muscles and its weight do, so the
# muscles' mean torque, trial by trial, is linear in their activation: it rises with a flexor's and
# falls with an extensor's. Names that were exchanged change only whose slope is whose in K and B,
# where both are positive; here the signs are exchanged.

#: Level at which a slope's sign is sure.
SURE: Final = 0.998
_NAME: Final = "muscles"
_WHAT_TO_DO: Final = (
    "look at which electrode is on which muscle, and whether flexion is the positive direction of "
    "angle and torque"
)


def check_names(law: LinearLaw, roles: Mapping[str, Action] | None = None) -> Finding:
    """Hold the muscles' names against the signs of a law of their torque.

    `law`: of the limb's mean torque on the device, N m, flexion positive.
    `roles`: for muscles whose names do not say it.
    Returns: "muscles".
    """
    try:
        sign = np.array([role.sign for role in roles_of(law.muscles, roles)], dtype=float)
    except InputError as error:
        return Finding(_NAME, "cannot tell", f"the names are not held against the torque: {error}")
    half = t_factor(law.parameters.dof, SURE) * law.parameters.sd[1:]
    smallest = f"{half.max():.2g} N m at the maximum contraction"
    pull = sign * law.slopes
    against = [
        _said(name, slope)
        for name, slope, sure in zip(law.muscles, law.slopes, pull < -half, strict=True)
        if sure
    ]
    if len(against) == len(pull):
        said = f"the muscles' names are exchanged: {', '.join(against)}; {_WHAT_TO_DO}"
        return Finding(_NAME, "warning", said, smallest)
    if against:
        said = f"not every electrode is on the muscle that it is named by: {', '.join(against)}"
        return Finding(_NAME, "warning", f"{said}; {_WHAT_TO_DO}", smallest)
    if (pull > half).all():
        return Finding(_NAME, "ok", "the torque that is held has the signs of the names", smallest)
    said = (
        "the subject holds too little torque to tell which electrode is on which muscle; add "
        "trials with the flexor, and with the extensor, held against a load"
    )
    return Finding(_NAME, "cannot tell", said, smallest)


def _said(name: str, slope: float) -> str:
    way = "flexion" if slope > 0 else "extension"
    return f"the torque that is held goes into {way} with {name} ({slope:+.3g} N m)"


# Can these amplitudes tell the muscles apart? Refused where they rise and fall together.

#: A smallest singular value below this part of the largest, of amplitudes about their means and
#: of unit length, counts as zero: EMG is never known any better.
RANK_TOLERANCE: Final = 0.01
#: Amplitudes that differ by less do not vary; part of the maximum contraction.
NO_CHANGE: Final = 1e-3
#: What to do about it.
HINT: Final = (
    "add trials in which one is active without the other: hold a load up (flexor) and one that "
    "pulls up (extensor), besides co-contraction"
)


def refuse_alike(
    amplitude: FloatArray, amplitude_sd: FloatArray, muscles: tuple[str, ...]
) -> tuple[float, float]:
    """Raw condition of [1, s] (L, m + 1), and that of s about its means with unit columns.

    Raises NotIdentifiableError: a muscle whose amplitude does not vary beyond its errors; muscles
    that vary together.
    """
    spread = amplitude.std(axis=0)
    noise = np.sqrt((amplitude_sd**2).mean(axis=0))
    still = (np.ptp(amplitude, axis=0) <= NO_CHANGE) | (spread <= noise)
    if still.any():
        names = tuple(np.array(muscles)[still].tolist())
        raise NotIdentifiableError(
            f"the amplitude of {', '.join(names)} does not vary beyond its errors (spread "
            f"{spread[still][0]:.3g}, error {noise[still][0]:.3g}): its effect cannot be "
            f"distinguished from a constant; {HINT}",
            names,
        )
    centred = amplitude - amplitude.mean(axis=0)
    _, singular, directions = np.linalg.svd(centred / np.linalg.norm(centred, axis=0))
    if singular[-1] < RANK_TOLERANCE * singular[0]:
        weight = np.abs(directions[-1])
        names = tuple(np.array(muscles)[weight > 0.1 * weight.max()].tolist())
        raise NotIdentifiableError(
            f"{' and '.join(names)} rise and fall together in all {len(amplitude)} points: their "
            f"parts cannot be told apart; {HINT}",
            names,
        )
    raw = np.linalg.cond(np.column_stack([np.ones(len(amplitude)), amplitude]))
    return float(raw), float(singular[0] / singular[-1])


# Which combinations of EMG amplitudes can be told apart beyond their errors.
#
# A course K(t), B(t) does not need the muscles' coefficients one by one: where flexor and extensor
# move together, or errors make most of what tells them apart, the combination that does move
# carries the law.

#: Part of a combination's power that errors do not explain, below which it is left out.
LEAST_RELIABLE: Final = 0.3
#: Power of a combination, over that of its parts, below which it does not move.
LEAST_POWER: Final = 1e-9


@dataclass(frozen=True, eq=False)
class Directions:
    """Combinations (c) of m amplitudes.

    `weights` (m, c): the identity where all amplitudes are told apart.
    `complete`: whether they are.
    """

    weights: FloatArray
    complete: bool = True
    told: str = "the amplitudes"
    warnings: tuple[str, ...] = ()


def directions_of(
    amplitude: FloatArray, sd: FloatArray | None, words: tuple[str, ...]
) -> Directions:
    """The amplitudes (N, m) themselves, or those combinations that errors do not explain.

    `amplitude` (N, m).
    `sd` (m,) or None: their standard errors.
    `words`: what the muscles are called.
    Raises NotIdentifiableError: errors explain most of every combination.
    """
    about = amplitude - amplitude.mean(axis=0)
    m = len(words)
    errors = np.zeros(m) if sd is None else len(amplitude) * sd**2
    moments = ErrorMoments(
        (about.T @ about)[None],
        np.zeros((1, m)),
        np.diag(errors)[None],
        tuple(f"the {word}'s amplitude" for word in words),
        ("",) * m,
    )
    refused: NotIdentifiableError | None = None
    try:
        if refuse_unreliable(moments)[0] >= LEAST_RELIABLE:
            return Directions(np.eye(m))
    except NotIdentifiableError as error:
        refused = error
    length = np.sqrt(np.diag(moments.gram[0]))
    # combinations v of amplitudes of unit length: G (m, m) v = power v
    power, v = np.linalg.eigh(moments.gram[0] / np.outer(length, length))
    share = ((errors / length**2) @ v**2) / np.maximum(power, LEAST_POWER)
    kept = (power > LEAST_POWER * power[-1]) & (share <= 1 - LEAST_RELIABLE)
    if not kept.any():
        raise refused or NotIdentifiableError(
            "errors explain most of every combination of the EMG amplitudes", moments.names
        )
    weights = v[:, kept][:, ::-1] / length[:, None]
    weights = weights / weights[np.abs(weights).argmax(axis=0), np.arange(weights.shape[1])]
    told = "; ".join(_said_of_direction(column, words) for column in weights.T)
    return Directions(
        weights,
        False,
        told,
        (
            f"{' and '.join(words)} cannot be told apart by their amplitudes: K and B follow "
            f"{told}; there are no coefficients of each",
        ),
    )


def _said_of_direction(weights: FloatArray, words: tuple[str, ...]) -> str:
    parts = [f"{w:+.2g} {word}" for w, word in zip(weights, words, strict=True) if abs(w) > 0.005]
    return " ".join(parts)
