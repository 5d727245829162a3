"""`armimpedance elbow --emg-law`: B and K of each trial over the EMG amplitudes of its muscles."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from armimpedance.errors import EstimationError, InputError, NotIdentifiableError

if TYPE_CHECKING:
    import numpy as np

    from armimpedance.elbow import ElbowFit, EmgLaw, ImcjCalibration
    from armimpedance.records import Recording
    from armimpedance.signals import SegmentAmplitude


def run_law(recording: Recording, arguments: argparse.Namespace) -> int:
    """Fit every trial, then the laws; print and write."""
    from armimpedance.cli.parts.checks import naming
    from armimpedance.cli.parts.elbow_input import two_muscles
    from armimpedance.elbow import fit_emg_law_of
    from armimpedance.files import write_fit
    from armimpedance.report import law_object, law_summary, law_text
    from armimpedance.signals import segment_amplitude

    with naming(arguments.recording):
        pair = two_muscles(recording, arguments)
        fits, rows, left_out = _each_trial(recording, arguments)
        levels = segment_amplitude(pair)
        law = fit_emg_law_of(
            fits, levels.amplitude[rows], levels.sd[rows], muscles=list(pair.muscles)
        )
    index = None if arguments.imcj is None else _index(recording, arguments, rows)
    trials = recording.trials["trial"].iloc[rows].tolist()
    points = [
        {
            "trial": trial,
            "amplitude": dict(zip(pair.muscles, levels.amplitude[row].tolist(), strict=True)),
            "K": fit.stiffness.value,
            "sd_K": fit.stiffness.sd_robust,
            "B": fit.viscosity.value,
            "sd_B": fit.viscosity.sd_robust,
        }
        for trial, row, fit in zip(trials, rows, fits, strict=True)
    ]
    if index is not None:
        for point, value, sd in zip(points, *index.values, strict=True):
            point |= {"imcj_Nm": float(value), "sd_imcj_Nm": float(sd)}
    notes = (*levels.notes, *levels.warnings, *left_out, *(index.notes if index else ()))
    print(law_text(law, points, notes))
    if arguments.out is not None:
        write_fit(law_summary(law), arguments.out, **law_object(law, points, notes))
    if arguments.figure is not None:
        _draw(law, fits, levels, rows, arguments)
    return 0


def _each_trial(
    recording: Recording, arguments: argparse.Namespace
) -> tuple[list[ElbowFit], list[int], list[str]]:
    """Fits, the rows of the trial table that they are of, and why others have none."""
    from armimpedance.cli.parts.elbow_input import fit_recording
    from armimpedance.cli.parts.progress import bar

    fits, rows, left_out = [], [], []
    with bar("fitting trials") as progress:
        for row in range(recording.n_trials):
            try:
                fits.append(fit_recording(recording.select([row]), arguments))
                rows.append(row)
            except (InputError, EstimationError, NotIdentifiableError) as error:
                reason = getattr(error, "problem", str(error))
                left_out.append(f"trial {recording.trials['trial'].iloc[row]} left out: {reason}")
            progress(row + 1, recording.n_trials)
    return fits, rows, left_out


class _Index:
    """The index of co-contraction of each trial, and what a reader must know of it."""

    def __init__(self, values: tuple[np.ndarray, np.ndarray], calibration: ImcjCalibration) -> None:
        gains = ", ".join(
            f"{m} {g:.3g}" for m, g in zip(calibration.muscles, calibration.gains, strict=True)
        )
        self.values = values
        self.notes = (f"|a_i| of the index (Nm): {gains}", *calibration.warnings)


def _index(recording: Recording, arguments: argparse.Namespace, rows: list[int]) -> _Index:
    from armimpedance.cli.parts.checks import naming
    from armimpedance.cli.parts.joint_input import read_joint
    from armimpedance.elbow import calibrate_imcj, imcj
    from armimpedance.signals import segment_amplitude

    with naming(arguments.imcj):
        calibration = calibrate_imcj(read_joint(arguments.imcj), joint=arguments.joint)
    if missing := sorted(set(calibration.muscles) - set(recording.muscles)):
        raise InputError(
            f"no EMG of {', '.join(missing)}",
            file=arguments.recording,
            expected=f"the muscles of {arguments.imcj}: {', '.join(calibration.muscles)}",
        )
    with naming(arguments.recording):
        levels: SegmentAmplitude = segment_amplitude(recording)
    columns = [recording.muscles.index(m) for m in calibration.muscles]
    amplitude, sd = (values[rows][:, columns] for values in (levels.amplitude, levels.sd))
    return _Index(imcj(calibration, amplitude, sd), calibration)


def _draw(
    law: EmgLaw,
    fits: list[ElbowFit],
    levels: SegmentAmplitude,
    rows: list[int],
    arguments: argparse.Namespace,
) -> None:
    from armimpedance.plots import plot_emg_law, save

    figure = plot_emg_law(law, fits, levels.amplitude[rows])
    save(figure, arguments.figure.with_suffix(""), (arguments.figure.suffix[1:],))
