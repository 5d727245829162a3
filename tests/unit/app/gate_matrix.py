"""Each check's failing recording, put through every command that takes such a recording.

python tests/unit/app/gate_matrix.py prints the table of docs/evidence/gate.md.
"""

from __future__ import annotations

import sys
import tempfile
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Final

import numpy as np

from armimpedance.app.cli.main import run
from armimpedance.core.records import Recording
from armimpedance.recordings import write_recording
from manipulandum_sim.elbow import simulate_bench
from manipulandum_sim.hand import simulate
from manipulandum_sim.movement import simulate_movement
from manipulandum_sim.random_hand import simulate_random

#: What a command comes to: it refuses and names the check, the page that it writes does, or it goes
#: on. Both of the first end with status 2.
REFUSED, PRINTED, GOES_ON = "refused", "on the page", "goes on"
WARNED = "refused; `inspect` warns"

#: Commands that take a recording of pushes; `{0}` is the recording, `{1}` a file to be written.
COMMANDS: Final = (
    "inspect {0}",
    "estimate {0} --out {1}.csv",
    "estimate {0} --method all --out {1}.csv",
    "reflex {0} --out {1}.csv",
    "compare {0} --out {1}.csv",
    "plan --pilot {0} --shape minimum_jerk --duration-s 0.3 --out-profile {1}.csv",
    "report {0} --out {1}.html",
)


def sound() -> Recording:
    """A recording that fails no check: two conditions."""
    conditions = ["cocontraction_10", "cocontraction_30"]
    return simulate("cocontraction", seed=1, sets=1, conditions=conditions, emg=False)[0]


def failing(recording: Recording) -> dict[str, tuple[str, Recording]]:
    """Check -> what is wrong, and a recording with that."""
    one_way = (recording.trials["direction_deg"] == 45.0).to_numpy()
    return {
        "units": ("force in mN", replace(recording, force=1000 * recording.force)),
        "reach": ("position 1.5 m off", replace(recording, position=recording.position + 1.5)),
        "force sign": ("force of the device", replace(recording, force=-recording.force)),
        "axes": ("axes of force exchanged", replace(recording, force=recording.force[:, ::-1])),
        "disturbance": ("a hand that stays away", _away(recording)),
        "directions": ("one direction only", recording.select(one_way)),
        "copies": ("every trial twice", _copied(recording)),
    }


def _copied(recording: Recording) -> Recording:
    """Every trial stands twice, under another number."""
    rows = [*range(recording.n_trials), *range(recording.n_trials)]
    at = np.concatenate([np.arange(*recording.offsets[[row, row + 1]]) for row in rows])
    angles, emg = recording.joint_angles, recording.emg
    return replace(
        recording,
        trials=recording.trials.iloc[rows].assign(trial=np.arange(1, len(rows) + 1)),
        offsets=np.concatenate([[0], np.cumsum(np.diff(recording.offsets)[rows])]),
        time_s=recording.time_s[at],
        position=recording.position[at],
        force=recording.force[at],
        joint_angles=None if angles is None else angles[at],
        emg=None if emg is None else emg[at],
    )


def _away(recording: Recording) -> Recording:
    """The hand is taken 100 mm away and stays there."""
    way = 0.1 / (1 + np.exp(-(recording.time_s - 0.5) * 20))
    return replace(recording, position=recording.position + way[:, None] * [1.0, 0.0])


#: Commands of other experiments, each with what makes a recording that it takes.
OTHERS: Final = {
    "random {0} --out {1}.csv": lambda: simulate_random(seed=1, trials=2, duration_s=6.0)[0],
    "movement {0} --out {1}.csv": lambda: simulate_movement(
        seed=1, repeats=2, unperturbed=15, phases=(0.5,)
    )[0],
    "elbow {0} --out {1}.json": lambda: simulate_bench(
        0.07, 1.2, 20.0, duration_s=6.0, snr_db=40.0
    )[0],
}


#: What may be wrong with any of these. Of one axis none can be exchanged.
WRONG: Final = {
    "force in mN": lambda r: replace(r, force=1000 * r.force),
    "force of the device": lambda r: replace(r, force=-r.force),
    "axes of force exchanged": lambda r: None if r.axes < 2 else replace(r, force=r.force[:, ::-1]),
    "position in mm, or degrees": lambda r: replace(r, position=1000 * r.position),
}


def table_of_others(folder: Path) -> str:
    """The same of other experiments: what ends their commands, and `inspect`, with status 2."""
    made = {command: make() for command, make in OTHERS.items()}
    heads = [f"`{name_of(command)}`" for command in made]
    lines = [f"| what is wrong | {' | '.join(heads)} |", "| --- |" + " --- |" * len(heads)]
    for name, damage in WRONG.items():
        cells = [ends(folder / name, command, damage(one)) for command, one in made.items()]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def ends(folder: Path, command: str, recording: Recording | None) -> str:
    if recording is None:
        return "-"
    place, complained = folder / command.split()[0], StringIO()
    place.mkdir(parents=True)
    write_recording(recording, place / "s")
    with redirect_stdout(StringIO()), redirect_stderr(complained):
        status = run(command.format(place / "s", place / "result").split())
        inspected = run(["inspect", str(place / "s")])
    if status != 2 or any(place.glob("result*")):
        return f"{GOES_ON}: {complained.getvalue()}"
    return REFUSED if inspected == 2 else WARNED


def outcome(command: str, check: str, recording: Path, out: Path, *options: str) -> str:
    """What a command does with a recording that fails a check."""
    words = command.format(recording, out / command.split()[0]).split()
    printed, complained = StringIO(), StringIO()
    with redirect_stdout(printed), redirect_stderr(complained):
        status = run([*words, *options])
    if status == 2 and f"{check}: " in complained.getvalue():
        return REFUSED
    if status == 2 and f"{check}: " in printed.getvalue():
        return PRINTED
    return GOES_ON if status == 0 else f"status {status}: {complained.getvalue().strip()}"


def name_of(command: str) -> str:
    """The command as a head of the table."""
    return command.partition(" --out")[0].partition(" --shape")[0].replace(" {0}", "")


def table(folder: Path, whole: Recording) -> str:
    """The matrix in Markdown, from a sound recording."""
    heads = [f"`{name_of(command)}`" for command in COMMANDS]
    lines = [
        "| check | what is wrong | " + " | ".join(heads) + " |",
        "| --- | --- |" + " --- |" * len(heads),
    ]
    for check, (wrong, recording) in failing(whole).items():
        place = folder / check.replace(" ", "_")
        write_recording(recording, place)
        cells = [outcome(command, check, place, folder) for command in COMMANDS]
        lines.append(f"| {check} | {wrong} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as made:
        sys.stdout.write(table(Path(made), sound()) + "\n" + table_of_others(Path(made)))
