"""The options of a still hand's impedance and of its reflex."""

from __future__ import annotations

from typing import Final

from armimpedance.hand.show.options import BY, FORCE_BY
from armimpedance.hand.still.methods import METHODS
from armimpedance.show.verbs.kinds import MethodName, Number, NumberPair, OneOf, Whole
from armimpedance.show.verbs.options import DESPITE, Option, Verb

#: The name for every method, side by side.
ALL: Final = "all"

COVARIANCE: Final = Option(
    "covariance",
    OneOf(values=("cr3", "replicates", "cr1", "bootstrap"), offered=("cr3", "bootstrap")),
    "clustered by trial: cr3 = jackknife (default), bootstrap = trials drawn with replacement",
    "cr3",
    doc="how intervals follow from the spread between trials: jackknife, within each "
    "direction, sandwich, or trials drawn with replacement",
)

ESTIMATE: Final = Verb(
    "estimate",
    (
        BY,
        Option(
            "method",
            MethodName(values=(*METHODS.names, ALL)),
            f"{METHODS.listed()}; or all, side by side",
            doc='an estimator for disturbances that return, such as "weighted" (the default), '
            '"exact" or "paper"; "all" gives the estimates of every method that can run (see '
            "`estimate_all`)",
        ),
        COVARIANCE,
        Option("seed", Whole(low=0), "seed of the bootstrap (default: {default})", 0),
        Option(
            "workers",
            Whole(low=1),
            "processes; same result (default: {default})",
            1,
            doc="number of processes; the result is the same to the bit",
        ),
        Option(
            "band_hz",
            NumberPair(unit="Hz"),
            "fitted band in Hz, for stochastic perturbations only (default: 5 45)",
            flag="--band",
            doc="fitted band of a stochastic perturbation; default: 5 to 45",
        ),
        FORCE_BY,
        DESPITE,
    ),
)

REFLEX: Final = Verb(
    "reflex",
    (
        BY,
        Option(
            "delay_ms",
            Number(unit="ms"),
            "delay of the reflex, for example from EMG",
            doc="delay of the reflex, for example from EMG; default: delays from "
            "30 to 120 ms are scanned",
        ),
        Option("seed", Whole(low=0), "seed of the random signs behind p (default: {default})", 0),
        FORCE_BY,
        DESPITE,
    ),
)
