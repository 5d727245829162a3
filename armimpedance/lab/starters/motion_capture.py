"""For labs with motion capture: a relaxed arm that swings."""

from __future__ import annotations

from pathlib import Path

from armimpedance.lab.parts.starter import LOOK, NotebookCell, Starter


def _write(folder: Path) -> None:
    from armimpedance.lab.parts.starter import filmed_session, write_form

    write_form("trc", *filmed_session(), folder)


STARTER = Starter(
    line="markers on a relaxed arm (.trc)",
    title="Passive stiffness of a relaxed joint from motion capture",
    about=(
        "The trunk of a simulated person is shaken while the arm hangs relaxed, and eight markers "
        "are filmed at 30 frames/s: `markers/p5_001.trc`. `skeleton.json` holds the segments, "
        "their masses, and where the markers sit on them."
    ),
    data=(
        ("markers", "the filmed markers, a .trc file for each trial"),
        ("skeleton.json", "segments, masses, and where the markers sit"),
        ("truth.json", "what the simulated person really has"),
    ),
    write=_write,
    commands=(
        (
            "a recording of markers",
            "armimpedance convert markers/p5_001.trc relaxed --skeleton skeleton.json",
        ),
        ("can it be used?", "armimpedance inspect relaxed"),
        (
            "stiffness, viscosity and friction",
            "armimpedance passive relaxed --rest-angle 1.5 --out fit.json --figure fit.svg",
        ),
    ),
    cells=(
        NotebookCell(
            "Read the markers and the skeleton that they sit on.",
            'import armimpedance as ai\n\nrecording = ai.read("markers/p5_001.trc", '
            'skeleton="skeleton.json")\nprint(recording)',
        ),
        LOOK,
        NotebookCell(
            "Stiffness, viscosity and friction of the relaxed elbow. Its rest angle is known here; "
            'rest_angle="free" fits it.',
            "fits = ai.passive(recording, rest_angle=1.5)\nprint(fits.summary)",
        ),
    ),
    own=(
        "`armimpedance convert` reads C3D as well as `.trc`. Without a skeleton of your own take "
        "`--skeleton elbow --mass-kg 70 --height-m 1.75`, name your markers with `--marker "
        "RSHO=acromion_right`, and give an upright trial with `--standing upright.trc`, from which "
        "it learns where the markers sit. Masses come from a table, and k, h and f are "
        "proportional to them: `--mass-sd-percent` puts that into the intervals."
    ),
)
