"""What was imposed on the joint: told, recorded, or asked of the record; and I, B, K accordingly.

A command or a perturbation that was recorded, or a word on what the rig imposes, settles what the
instruments are made of. Where there is neither, the same record is fitted with its torque and with
its angle as the instrument: the subject's own torque, which stands in one of them, biases that one.

1. Results within one standard error of each other, the smaller, or within `SMALL`: it does not
   matter.
2. Else either is kept whose likelihood (see `likelihood`) is less than `NATS` below the best.
3. A device of finite impedance, which answers the limb, is kept beside it unless angle or torque
   alone are as likely within `ALIKE`.
4. What is reported holds the intervals of all that were kept.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from armimpedance.elbow.experiment.hull import hull, middle
from armimpedance.elbow.experiment.likelihood import Rig, RigFit, most_likely
from armimpedance.elbow.result import NAMES, UNITS
from armimpedance.elbow.stationary.band import Band, Source, band_of, source_of
from armimpedance.elbow.stationary.estimate import Estimate
from armimpedance.elbow.stationary.joint_fit import start_values
from armimpedance.elbow.stationary.method import Method
from armimpedance.elbow.stationary.preparation import Prepared
from armimpedance.elbow.stationary.side_by_side import with_comparisons
from armimpedance.elbow.stationary.weights import weighed_band
from armimpedance.errors import EstimationError, NotIdentifiableError
from armimpedance.findings import Finding
from armimpedance.regression import Parameters

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
_SAY: Final = (
    'say which in recording.json ("imposed": "position" or "torque") or with --imposed, or record '
    "the command"
)


@dataclass(frozen=True, eq=False)
class Answer:
    """I, B, K under what was imposed.

    Attributes
    ----------
    estimate : Estimate
    floors, band : Band
        Weighed by the sensors' noise alone, and as used.
    checks : tuple of Finding
        What was imposed, and how that is known.
    """

    estimate: Estimate
    floors: Band
    band: Band
    checks: tuple[Finding, ...] = ()


def answered(prepared: Prepared, method: Method) -> Answer:
    """I, B, K by a method, with the instrument that the experiment asks for.

    Parameters
    ----------
    prepared : Prepared
    method : Method

    Returns
    -------
    Answer

    Raises
    ------
    InputError, NotIdentifiableError, EstimationError
        As of the method; where the record is asked, neither of the two ways gives a joint.
    """
    source = source_of(prepared.source)
    if source is None:
        return _asked(prepared, method)
    told = _with(prepared, method, source)
    return replace(told, checks=(Finding(_NAME, "ok", _TOLD[source]),))


def _with(prepared: Prepared, method: Method, source: Source) -> Answer:
    floors = band_of(prepared, source)
    band = weighed_band(floors)
    estimate = method.identify(prepared, band)
    return Answer(with_comparisons(estimate, method, prepared, floors, band), floors, band)


def _asked(prepared: Prepared, method: Method) -> Answer:
    ways: dict[Rig, Answer] = {}
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
        return _whichever(ways)
    gives_way = prepared.source.imposed == "both"
    fits = _fits(band_of(prepared, "torque"))
    return _of_kept(ways, fits, _kept(fits, gives_way=gives_way))


def _alike(ways: dict[Rig, Answer]) -> bool:
    """Whether torque and angle as instruments give the same."""
    one, other = (ways[rig].estimate.parameters for rig in ("torque", "angle"))
    enough = np.maximum(np.minimum(one.sd, other.sd), SMALL * one.values)
    return bool((np.abs(one.values - other.values) <= enough).all())


def _whichever(ways: dict[Rig, Answer]) -> Answer:
    torque, angle = ways["torque"], ways["angle"].estimate.parameters
    own = torque.estimate.parameters
    largest = float(np.abs(angle.values / own.values - 1).max())
    message = (
        "not told; with torque or angle imposed I, B, K differ by "
        f"{100 * largest:.2g} % at most, which the intervals hold"
    )
    parameters = hull(own, [angle], own.values)
    return replace(
        torque,
        estimate=replace(torque.estimate, parameters=parameters, moved=None),
        checks=(Finding(_NAME, "ok", message, f"{100 * SMALL:g} %"),),
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


def _kept(fits: dict[Rig, RigFit], *, gives_way: bool) -> tuple[Rig, ...]:
    """The experiments that the record does not exclude, the likeliest first."""
    best = min(fit.nats for fit in fits.values())
    loss = {rig: fit.nats - best for rig, fit in fits.items()}
    kept: list[Rig] = [rig for rig in fits if rig != "both" and loss[rig] < NATS]
    if gives_way or min(loss["torque"], loss["angle"]) > ALIKE:
        kept.append("both")
    return tuple(sorted(kept, key=lambda rig: loss[rig]))


def _of_kept(ways: dict[Rig, Answer], fits: dict[Rig, RigFit], kept: tuple[Rig, ...]) -> Answer:
    nearest = min(ways, key=lambda rig: fits[rig].nats)
    base = ways[nearest]
    own = base.estimate.parameters
    several = [
        ways[rig].estimate.parameters if rig in ways else _parameters(fits[rig], own)
        for rig in kept
    ]
    check = _check(fits, kept, several)
    if len(kept) == 1 and kept[0] in ways:
        return replace(ways[kept[0]], checks=(check,))
    parameters = hull(own if nearest in kept else several[0], several, middle(several))
    estimate = replace(base.estimate, parameters=parameters, moved=None)
    return replace(base, estimate=estimate, checks=(check,))


def _parameters(fit: RigFit, like: Parameters) -> Parameters:
    return Parameters(NAMES, UNITS, fit.values, fit.covariance, "fisher", like.dof)


def _check(fits: dict[Rig, RigFit], kept: tuple[Rig, ...], several: list[Parameters]) -> Finding:
    best = min(fit.nats for fit in fits.values())
    if len(kept) == 1:
        second = min(fit.nats for rig, fit in fits.items() if rig != kept[0]) - best
        message = f"not told; the record says that {_WHICH[kept[0]]} ({second:.0f} nats)"
        return Finding(_NAME, "ok", message, f"{NATS:g} nats")
    stiffness = [
        f"K {p.interval()[2, 0]:.3g} to {p.interval()[2, 1]:.3g} if {_WHICH[rig]}"
        for rig, p in zip(kept, several, strict=True)
    ]
    message = (
        "not told, and the record does not say what the rig imposes: "
        f"{', '.join(stiffness)}; the interval holds all of these; {_SAY}"
    )
    return Finding(_NAME, "cannot tell", message, f"{NATS:g} nats")
