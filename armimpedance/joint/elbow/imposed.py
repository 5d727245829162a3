"""Decide what was imposed on the joint (stated, recorded, or inferred), and give I, B, K.

A recorded command or perturbation, or a statement of what the rig imposes, determines the
instruments. Without these the record is fitted twice, with its torque and with its angle as the
instrument. The subject's own torque is part of one of them, and biases that fit.

1. If the results differ by less than the smaller standard error, or by less than `SMALL`, the
   question does not matter.
2. Otherwise an experiment is kept if its likelihood (see `limb_and_device`) is less than `NATS`
   below the best; to `NATS` is added the misfit of a limb of second order.
3. A device of finite impedance, whose motion depends on the limb, is kept as well unless an imposed
   angle or torque is as likely within `ALIKE`.
4. The reported interval covers the intervals of all that were kept.

A statement without a recorded command is tested by the same likelihoods. It is reported as
contradicted if the other limit is likelier by `NATS`, or a device of finite impedance by half as
much more. From half of `NATS` on the interval covers the likelier experiment too.
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

# One interval that covers several, where a record does not choose among them.


def hull(own: Parameters, others: Sequence[Parameters], centre: FloatArray) -> Parameters:
    """Parameters at `centre` whose 95 % intervals cover those of `own` and of the others.

    `centre` (p,).
    `own`: the result has its correlations and degrees of freedom.
    """
    limits = np.array([p.interval() for p in (own, *others)])
    low, high = limits[..., 0].min(axis=0), limits[..., 1].max(axis=0)
    half = np.maximum(centre - low, high - centre)
    scale = half / (t_factor(own.dof) * own.sd)
    # C' (p, p) = diag(scale) C diag(scale)
    covariance = own.covariance * np.outer(scale, scale)
    return replace(own, values=centre, covariance=covariance)


def middle(several: Sequence[Parameters]) -> FloatArray:
    """Middle (p,) of the interval that covers all of theirs, limited to the range of their
    values."""
    limits = np.array([p.interval() for p in several])
    values = np.array([p.values for p in several])
    centre = (limits[..., 0].min(axis=0) + limits[..., 1].max(axis=0)) / 2
    return np.clip(centre, values.min(axis=0), values.max(axis=0))


def shifted(result: Parameters, made_from: Parameters, instead: Parameters) -> Parameters:
    """Move a result from one estimate to another: add the difference, and widen if necessary.

    `result`: was made from `made_from`; it is returned as if it had been made from `instead`.
    """
    scale = np.maximum(instead.sd / made_from.sd, 1.0)
    # C' (p, p) = diag(scale) C diag(scale)
    return replace(
        result,
        values=result.values + instead.values - made_from.values,
        covariance=result.covariance * np.outer(scale, scale),
    )


#: Results that differ by less than this share count as equal, however small their errors.
SMALL: Final = 0.01
#: An experiment that is less likely than the best by this is excluded, nats.
NATS: Final = 12.0
#: If a limit is this near to the best, no device of finite impedance is needed, nats.
ALIKE: Final = 1.0
#: Start values of a device of finite impedance, as multiples of the limb's I, B, K.
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

    `alone`: the method's own result, before the comparison with other methods.
    `floors`, `band`: the band weighted by the sensors' noise only, and as used in the fit.
    """

    estimate: Estimate
    alone: Parameters
    floors: Band
    band: Band


@dataclass(frozen=True, eq=False)
class Answer:
    """Result of the question what was imposed, with the I, B, K that follow.

    `ways`: fits with one instrument each: a single one, or all that the record does not exclude,
    the likeliest first.
    `kept`: what may have been imposed: the ways' instruments, then "both"; empty if it was stated,
    recorded, or does not matter.
    `other`: a further result that the interval must cover: of a device of finite impedance, if that
    is kept; of the angle as instrument, if the choice does not matter; or of a likelier experiment
    than the stated one, if the difference is not significant.
    `nats`: limit by which the best must be more likely than the others.
    `lead`: by how much it is more likely than the next, or than a statement that is contradicted.
    `otherwise`: K with the other instrument, if an instrument was stated and the two differ.
    """

    ways: tuple[Way, ...]
    kept: tuple[Rig, ...] = ()
    other: Parameters | None = None
    nats: float = 0.0
    lead: float = 0.0
    otherwise: float | None = None

    @property
    def gives_way(self) -> bool:
        """True if only a device of finite impedance is kept; then no way has the right
        instrument."""
        return self.kept == ("both",)

    def parameters(self, final: Sequence[Parameters]) -> Parameters:
        """I, B, K that cover all that was kept.

        `final`: the final parameters of each way.
        """
        if not self.kept:
            if self.other is None:
                return final[0]
            # The other result, moved as the first one was moved by the later checks.
            beside = shifted(final[0], self.ways[0].estimate.parameters, self.other)
            return hull(final[0], [beside], final[0].values)
        several = self._several(final)
        return several[0] if len(several) == 1 else hull(several[0], several[1:], middle(several))

    def finding(self, final: Sequence[Parameters]) -> Finding:
        """Finding on what was imposed, and on the evidence; `final` as in `parameters`."""
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
        limits = [p.interval()[2] for p in self._several(final)]
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

    def _several(self, final: Sequence[Parameters]) -> list[Parameters]:
        """Parameters of every experiment that was kept."""
        own = [] if self.gives_way else list(final)
        return own if self.other is None else [*own, self.other]


