"""Which muscles flex the elbow and which extend it, and which span the shoulder too."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

from armimpedance.core.errors import InputError

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

    Raises
    ------
    InputError
        A name that says nothing, a role that is none, or no flexor or no extensor among them.
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
