"""For labs that shake one joint at random: angle and torque."""

from __future__ import annotations

from pathlib import Path

from armimpedance.lab.parts.starter import LOOK, NotebookCell, Starter


def _write(folder: Path) -> None:
    from armimpedance.lab.parts.starter import joint_session, write_form

    write_form("matlab", *joint_session(), folder)


STARTER = Starter(
    line="one joint under a random perturbation, in a MATLAB file",
    title="Impedance of one joint under a random perturbation",
    about=(
        "The joint of a simulated person is moved at random by a powered device while angle, "
        "torque and EMG are recorded: two trials of ten seconds in `session.mat`. The joint is an "
        "elbow; an ankle's file looks the same."
    ),
    data=(
        ("session.mat", "trials(1..T) with time, angle, torque, EMG"),
        ("columns.toml", "the mapping: which field is what, its unit, whose torque"),
        ("truth.json", "what the simulated person really has"),
    ),
    write=_write,
    commands=(
        ("can it be used? (columns.toml lies beside it)", "armimpedance inspect session.mat"),
        (
            "inertia, viscosity, stiffness",
            "armimpedance elbow session.mat --out fit.json --figure fit.svg",
        ),
        ("a page to show", "armimpedance report session.mat --out report.html"),
    ),
    cells=(
        NotebookCell(
            "Read the file. The mapping lies beside it, so that nothing has to be told.",
            'import armimpedance as ai\n\nrecording = ai.read("session.mat")\nprint(recording)',
        ),
        LOOK,
        NotebookCell(
            "Inertia, viscosity and stiffness about the operating point.",
            "fit = ai.elbow(recording)\nprint(fit.summary)",
        ),
        NotebookCell("A page to show.", 'ai.write_report(recording, "report.html")'),
    ),
    own=(
        "Run `armimpedance map-columns yours.mat --out columns.toml` and decide what it marks with "
        "`?`: whose torque the sensor holds, and `torque`, whether it is the torque between limb "
        'and device or the one that the motor was told to make. Write `imposed = "position"` '
        "where a stiff device imposes the angle."
    ),
)