def answered(prepared: PreparedSamples, method: ElbowMethod) -> Answer:
    """Estimate I, B, K by a method, with the instrument that suits the experiment.

    Raises InputError, NotIdentifiableError, EstimationError: like the method; if the instrument is
    not known, only when both instruments fail.
    """
    source = source_of(prepared.source)
    if source is None:
        return _asked(prepared, method)
    way = _with(prepared, method, source)
    if source in ("perturbation", "command"):
        return Answer((way,))
    return _held_against(way, prepared, method)


def _held_against(way: Way, prepared: PreparedSamples, method: ElbowMethod) -> Answer:
    """Test a stated instrument against the record."""
    own: Rig = "torque" if way.band.source == "torque" else "angle"
    other: Literal["torque", "angle"] = "angle" if own == "torque" else "torque"
    try:
        ways = {own: way, other: _with(prepared, method, other)}
    except (EstimationError, NotIdentifiableError):
        return Answer((way,))
    if _alike(ways):
        return Answer((way,))
    odds = _odds(ways["torque"].floors)
    loss, otherwise = odds.loss, float(ways[other].alone.values[2])
    # against the other limit, and against a device of finite impedance, which explains more
    sure = (loss[own] - loss[other] - odds.enough, loss[own] - odds.enough - NATS / 2)
    if max(sure) > 0:
        lead = max(loss[own], loss[own] - loss[other])
        return Answer((way,), nats=odds.enough, lead=lead, otherwise=otherwise)
    if loss[own] < NATS / 2:
        return Answer((way,), nats=odds.enough, otherwise=otherwise)
    limb = ways[other].alone
    if loss["both"] < loss[other]:
        limb = _parameters(odds.gives_way, way.alone.dof)
    return Answer((way,), other=limb, nats=odds.enough, lead=loss[own], otherwise=otherwise)


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
    """Return True if torque and angle as instruments give the same I, B, K."""
    with_torque, with_angle = (ways[rig].alone for rig in ("torque", "angle"))
    enough = np.maximum(np.minimum(with_torque.sd, with_angle.sd), SMALL * with_torque.values)
    return bool((np.abs(with_torque.values - with_angle.values) <= enough).all())


@dataclass(frozen=True, eq=False)
class _Odds:
    """Likelihood of each experiment relative to the best.

    `loss`: nats below the best. `enough`: loss from which an experiment is excluded. `gives_way`:
    fit of a device of finite impedance.
    """

    loss: dict[Rig, float]
    enough: float
    gives_way: RigFit


def _odds(floors: Band) -> _Odds:
    """Compare the three experiments; `floors`: with the torque as the instrument."""
    fits = _fits(floors)
    best = min(fit.nats for fit in fits.values())
    loss = {rig: fit.nats - best for rig, fit in fits.items()}
    return _Odds(loss, NATS + departure(floors, fits), fits["both"])


def _likely(prepared: PreparedSamples, ways: dict[Rig, Way]) -> Answer:
    """Keep the experiments that the likelihood does not exclude; those whose fit failed are left
    out.
    """
    torque = ways.get("torque")
    odds = _odds(band_of(prepared, "torque") if torque is None else torque.floors)
    loss, enough = odds.loss, odds.enough
    ordered = sorted(ways, key=lambda rig: loss[rig])
    kept: list[Rig] = [rig for rig in ordered if loss[rig] < enough]
    only_device = not kept or prepared.source.imposed == "both"
    if only_device or min(loss["torque"], loss["angle"]) > ALIKE:
        kept.append("both")
    reference = ways[ordered[0]].alone
    return Answer(
        tuple(ways[rig] for rig in kept if rig != "both") or (ways[ordered[0]],),
        tuple(kept),
        _parameters(odds.gives_way, reference.dof) if "both" in kept else None,
        enough,
        sorted(loss.values())[1],
    )


def _fits(floors: Band) -> dict[Rig, RigFit]:
    """Most likely fit of each experiment."""
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
