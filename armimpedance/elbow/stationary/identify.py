"""The verb of this room: I, B and K of one joint from torque and angle."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.elbow.checks import check_samples
from armimpedance.elbow.result import NAMES, UNITS, ChannelSnr, ElbowFit
from armimpedance.elbow.samples import COMMANDED, JointSamples
from armimpedance.elbow.snr import channel_snr
from armimpedance.elbow.stationary.band import Band, band_of, explained
from armimpedance.elbow.stationary.estimate import Estimate
from armimpedance.elbow.stationary.feedback import delayed_feedback, feedback_warning
from armimpedance.elbow.stationary.instruments import weighed_band
from armimpedance.elbow.stationary.methods import DEFAULT, Method, method_named
from armimpedance.elbow.stationary.orders import compare_orders, order_warning
from armimpedance.elbow.stationary.preparation import Cutoff, Decimation, Prepared, prepare
from armimpedance.elbow.stationary.side_by_side import with_comparisons
from armimpedance.elbow.stationary.whiteness import residual_whiteness, whiteness_warning
from armimpedance.errors import InputError
from armimpedance.regression import FitSummary, NamedParameter, t_factor

#: The SNR of a record of some seconds is read off to about this (dB).
SNR_SLACK_DB: Final = 0.5
#: An interval whose half-width is above this part of the value says little.
WIDE: Final = 0.5


def identify_elbow(
    samples: JointSamples,
    *,
    method: str = DEFAULT,
    cutoff_hz: Cutoff = "auto",
    decimation: Decimation = "auto",
    lowest_hz: float | None = None,
) -> ElbowFit:
    """Inertia, viscosity and stiffness about an operating point (3), all trials together.

    Parameters
    ----------
    samples : JointSamples
        As recorded.
    method : str
        One of `methods.METHODS`.
    cutoff_hz, decimation
        See `preparation.prepare`. Only `arx` filters and decimates: for the others the cut-off
        ends the band.
    lowest_hz : float, optional
        The band begins here, all of it by default; not for `arx`.

    Raises
    ------
    InputError
        Unknown method; a record that is too short, constant, stuck or clipped; signal to noise
        below the method's limit; ARX on raw samples whose noise would decide the outcome.
    NotIdentifiableError
        The motion does not tell I, B and K apart.
    EstimationError
        What was fitted is no joint, or a search does not settle.
    """
    chosen = method_named(method)
    if lowest_hz is not None and chosen.name == "arx":
        raise InputError(
            "a lowest frequency with method arx",
            expected="method iv, output-error or derivative, or no lowest frequency",
        )
    check_samples(samples)
    snr = channel_snr(samples)
    refuse_low_snr(snr, chosen)
    prepared = prepare(samples, cutoff_hz, decimation, lowest_hz)
    floors = band_of(prepared)
    band = weighed_band(prepared, floors)
    estimate = chosen.identify(prepared, band)
    estimate = with_comparisons(estimate, chosen, prepared, floors, band)
    r2 = explained(band, estimate.values)
    white = residual_whiteness(floors, estimate.values)
    scores = compare_orders(band, prepared.sample_rate_hz)
    late = delayed_feedback(band, estimate.values)
    independent = chosen.name in ("iv", "derivative") and samples.perturbation is not None
    of_the_model = (
        whiteness_warning(white, 1 - r2, independent=independent),
        order_warning(scores, 1 - r2),
        feedback_warning(late, 1 - r2),
    )
    summary = FitSummary(
        method=chosen.name,
        n=estimate.n,
        cond_raw=estimate.conditioning.cond_raw,
        cond_scaled=estimate.conditioning.cond_scaled,
        rank=estimate.conditioning.rank,
        r2=r2,
        vaf=r2,
        parameters=_parameters(estimate, samples.joint),
        warnings=_warnings(samples, estimate, of_the_model),
    )
    return ElbowFit(
        summary=summary,
        covariance=estimate.covariance,
        snr=snr,
        whiteness=white,
        preparation=(*samples.notes, *_notes(chosen, prepared, band, coloured=band is not floors)),
        details={
            **estimate.details,
            "orders": scores,
            "feedback": late,
            "band_hz": prepared.band_hz,
        },
    )


def refuse_low_snr(snr: ChannelSnr, method: Method) -> None:
    """Refuse a channel below the method's limit.

    Raises
    ------
    InputError
        Which channel, how many dB, what the limit is and what would help.
    """
    for name, found in (("torque", snr.torque_db), ("angle", snr.angle_db)):
        if found is None or found >= method.lowest_snr_db - SNR_SLACK_DB:
            continue
        if not np.isfinite(found):
            raise InputError(
                f"the {name} holds noise alone", expected="a joint that is perturbed and moves"
            )
        helps = "a stronger perturbation"
        if method.lowest_snr_db > 5 and found >= 5 - SNR_SLACK_DB:
            helps = f"method iv or output-error, or {helps}"
        raise InputError(
            f"signal to noise of the {name} is {found:.1f} dB, below what method {method.name} "
            f"needs",
            expected=f"{method.lowest_snr_db:g} dB or more; {helps} would help",
        )


def _parameters(estimate: Estimate, joint: int) -> tuple[NamedParameter, ...]:
    return tuple(
        NamedParameter(
            name=name,
            value=float(estimate.values[j]),
            sd=float(np.sqrt(estimate.classical[j, j])),
            sd_robust=float(np.sqrt(estimate.covariance[j, j])),
            unit=unit,
            dof=estimate.dof,
            joint=joint,
        )
        for j, (name, unit) in enumerate(zip(NAMES, UNITS, strict=True))
    )


def _warnings(
    samples: JointSamples,
    estimate: Estimate,
    of_the_model: tuple[str | None, ...],
) -> tuple[str, ...]:
    told = list(of_the_model)
    if samples.torque_is == "commanded":
        told.append(COMMANDED)
    half = t_factor(estimate.dof) * np.sqrt(np.diag(estimate.covariance)) / estimate.values
    wide = [f"{n} +-{100 * h:.0f} %" for n, h in zip(NAMES, half, strict=True) if h > WIDE]
    if wide:
        told.append(f"hardly told by this record: {', '.join(wide)}")
    return (*estimate.warnings, *(t for t in told if t is not None))


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
    if method.name == "output-error":
        return tuple(notes)
    if prepared.perturbation is None:
        notes.append(
            "instruments from the measured torque: what the subject adds to it in answer to the "
            "motion stays in"
        )
    else:
        notes.append("instruments from the device's perturbation")
    return tuple(notes)
