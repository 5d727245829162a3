"""How far an estimate can be trusted: residuals, other models, what the record hardly tells."""

from __future__ import annotations

from typing import Final

from armimpedance.core.findings import warnings_of
from armimpedance.joint.elbow.doubts.doubt import doubt
from armimpedance.joint.elbow.result import NAMES, ElbowFit
from armimpedance.joint.elbow.samples import COMMANDED
from armimpedance.joint.elbow.stationary.band import Band, Source
from armimpedance.joint.elbow.stationary.estimate import Estimate
from armimpedance.joint.elbow.stationary.method import Method
from armimpedance.joint.elbow.stationary.misfit import explained
from armimpedance.joint.elbow.stationary.orders import compare_orders
from armimpedance.joint.elbow.stationary.preparation import Prepared
from armimpedance.joint.elbow.stationary.whiteness import residual_whiteness
from armimpedance.numerics.regression import Parameters, t_factor

#: What instruments are made of, in words.
_SOURCES: Final[dict[Source, str]] = {
    "perturbation": "the device's perturbation",
    "command": "the commanded angle, through what each frequency's neighbours answer to it",
    "torque": "the measured torque: what the subject adds to it in answer to the motion stays in",
    "angle": "the measured angle: the subject's own torque is noise of the torque",
}
#: An interval whose half-width is above this part of the value says little.
WIDE: Final = 0.5


def diagnosed(
    estimate: Estimate, method: Method, prepared: Prepared, floors: Band, band: Band
) -> ElbowFit:
    """The estimate with all that tells how far it can be trusted.

    Parameters
    ----------
    estimate : Estimate
        Made by `method` with the weights of `band`.
    method : Method
    prepared : Prepared
    floors, band : Band
        Weighed by the sensors' noise alone, and as used.
    """
    samples, values = prepared.source, estimate.parameters.values
    r2 = explained(band, values)
    weighed = band is not floors
    white, coloured = residual_whiteness(floors, values, 1 - r2, weighed=weighed)
    scores, order = compare_orders(band, prepared.sample_rate_hz, 1 - r2)
    doubts = doubt(estimate, prepared, band)
    # What a doubt has named is not told once more without its name.
    unnamed = () if doubts.seen else (*estimate.warnings, coloured)
    checks = doubts.checks if doubts.seen else (*doubts.checks, order)
    commanded = COMMANDED if samples.torque_is == "commanded" else None
    told = (*warnings_of(checks), *unnamed, commanded, _hardly_told(doubts.parameters))
    notes = _notes(method, prepared, band, coloured=band is not floors)
    return ElbowFit(
        method=method.name,
        parameters=doubts.parameters,
        n=estimate.n,
        cond_raw=estimate.conditioning.cond_raw,
        cond_scaled=estimate.conditioning.cond_scaled,
        rank=estimate.conditioning.rank,
        r2=r2,
        snr=prepared.spectra.snr,
        whiteness=white,
        joint=samples.joint,
        preparation=(*samples.notes, *notes, *estimate.notes),
        warnings=tuple(t for t in told if t is not None),
        checks=checks,
        details={
            **estimate.details,
            "orders": scores,
            **doubts.details,
            "band_hz": prepared.band_hz,
        },
    )


def _hardly_told(parameters: Parameters) -> str | None:
    half = t_factor(parameters.dof) * parameters.sd / parameters.values
    wide = [f"{n} +-{100 * h:.0f} %" for n, h in zip(NAMES, half, strict=True) if h > WIDE]
    return f"hardly told by this record: {', '.join(wide)}" if wide else None


def _notes(method: Method, prepared: Prepared, band: Band, *, coloured: bool) -> tuple[str, ...]:
    if method.name == "arx":
        return prepared.notes
    count = sum(len(b.s) for b in band.trials)
    lowest = min(float(b.frequency_hz[0]) for b in band.trials)
    notes = [
        "offset and slope taken off each trial",
        f"{count} frequencies, {lowest:.3g} to {prepared.band_hz:.3g} Hz, of all samples, neither "
        f"filtered nor decimated: {prepared.band_why}",
    ]
    if coloured:
        notes.append(
            "weighed by the residual torque's spectrum: more than the sensors' noise is in it"
        )
    if method.name != "output-error":
        notes.append(f"instruments from {_SOURCES[band.source]}")
    return tuple(notes)
