"""The simulated sessions of the example folders, in a laboratory's own files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from armimpedance.lab.parts.lab_form import FORMS
from armimpedance.lab.parts.simulation import TRUTH_FILE, Truth

if TYPE_CHECKING:
    from armimpedance.core.motion import MarkerRecording
    from armimpedance.core.records import Recording
    from armimpedance.recordings import AnyRecording

#: Every folder of a kind holds the same session.
SEED: Final = 2026
_LEVELS: Final = ("cocontraction_00", "cocontraction_10", "cocontraction_30")


def hand_session() -> tuple[Recording, Truth]:
    """Pushes of the hand at three levels of co-contraction, two sets each, and the truth."""
    from manipulandum_sim.hand import simulate

    return simulate("cocontraction", seed=SEED, sets=2, conditions=_LEVELS)


def joint_session() -> tuple[Recording, Truth]:
    """One joint under a random perturbation, two trials of ten seconds, and the truth."""
    from manipulandum_sim.elbow import simulate_elbow

    return simulate_elbow("posture", subject="1", seed=SEED, repetitions=2)


def filmed_session() -> tuple[MarkerRecording, Truth]:
    """A relaxed arm while the trunk is shaken, filmed, and the truth."""
    from manipulandum_sim.passive import simulate_passive

    return simulate_passive("p5", subject="1", seed=SEED)


def write_form(form: str, recording: AnyRecording, truth: Truth, folder: Path) -> None:
    """Write a session in a laboratory's form, and its truth."""
    FORMS[form].write(recording, folder)
    truth.write(folder / TRUTH_FILE)


def write_small_csv(recording: Recording, truth: Truth, folder: Path) -> None:
    """Write a CSV file for each trial in ms and mm with the device's force, and the truth."""
    from manipulandum_sim.lab_files import (
        column_name,
        mapping_text,
        numeric_facts,
        write_trial_files,
    )

    facts = numeric_facts(recording)
    write_trial_files(recording, folder / "trials", units="small", by="device", facts=facts)
    text = mapping_text(
        recording,
        lambda name: column_name(name, "small"),
        head=['files = "*.csv"'],
        trials=['pattern = "{condition}_{trial}.csv"'],
        condition=None,
        units="small",
        by="device",
    )
    (folder / "trials" / "columns.toml").write_text(text, encoding="utf-8")
    truth.write(folder / TRUTH_FILE)
