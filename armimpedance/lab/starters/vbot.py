"""For labs with a vBOT, or another robot whose MATLAB files hold arrays of trials x samples."""

from __future__ import annotations

from pathlib import Path

from armimpedance.lab.parts.starter import HAND_CELLS, NotebookCell, Starter


def _write(folder: Path) -> None:
    from armimpedance.lab.parts.starter import hand_session, write_form

    write_form("vbot", *hand_session(), folder)


STARTER = Starter(
    line="a MATLAB file with arrays of trials x frames, as labs with a vBOT have them",
    title="Hand impedance from MATLAB files",
    about=(
        "A simulated person holds the handle of a planar robot, relaxed and at two levels of "
        "co-contraction, and is pushed 5 mm and back in eight directions. `session.mat` holds the "
        "struct D: D.FrameData.RobotPosition and other arrays of trials x frames x axes, filled up "
        "with zeros behind each trial's last frame, beside what holds for a trial. `columns.toml` "
        "says which field is what."
    ),
    data=(
        ("session.mat", "D.FrameData with time, position, force, EMG; D.Condition and so on"),
        ("columns.toml", "the mapping: which field is what, its unit, whose force"),
        ("truth.json", "what the simulated person really has"),
    ),
    write=_write,
    commands=(
        (
            "what a mapping of these fields could be (one lies here already)",
            "armimpedance map-columns session.mat --out proposed.toml",
        ),
        ("can it be used? (columns.toml lies beside it)", "armimpedance inspect session.mat"),
        (
            "one row a condition, with ellipses",
            "armimpedance estimate session.mat --out hand.csv --figure ellipses.svg",
        ),
        ("a page to show", "armimpedance report session.mat --out report.html"),
    ),
    cells=(
        NotebookCell(
            "Read the file. The mapping lies beside it, so that nothing has to be told.",
            'import armimpedance as ai\n\nrecording = ai.read("session.mat")\nprint(recording)',
        ),
        *HAND_CELLS,
    ),
    own=(
        "Run `armimpedance map-columns yours.mat --out columns.toml`: it proposes a mapping from "
        "names, units and data, and marks with `?` what it cannot tell, above all whose force the "
        "sensor holds. Decide these lines, then go on as above. Objects of MATLAB classes (table, "
        "timeseries, string) have to be saved as plain structs first."
    ),
)
