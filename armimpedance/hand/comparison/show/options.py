"""The options of a comparison of groups of trials."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from armimpedance.hand.show.options import BY, FORCE_BY
from armimpedance.hand.still import METHODS
from armimpedance.show.verbs.kinds import AnyWord, MethodName, Whole
from armimpedance.show.verbs.options import DESPITE, Option, Verb

COMPARE: Final = Verb(
    "compare",
    (
        replace(
            BY,
            help=f"{BY.help}; 'recording' keeps several recordings apart",
            doc=f'{BY.doc}. "recording" keeps several recordings apart, "subject" is the id of who '
            "was recorded",
        ),
        Option(
            "against",
            AnyWord("GROUP"),
            "compare all groups with this one only",
            doc="name of the group that comes first in every pair; without it all pairs are "
            "compared",
        ),
        Option(
            "subjects",
            AnyWord("COLUMN"),
            "the column that names the subjects; 'recording' or 'subject' (the id in "
            "recording.json) where each has a recording of their own",
            doc="the column that distinguishes subjects: the result is then the mean change over "
            'subjects. "recording" or "subject" where each has a recording of their own',
        ),
        Option(
            "method",
            MethodName(values=METHODS.names),
            f"estimator: {METHODS.listed()}",
            doc="estimator for disturbances that return; default: that of `estimate`",
        ),
        Option("seed", Whole(low=0), "seed of the permutations (default: {default})", 0),
        Option(
            "permutations",
            Whole(low=1, high=10**6),
            "of each pair (default: 1999, more with many pairs, none with more than 200)",
            doc="exchanges of trials for each pair; default: 1999, more with many pairs, none with "
            "more than 200, which are tested from the covariances",
        ),
        FORCE_BY,
        DESPITE,
    ),
)
