"""Identify I, B and K of one joint from torque and angle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding, warnings_of
from armimpedance.joint.elbow.checks import check_samples, check_snr, spectra_of
from armimpedance.joint.elbow.elbow_result import ElbowFit
from armimpedance.joint.elbow.imposed import Answer, answered
from armimpedance.joint.elbow.limb_and_device import with_usable_command
from armimpedance.joint.elbow.samples import JointSamples
from armimpedance.joint.elbow.stationary.band import band_of
from armimpedance.joint.elbow.stationary.diagnosis import diagnosed
from armimpedance.joint.elbow.stationary.discrete import Structure, solve_structure
from armimpedance.joint.elbow.stationary.methods import METHODS
from armimpedance.joint.elbow.stationary.preparation import Cutoff, Decimation, prepare
from armimpedance.joint.elbow.stationary.weights import weighed_band
from armimpedance.numerics.criticism import check_joint_size
from armimpedance.numerics.regression import Parameters

_NOT_LOOKED_FOR: Final = Finding(
    "reflex",
    "cannot tell",
    "late answers and skew were not looked for: that takes an imposed angle or torque, or a "
    "recorded command",
)


def identify_elbow(
    samples: JointSamples,
    *,
    method: str | None = None,
    cutoff_hz: Cutoff = "auto",
    decimation: Decimation = "auto",
    lowest_hz: float | None = None,
) -> ElbowFit:
    """Estimate inertia, viscosity and stiffness about an operating point (3), all trials together.

    Parameters
    ----------
    samples : JointSamples
        As recorded.
    method : str, optional
        A name in `METHODS`; its default if none is given.
    cutoff_hz : float, None or "auto"
        Edge of the low-pass on torque and angle, Hz; None: no filter; "auto": chosen. Only `arx`
        filters and decimates: for the others the cut-off ends the band.
    decimation : int or "auto"
        Keep every so many-th sample.
    lowest_hz : float, optional
        Lower end of the band, Hz; by default the whole band; not for `arx`.

    Returns
    -------
    ElbowFit

    Raises
    ------
    InputError
        Unknown method; a record that is too short, constant, stuck or clipped; signal to noise
        below the method's limit; ARX on raw samples whose noise would bias the result strongly.
    NotIdentifiableError
        The motion does not allow I, B and K to be separated.
    EstimationError
        The result is not a joint's, or a search does not converge.
    """
    chosen = METHODS.named(method)
    if lowest_hz is not None and chosen.name == "arx":
        raise InputError(
            "a lowest frequency with method arx",
            expected="method iv, output-error or derivative, or no lowest frequency",
        )
    check_samples(samples)
    spectra = spectra_of(samples)
    check_snr(spectra.snr, chosen.lowest_snr_db, chosen.name)
    prepared = prepare(samples, spectra, cutoff_hz, decimation, lowest_hz)
    prepared = with_usable_command(prepared)
    answer = answered(prepared, chosen)
    fits = [diagnosed(w.estimate, chosen, prepared, w.floors, w.band) for w in answer.ways]
    return _concluded(answer, fits, samples.expected_inertia)


def _concluded(answer: Answer, fits: Sequence[ElbowFit], expected: float | None) -> ElbowFit:
    """Fit of the likeliest way, with I, B, K over all ways that the record does not exclude."""
    parameters_ = [fit.parameters for fit in fits]
    imposed, fit = answer.finding(parameters_), fits[0]
    checks, messages = fit.checks, warnings_of(fit.checks)
    warnings = tuple(sentence for sentence in fit.warnings if sentence not in messages)
    if answer.gives_way:
        # No instrument was right, so tests that used one are void.
        checks, warnings = (_NOT_LOOKED_FOR,), ()
    parameters = answer.parameters(parameters_)
    allowing = answer.parameters([fit.allowing or fit.parameters for fit in fits])
    inertia, sd = float(parameters.values[0]), float(parameters.sd[0])
    size = check_joint_size("inertia", inertia, sd, expected)
    checks = (imposed, *checks, size)
    return replace(
        fit,
        parameters=parameters,
        allowing=allowing,
        checks=checks,
        warnings=(*warnings_of(checks), *warnings),
    )


def estimate_joint(
    samples: JointSamples,
    method: str | None = None,
    *,
    cutoff_hz: Cutoff = "auto",
    decimation: Decimation = "auto",
) -> Parameters:
    """Estimate I, B and K by one method only: no limit to the noise, no comparison, no diagnosis.

    Parameters
    ----------
    samples : JointSamples
    method : str, optional
        A name in `METHODS`; its default if none is given.
    cutoff_hz : float, None or "auto"
    decimation : int or "auto"
        As for `identify_elbow`.

    Returns
    -------
    Parameters
        I, B, K with their covariance.

    Raises
    ------
    InputError, NotIdentifiableError, EstimationError
        As for `identify_elbow`.
    """
    prepared = prepare(samples, spectra_of(samples), cutoff_hz, decimation)
    band = weighed_band(band_of(prepared))
    return METHODS.named(method).identify(prepared, band).parameters


def least_squares_arx(
    samples: JointSamples,
    structure: Structure,
    *,
    cutoff_hz: Cutoff,
    decimation: Decimation,
    free: bool = False,
) -> Parameters:
    """Estimate I, B and K by the source's ARX in one of two structures, without regard to noise
    bias.

    Parameters
    ----------
    samples : JointSamples
    structure : {"zoh", "tustin"}
        Torque held between samples, nb = 2 and nk = 1; or bilinear, nb = 3 and nk = 0.
    cutoff_hz : float, None or "auto"
    decimation : int or "auto"
        As for `identify_elbow`.
    free : bool
        Fit each b separately, not in the proportions of the structure.

    Returns
    -------
    Parameters
        I, B, K with their covariance.

    Raises
    ------
    InputError
        An impossible cut-off or decimation.
    NotIdentifiableError
        The record does not allow the coefficients to be separated.
    EstimationError
        The fitted poles or gain are not a joint's.
    """
    prepared = prepare(samples, spectra_of(samples), cutoff_hz, decimation)
    return solve_structure(prepared, structure, free=free).parameters
