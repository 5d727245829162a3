"""Viscosity and stiffness of one joint over the EMG of its muscles."""

from __future__ import annotations

from armimpedance.core.program import software
from armimpedance.joint.elbow.show.emg_verb import emg_law
from armimpedance.joint.elbow.show.plot import plot_emg_law
from armimpedance.joint.elbow.show.text import law_text
from armimpedance.show.pages import RUIZ, Asked, Page, Topic, fit_page, picture
from armimpedance.show.verbs.results import read_recording


def page_of(asked: Asked) -> Page:
    """The page of a law over EMG amplitudes."""
    recording = read_recording(asked.recording)
    law = emg_law(recording, method=asked.method, despite=asked.despite, progress=asked.progress)
    return fit_page(
        asked,
        law.summary,
        title="Impedance of a joint over EMG",
        lead=f"{recording.n_trials} trials at {recording.sample_rate_hz:g} Hz; subject "
        f"{recording.subject.id}.",
        pictures=[
            picture(plot_emg_law(law), "law", "B and K of each trial over what the law gives.")
        ],
        printed=law_text(law),
        methods=[
            f"I, B and K of each trial were estimated with {software()}; B and K were then fitted "
            "as linear laws of the EMG amplitudes, whose own errors are accounted for",
        ],
        references=[RUIZ],
        emg=True,
        options=[("despite", ", ".join(asked.despite))],
    )


TOPIC = Topic("B and K of one joint over the EMG of its muscles", page_of)
