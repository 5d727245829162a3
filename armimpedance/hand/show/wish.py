"""Options of `plan` and `next`: requirements for an experiment, and abilities of its robot."""

from __future__ import annotations

from typing import Final

from armimpedance.show.verbs.kinds import Number, Whole
from armimpedance.show.verbs.options import Option

#: Title of these options in the commands' help.
WISH: Final = "wish"

#: Default requirement: K within so many per cent.
DEFAULT_K_PERCENT: Final = 10.0

K_PERCENT: Final = Option(
    "k_percent",
    Number(unit="%", above=0),
    f"K within so many per cent in each condition (default without another wish: "
    f"{DEFAULT_K_PERCENT:g})",
    group=WISH,
    doc="the 95 % interval of each diagonal element of K, in each condition, is to be at most +- "
    f"this many per cent of it; default: {DEFAULT_K_PERCENT:g}, without another wish",
)
ORIENTATION_DEG: Final = Option(
    "orientation_deg",
    Number(unit="deg", above=0),
    "half the 95 % interval of the orientation of K's ellipse",
    group=WISH,
)
MAX_TRIALS: Final = Option(
    "max_trials",
    Whole(low=8),
    "a wish that needs more is not met (default: {default})",
    1000,
    group=WISH,
)


def max_acceleration(group: str) -> Option:
    """Option for the limit of the commanded acceleration, under a title of the help."""
    return Option(
        "max_acceleration",
        Number(unit="m/s^2", above=0),
        "largest commanded acceleration (default: {default})",
        5.3,
        group=group,
    )
