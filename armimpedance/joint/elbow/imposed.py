"""What was imposed on the joint: told, recorded, or asked of the record; and I, B, K accordingly.

A command or a perturbation that was recorded, or a word on what the rig imposes, settles what the
instruments are made of. Where there is neither, the same record is fitted with its torque and with
its angle as the instrument: the subject's own torque, which stands in one of them, biases that one.

1. Results within one standard error of each other, the smaller, or within `SMALL`: it does not
   matter.
2. Else either is kept whose likelihood (see `likelihood`) is less than `NATS` below the best, and
   by as much more as the record departs from a limb of second order.
3. A device of finite impedance, which answers the limb, is kept beside it unless angle or torque
   alone are as likely within `ALIKE`.
4. What is reported holds the intervals of all that were kept.

What was told without a record of a command is held against the same likelihoods: a word that the
record contradicts is named, by `NATS` where the other limit is likelier, by half as much more where
a device that gives way is; from half of `NATS` on the interval holds what is likelier too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError, NotIdentifiableError
from armimpedance.core.findings import Finding
from armimpedance.joint.elbow.elbow_result import NAMES, UNITS
from armimpedance.joint.elbow.limb_and_device import Rig, RigFit, departure, most_likely
from armimpedance.joint.elbow.stationary.band import Band, Source, band_of, source_of
from armimpedance.joint.elbow.stationary.estimate import Estimate
from armimpedance.joint.elbow.stationary.instruments import start_values
from armimpedance.joint.elbow.stationary.methods import ElbowMethod
from armimpedance.joint.elbow.stationary.preparation import PreparedSamples
from armimpedance.joint.elbow.stationary.side_by_side import with_comparisons
from armimpedance.joint.elbow.stationary.weights import weighed_band
from armimpedance.numerics.regression import Parameters, t_factor

# The interval that holds several intervals, where a record does not choose among them.


def hull(own: Parameters, others: Sequence[Parameters], centre: FloatArray) -> Parameters:
    """Parameters at `centre` whose 95 % intervals hold those of `own` and of the others.

    `centre` (p,).
    `own`: its correlations and degrees of freedom are kept.
    """
    limits = np.array([p.interval() for p in (own, *others)])
    low, high = limits[..., 0].min(axis=0), limits[..., 1].max(axis=0)
    half = np.maximum(centre - low, high - centre)
    scale = half / (t_factor(own.dof) * own.sd)
    # C' (p, p) = diag(scale) C diag(scale)
    covariance = own.covariance * np.outer(scale, scale)
    return replace(own, values=centre, covariance=covariance)


def middle(several: Sequence[Parameters]) -> FloatArray:
    """The middle (p,) of the interval that holds all of theirs, no farther than their values."""
    limits = np.array([p.interval() for p in several])
    values = np.array([p.values for p in several])
    centre = (limits[..., 0].min(axis=0) + limits[..., 1].max(axis=0)) / 2
    return np.clip(centre, values.min(axis=0), values.max(axis=0))


def shifted(found: Parameters, one: Parameters, other: Parameters) -> Parameters:
    """What `found`, which was made of `one`, would be had it been made of `other`."""
    scale = np.maximum(other.sd / one.sd, 1.0)
    # C' (p, p) = diag(scale) C diag(scale)
    return replace(
        found,
        values=found.values + other.values - one.values,
        covariance=found.covariance * np.outer(scale, scale),
    )


#: Results that differ by less than this part of themselves are alike, however sure.
SMALL: Final = 0.01
#: An experiment this much less likely than the best is given up, nats.
NATS: Final = 12.0
#: One this near to the best needs no device of finite impedance, nats.
ALIKE: Final = 1.0
#: A device of finite impedance starts at these multiples of the limb's own.
_DEVICES: Final = (0.3, 3.0)
_NAME: Final = "imposed"
_WHICH: Final[dict[Rig, str]] = {
    "torque": "the torque is imposed",
    "angle": "the angle is imposed",
    "both": "the device gives way like a limb",
}
_TOLD: Final[dict[Source, str]] = {
    "perturbation": "the recorded perturbation is the instrument, whatever the device",
    "command": "the recorded command is the instrument, whatever the device",
    "torque": "the torque, as told: it is the instrument, the subject's own torque moves the joint",
    "angle": "the angle, as told: it is the instrument, the subject's own torque is noise of the "
    "torque",
}
_RECORD: Final = "record the command or the torque that it is told to add"
_SAY: Final = (
    'say which in recording.json ("imposed": "position" or "torque") or with --imposed, or record '
    "the command"
)


@dataclass(frozen=True, eq=False)
class Way:
    """I, B, K with one instrument.

    `alone`: of the method by itself, before it was compared with other ways.
    `floors`, `band`: weighed by the sensors' noise alone, and as used.
    """

    estimate: Estimate
    alone: Parameters
    floors: Band
    band: Band


@dataclass(frozen=True, eq=False)
class Answer:
    """What was imposed, and I, B, K accordingly.

    `ways`: one, or those among which the record does not choose, the likeliest first.
    `kept`: what may have been imposed: the ways' instruments, then "both"; empty where it was told,
    recorded, or does not matter.
    `other`: of a device of finite impedance, where it is kept; else of the angle as instrument,
    where that does not matter; where something was told, of what is likelier, but not surely.
    `nats`: by how much more likely the best must be.
    `lead`: by how much more likely it is than the next; where something was told that the record
    contradicts, than that.
    `otherwise`: K with the other instrument, where something was told and this is not alike.
    """

    ways: tuple[Way, ...]
    kept: tuple[Rig, ...] = ()
    other: Parameters | None = None
    nats: float = 0.0
    lead: float = 0.0
    otherwise: float | None = None

    @property
    def gives_way(self) -> bool:
        """Whether a device of finite impedance alone is kept: no way is its own."""
        return self.kept == ("both",)

    def parameters(self, found: Sequence[Parameters]) -> Parameters:
        """I, B, K over all that was kept.

        `found`: one of each way, after all that is known of it.
        """
        if not self.kept:
            if self.other is None:
                return found[0]
            # The other result beside what the first became.
            beside = shifted(found[0], self.ways[0].estimate.parameters, self.other)
            return hull(found[0], [beside], found[0].values)
        several = self._several(found)
        return several[0] if len(several) == 1 else hull(several[0], several[1:], middle(several))

    def finding(self, found: Sequence[Parameters]) -> Finding:
        """What was imposed, and how that is known; `found` as of `parameters`."""
        if self.otherwise is not None or (not self.kept and self.other is None):
            return self._told()
        if not self.kept and self.other is not None:
            off = np.abs(self.other.values / self.ways[0].estimate.parameters.values - 1).max()
            message = (
                "not told; with torque or angle imposed I, B, K differ by "
                f"{100 * off:.2g} % at most, which the intervals hold"
            )
            return Finding(_NAME, "ok", message, f"{100 * SMALL:g} %")
        if len(self.kept) == 1:
            message = (
                f"not told; the record says that {_WHICH[self.kept[0]]} ({self.lead:.0f} nats)"
            )
            if self.gives_way:
                message += f": I, B, K rest on a model of it; {_RECORD}"
                return Finding(_NAME, "warning", message, f"{self.nats:.0f} nats")
            return Finding(_NAME, "ok", message, f"{self.nats:.0f} nats")
        limits = [p.interval()[2] for p in self._several(found)]
        stiffness = [
            f"K {low:.3g} to {high:.3g} if {_WHICH[rig]}"
            for rig, (low, high) in zip(self.kept, limits, strict=True)
        ]
        why = "" if self.nats < 2 * NATS else ", whose limb departs from I, B and K,"
        message = (
            f"not told, and the record{why} does not say what the rig imposes: "
            f"{', '.join(stiffness)}; the interval holds all of these; {_SAY}"
        )
        return Finding(_NAME, "cannot tell", message, f"{self.nats:.0f} nats")

    def _told(self) -> Finding:
        source = self.ways[0].band.source
        were = "" if self.otherwise is None else f"; were it not, K would be {self.otherwise:.3g}"
        if self.lead == 0:
            return Finding(_NAME, "ok", _TOLD[source] + were)
        if self.other is not None:
            message = (
                f"the {source} is said to be imposed, and the record is {self.lead:.0f} nats "
                f"likelier otherwise{were}: too little to contradict; the interval holds both"
            )
            return Finding(_NAME, "cannot tell", message, f"{self.nats:.0f} nats")
        message = (
            f"the {source} is said to be imposed, but the record is {self.lead:.0f} nats likelier "
            f"otherwise{were}: is that what the rig imposes? fit it untold, or record the command"
        )
        return Finding(_NAME, "warning", message, f"{self.nats:.0f} nats")

    def _several(self, found: Sequence[Parameters]) -> list[Parameters]:
        """Of each that was kept."""
        own = [] if self.gives_way else list(found)
        return own if self.other is None else [*own, self.other]


def answered(prepared: PreparedSamples, method: ElbowMethod) -> Answer:
    """I, B, K by a method, with the instrument that the experiment asks for.

    Raises InputError, NotIdentifiableError, EstimationError: as of the method; where the record is
    asked, neither of the two ways gives a joint.
    """
    source = source_of(prepared.source)
    if source is None:
        return _asked(prepared, method)
    told = _with(prepared, method, source)
    if source in ("perturbation", "command"):
        return Answer((told,))
    return _held_against(told, prepared, method)


def _held_against(told: Way, prepared: PreparedSamples, method: ElbowMethod) -> Answer:
    """What was told, and whether the record contradicts it."""
    own: Rig = "torque" if told.band.source == "torque" else "angle"
    other: Literal["torque", "angle"] = "angle" if own == "torque" else "torque"
    try:
        ways = {own: told, other: _with(prepared, method, other)}
    except (EstimationError, NotIdentifiableError):
        return Answer((told,))
    if _alike(ways):
        return Answer((told,))
    odds = _odds(ways["torque"].floors)
    loss, otherwise = odds.loss, float(ways[other].alone.values[2])
    # held against the other limit alone, or against a device that gives way, which explains more
    sure = (loss[own] - loss[other] - odds.enough, loss[own] - odds.enough - NATS / 2)
    if max(sure) > 0:
        lead = max(loss[own], loss[own] - loss[other])
        return Answer((told,), nats=odds.enough, lead=lead, otherwise=otherwise)
    if loss[own] < NATS / 2:
        return Answer((told,), nats=odds.enough, otherwise=otherwise)
    limb = ways[other].alone
    if loss["both"] < loss[other]:
        limb = _parameters(odds.gives_way, told.alone.dof)
    return Answer((told,), other=limb, nats=odds.enough, lead=loss[own], otherwise=otherwise)


def _with(prepared: PreparedSamples, method: ElbowMethod, source: Source) -> Way:
    floors = band_of(prepared, source)
    band = weighed_band(floors)
    estimate = method.identify(prepared, band)
    compared = with_comparisons(estimate, method, prepared, floors, band)
    return Way(compared, estimate.parameters, floors, band)


def _asked(prepared: PreparedSamples, method: ElbowMethod) -> Answer:
    ways: dict[Rig, Way] = {}
    failure: Exception | None = None
    limits: tuple[Literal["torque", "angle"], ...] = ("torque", "angle")
    for limit in limits:
        try:
            ways[limit] = _with(prepared, method, limit)
        except (EstimationError, NotIdentifiableError) as error:
            failure = failure or error
    if failure is not None and not ways:
        raise failure
    if len(ways) == 2 and _alike(ways):
        return Answer((ways["torque"],), other=ways["angle"].estimate.parameters)
    return _likely(prepared, ways)


def _alike(ways: dict[Rig, Way]) -> bool:
    """Whether torque and angle as instruments give the same."""
    one, other = (ways[rig].alone for rig in ("torque", "angle"))
    enough = np.maximum(np.minimum(one.sd, other.sd), SMALL * one.values)
    return bool((np.abs(one.values - other.values) <= enough).all())


@dataclass(frozen=True, eq=False)
class _Odds:
    """How much less likely than the best each experiment is, and how much says something, nats."""

    loss: dict[Rig, float]
    enough: float
    gives_way: RigFit


def _odds(floors: Band) -> _Odds:
    """`floors`: with the torque as the instrument."""
    fits = _fits(floors)
    best = min(fit.nats for fit in fits.values())
    loss = {rig: fit.nats - best for rig, fit in fits.items()}
    return _Odds(loss, NATS + departure(floors, fits), fits["both"])


def _likely(prepared: PreparedSamples, ways: dict[Rig, Way]) -> Answer:
    """What the likelihood keeps; a limit that gave no joint is none."""
    torque = ways.get("torque")
    odds = _odds(band_of(prepared, "torque") if torque is None else torque.floors)
    loss, enough = odds.loss, odds.enough
    ordered = sorted(ways, key=lambda rig: loss[rig])
    kept: list[Rig] = [rig for rig in ordered if loss[rig] < enough]
    alone = not kept or prepared.source.imposed == "both"
    if alone or min(loss["torque"], loss["angle"]) > ALIKE:
        kept.append("both")
    like = ways[ordered[0]].alone
    return Answer(
        tuple(ways[rig] for rig in kept if rig != "both") or (ways[ordered[0]],),
        tuple(kept),
        _parameters(odds.gives_way, like.dof) if "both" in kept else None,
        enough,
        sorted(loss.values())[1],
    )


def _fits(floors: Band) -> dict[Rig, RigFit]:
    """Each experiment at its most likely."""
    start = start_values(floors)
    fits: dict[Rig, RigFit] = {
        "torque": most_likely(floors, "torque", start),
        "angle": most_likely(floors, "angle", start),
    }
    limbs = [fits["torque"].values, fits["angle"].values]
    devices = [
        np.concatenate([limb, times * limb]) for limb, times in zip(limbs, _DEVICES, strict=True)
    ]
    return {**fits, "both": most_likely(floors, "both", *devices)}


def _parameters(fit: RigFit, dof: float) -> Parameters:
    return Parameters(NAMES, UNITS, fit.values, fit.covariance, "fisher", dof)
