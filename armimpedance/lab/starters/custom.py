"""For labs with a robot of their own: a text file a trial."""

from __future__ import annotations

from pathlib import Path

from armimpedance.lab.parts.starter import HAND_CELLS, NotebookCell, Starter


def _write(folder: Path) -> None:
    from armimpedance.lab.parts.starter import hand_session, write_small_csv

    write_small_csv(*hand_session(), folder)


STARTER = Starter(
    line="a CSV file for each trial, in ms and mm",
    title="Hand impedance from CSV files",
    about=(
        "A simulated person holds the handle of a planar robot, relaxed and at two levels of "
        "co-contraction, and is pushed 5 mm and back in eight directions. Each trial is a file "
        "in `trials/`, in ms, mm and N, with the force of the robot on the hand; "
        "`trials/columns.toml` says so, once."
    ),
    data=(
        ("trials", "a CSV file for each trial, and columns.toml, the mapping of their columns"),
        ("truth.json", "what the simulated person really has"),
    ),
    write=_write,
    commands=(
        ("can it be used?", "armimpedance inspect trials"),
        ("a recording, for good", "armimpedance convert trials session"),
        (
            "one row a condition, with ellipses",
            "armimpedance estimate session --out hand.csv --figure ellipses.svg",
        ),
        ("a page to show", "armimpedance report session --out report.html"),
    ),
    cells=(
        NotebookCell(
            "Read all trials. Units and signs are turned once, here, as the mapping says.",
            'import armimpedance as ai\n\nrecording = ai.read("trials")\nprint(recording)',
        ),
        *HAND_CELLS,
    ),
    own=(
        "Put your files into a folder and run `armimpedance map-columns FOLDER --out "
        "FOLDER/columns.toml`: it proposes a mapping from names, units and data, and marks with "
        "`?` what it cannot tell, above all whose force the sensor holds. Decide these lines, "
        "then go on as above."
    ),
)
