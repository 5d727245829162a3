"""The options of the map from the hand to the joints, and on to the muscles."""

from __future__ import annotations

from typing import Final

from armimpedance.show.verbs.kinds import Number, OneOf, Switch
from armimpedance.show.verbs.options import Option, Verb

_FORCE_TERM: Final = Option(
    "force_term",
    Switch(to=False),
    "leave Gamma(F) out, as the source does",
    True,
    flag="--no-force-term",
    doc="False leaves Gamma out, what the mean hand force adds, as the source does",
)

TO_JOINT: Final = Verb(
    "to_joint",
    (
        _FORCE_TERM,
        Option(
            "elbow",
            OneOf(values=("held", "free")),
            "in three axes: whether the upper arm was kept from turning about its own axis "
            "(default: the recording's column `elbow`, else free)",
        ),
        Option(
            "swivel_deg",
            Number(unit="deg"),
            "in three axes, where joint angles were not measured: the elbow's turn about the line "
            "from shoulder to hand, 0 with the elbow lowest, positive where it moves to the right",
        ),
    ),
)

TO_MUSCLE: Final = Verb(
    "to_muscle",
    (
        _FORCE_TERM,
        Option(
            "curvature",
            Switch(to=False),
            "leave the term of the tensions' curvature out, as the source does (to muscle)",
            True,
            flag="--no-curvature",
            doc="False leaves the term of the tensions out, as the source does",
        ),
        Option(
            "share",
            OneOf(values=("effort", "emg")),
            "tensions of least effort (default), or nearest to the measured activation (to muscle)",
            "effort",
        ),
    ),
)
