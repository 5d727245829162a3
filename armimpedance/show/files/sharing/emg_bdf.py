"""EMG of one trial as EMG-BIDS: a BDF file (24 bits) with its descriptions."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.motion import EmgSignals
from armimpedance.show.files.sharing.bids_text import write_json, write_table

_RECORD_S = (1.0, 2.0, 0.5, 0.1, 4.0, 5.0, 10.0)
_MICROVOLTS = 1e6


def write_bdf(stem: Path, task: str, emg: EmgSignals, trial: int) -> tuple[str, ...]:
    """Write the EMG of one trial; returns what a reader must know.

    Parameters
    ----------
    stem : Path
        With the name up to `_emg`.
    task : str
    emg : EmgSignals
    trial : int
        Row of the trial table.

    Raises
    ------
    InputError
        edfio is not installed, or the rate fits no whole record.
    """
    if emg.unit != "V":
        return ("Left out: normalised EMG, which is no voltage (EMG-BIDS holds voltages).",)
    values = emg.signals[int(emg.offsets[trial]) : int(emg.offsets[trial + 1])]
    if not len(values):
        return ()
    edfio = _edfio(stem)
    rate = float(emg.sample_rate_hz)
    record = next((s for s in _RECORD_S if (s * rate).is_integer()), None)
    if record is None:
        raise InputError(f"EMG of {rate:g} Hz", expected="a rate with whole samples in 10 s")
    per = int(record * rate)
    padded = np.zeros((-(-len(values) // per) * per, values.shape[1]))
    padded[: len(values)] = values * _MICROVOLTS
    signals = [_signal(edfio, padded[:, i], rate, m) for i, m in enumerate(emg.muscles)]
    edfio.Bdf(signals, data_record_duration=record).write(stem.with_name(stem.name + ".bdf"))
    _write_beside(stem, task, emg, len(values) / rate)
    return (
        "EMG is written in 24 bits (BDF); zeros fill its last record.",
        "Not known, and written as n/a: EMGReference, PowerLineFrequency, SoftwareFilters of EMG.",
    )


def _edfio(stem: Path) -> Any:
    try:
        import edfio
    except ImportError:
        raise InputError(
            "the package edfio is not installed",
            file=stem,
            expected="it: pip install 'armimpedance[bids]'",
        ) from None
    return edfio


def _signal(edfio: Any, values: Any, rate: float, muscle: str) -> Any:
    largest = _rounded_up(max(float(np.abs(values).max()), 1e-3))
    return edfio.BdfSignal(
        values,
        rate,
        label=muscle.encode("ascii", "replace").decode()[:16],
        physical_dimension="uV",
        physical_range=(-largest, largest),
    )


def _rounded_up(value: float) -> float:
    """The next number of three digits: a file has eight characters for a limit."""
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{math.ceil(value / step) * step:.3g}")


def _write_beside(stem: Path, task: str, emg: EmgSignals, duration_s: float) -> None:
    write_json(
        stem.with_name(stem.name + ".json"),
        {
            "TaskName": task,
            "SamplingFrequency": float(emg.sample_rate_hz),
            "EMGChannelCount": len(emg.muscles),
            "EMGPlacementScheme": "Other",
            "EMGPlacementSchemeDescription": "n/a",
            "EMGReference": "n/a",
            "PowerLineFrequency": "n/a",
            "SoftwareFilters": "n/a",
            "RecordingType": "continuous",
            "RecordingDuration": duration_s,
        },
    )
    rows = [{"name": m, "type": "EMG", "units": "uV", "target_muscle": m} for m in emg.muscles]
    names = ["name", "type", "units", "target_muscle"]
    channels = stem.name.removesuffix("_emg") + "_channels.tsv"
    write_table(stem.with_name(channels), names, rows)
