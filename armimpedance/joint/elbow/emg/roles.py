"""Roles of muscles (flexor, extensor), and whether their amplitudes can be separated."""

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
#: Sign of a muscle's torque if flexion is positive.
SIGN: Final[dict[str, int]] = {"flexor": 1, "extensor": -1}


@dataclass(frozen=True)
class Role:
    """Action of a muscle at the elbow; `biarticular` muscles also span the shoulder."""

    action: Action
    biarticular: bool = False

    @property
    def sign(self) -> int:
        """Sign of its torque; flexion is positive."""
        return SIGN[self.action]


#: Roles of common muscle names; the caller states those of others.
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
    muscles: tuple[str, ...], stated: Mapping[str, Action] | None = None
) -> tuple[Role, ...]:
    """Role of each muscle: as stated, else by its name.

    Raises InputError: an unknown name, an unknown role, or no flexor or no extensor among the
    muscles.
    """
    stated = {} if stated is None else stated
    roles = []
    for muscle in muscles:
        if muscle in stated:
            if stated[muscle] not in SIGN:
                raise InputError(
                    f"{muscle} as {stated[muscle]!r}", expected="'flexor' or 'extensor'"
                )
            usual = ROLES.get(muscle)
            roles.append(Role(stated[muscle], usual.biarticular if usual else False))
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


# Does each muscle pull in the direction of its name? The torque that the subject holds decides.
#
# A limb that is held still exerts the torque of its muscles and its weight on the device. The mean
# torque of a trial is therefore linear in the activations: it rises with a flexor's and falls with
# an extensor's. If the names are exchanged, the signs here are wrong, whereas in K and B only the
# (positive) slopes are exchanged.

#: Confidence level at which a slope's sign is certain.
SURE: Final = 0.998
_NAME: Final = "muscles"
_WHAT_TO_DO: Final = (
    "look at which electrode is on which muscle, and whether flexion is the positive direction of "
    "angle and torque"
)


def check_names(law: LinearLaw, roles: Mapping[str, Action] | None = None) -> Finding:
    """Check the muscles' names against the signs in a law of their torque.

    `law`: of the limb's mean torque on the device, N m, flexion positive.
    `roles`: for muscles whose names do not show their role.
    Returns: the finding "muscles".
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
        text = f"the muscles' names are exchanged: {', '.join(against)}; {_WHAT_TO_DO}"
        return Finding(_NAME, "warning", text, smallest)
    if against:
        text = f"not every electrode is on the muscle that it is named by: {', '.join(against)}"
        return Finding(_NAME, "warning", f"{text}; {_WHAT_TO_DO}", smallest)
    if (pull > half).all():
        return Finding(_NAME, "ok", "the torque that is held has the signs of the names", smallest)
    text = (
        "the subject holds too little torque to tell which electrode is on which muscle; add "
        "trials with the flexor, and with the extensor, held against a load"
    )
    return Finding(_NAME, "cannot tell", text, smallest)


def _said(name: str, slope: float) -> str:
    way = "flexion" if slope > 0 else "extension"
    return f"the torque that is held goes into {way} with {name} ({slope:+.3g} N m)"


# Can these amplitudes separate the muscles? They are refused if they rise and fall together.

#: Share of the largest singular value below which the smallest counts as zero; of amplitudes about
#: their means, scaled to unit length. EMG is never known more precisely.
RANK_TOLERANCE: Final = 0.01
#: Least range of an amplitude that varies, as a share of the maximum contraction.
NO_CHANGE: Final = 1e-3
#: Advice in the error messages.
HINT: Final = (
    "add trials in which one is active without the other: hold a load up (flexor) and one that "
    "pulls up (extensor), besides co-contraction"
)


def refuse_alike(
    amplitude: FloatArray, amplitude_sd: FloatArray, muscles: tuple[str, ...]
) -> tuple[float, float]:
    """Condition numbers of [1, s] (L, m + 1), and of s about its means with unit columns.

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


# Combinations of EMG amplitudes that vary beyond their errors.
#
# A course K(t), B(t) does not need separate coefficients of the muscles. If flexor and extensor
# vary together, or their difference is mostly error, the law uses the combination that varies.

#: A combination is left out if errors explain all but less than this share of its power.
LEAST_RELIABLE: Final = 0.3
#: Power of a combination, relative to that of its parts, below which it does not vary.
LEAST_POWER: Final = 1e-9


@dataclass(frozen=True, eq=False)
class Directions:
    """Combinations (c) of m amplitudes that a law can use.

    `weights` (m, c): the identity if all amplitudes can be separated.
    `complete`: True if they can.
    `told`: description of the combinations for a message.
    """

    weights: FloatArray
    complete: bool = True
    told: str = "the amplitudes"
    warnings: tuple[str, ...] = ()


def directions_of(
    amplitude: FloatArray, sd: FloatArray | None, words: tuple[str, ...]
) -> Directions:
    """Return the amplitudes (N, m) themselves, or the combinations that errors do not explain.

    `amplitude` (N, m).
    `sd` (m,) or None: their standard errors.
    `words`: names of the muscles.
    Raises NotIdentifiableError: errors explain most of every combination.
    """
    centred = amplitude - amplitude.mean(axis=0)
    m = len(words)
    errors = np.zeros(m) if sd is None else len(amplitude) * sd**2
    moments = ErrorMoments(
        (centred.T @ centred)[None],
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
    description = "; ".join(_said_of_direction(column, words) for column in weights.T)
    return Directions(
        weights,
        False,
        description,
        (
            f"{' and '.join(words)} cannot be told apart by their amplitudes: K and B follow "
            f"{description}; there are no coefficients of each",
        ),
    )


def _said_of_direction(weights: FloatArray, words: tuple[str, ...]) -> str:
    parts = [f"{w:+.2g} {word}" for w, word in zip(weights, words, strict=True) if abs(w) > 0.005]
    return " ".join(parts)
