"""For labs with a Kinarm: an exam as the robot keeps it."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from armimpedance.lab.parts.starter import HAND_CELLS, NotebookCell, Starter

_EVENTS: Final = 'onset_event="PERTURB_ON", end_event="PERTURB_OFF"'


def _write(folder: Path) -> None:
    from armimpedance.lab.parts.starter import hand_session, write_form

    write_form("kinarm", *hand_session(), folder)


STARTER = Starter(
    line="a Kinarm exam (.kinarm)",
    title="Hand impedance from a Kinarm exam",
    about=(
        "A simulated person holds the handle of a Kinarm End-Point robot, relaxed and at two "
        "levels of co-contraction, and is pushed 5 mm and back in eight directions. "
        "`exam.kinarm` is the archive as the robot's computer keeps it; exported C3D files (a zip "
        "or a folder) are read in the same way."
    ),
    data=(
        ("exam.kinarm", "the exam: protocols, events, robot, force sensor, EMG"),
        ("truth.json", "what the simulated person really has"),
    ),
    write=_write,
    commands=(
        ("what the exam holds", "armimpedance exam exam.kinarm"),
        (
            "a recording, with the events of each push",
            "armimpedance convert exam.kinarm session --events PERTURB_ON PERTURB_OFF",
        ),
        ("can it be used?", "armimpedance inspect session"),
        (
            "one row a condition, with ellipses",
            "armimpedance estimate session --out hand.csv --figure ellipses.svg",
        ),
        ("a page to show", "armimpedance report session --out report.html"),
    ),
    cells=(
        NotebookCell(
            "Read the exam. The events say when each push begins and ends; whose force the sensor "
            "holds is found from the robot's own dynamics, or stated with force_by.",
            f'import armimpedance as ai\n\nrecording = ai.read("exam.kinarm", {_EVENTS})\n'
            "print(recording)",
        ),
        *HAND_CELLS,
    ),
    own=(
        "Put your exam in the place of `exam.kinarm`. `armimpedance exam` lists its protocols and "
        "events and proposes a `convert` line: take the names of your own events, choose trials "
        'with `--where "TP == 3 and is_error == 0"`, name the muscles of your analog inputs with '
        "`--emg ACH0=biceps_long`, and say `--force-by limb` or `device` where the robot's own "
        "dynamics do not show it."
    ),
)
