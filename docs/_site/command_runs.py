"""Run one example of each command, in a laboratory of simulated people, and keep what it printed.

python docs/_site/command_runs.py
"""

from __future__ import annotations

import io
import json
import os
import shlex
import sys
import time
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from tempfile import TemporaryDirectory

from armimpedance.__main__ import main
from armimpedance.app.cli.main import COMMANDS

KEPT = Path(__file__).resolve().parents[1] / "reference/commands/runs.json"
#: A line that begins with "." prepares what a later one needs and is not shown.
CALLS = """
new --for kinarm try_kinarm
exam try_kinarm/exam.kinarm
convert try_kinarm/exam.kinarm converted --events PERTURB_ON PERTURB_OFF
simulate cocontraction --sets 2 --out session
inspect session
trials session --out choice.html
estimate session --out hand.csv --figure hand.svg
report session --out report.html
reflex session --by condition --out reflex.csv
compare session --by condition --against cocontraction_00
map hand.csv --recording session --to joint --out joint.csv
fit muscles joint.csv --order 0 --out arm.json
predict arm.json --postures grid.csv --activations emg.csv --out predicted.csv
explore hand.csv --out explore.html
live arm.json --replay session --samples 5
plan --k-percent 10
next session --k-percent 5 --conditions cocontraction_00 --shapes designed
.new --for custom try_csv
map-columns try_csv/trials --out proposed.toml
share session --as datasheet --out DATASHEET.md
passive relaxed --rest-angle 1.5 --out fit.json
discriminate --group controls c1.json c2.json c3.json --group patients p1.json p2.json p3.json
body moving --motions all_joints --method ls --out body.json
.simulate elbow --sets 1 --duration-s 6 --out joint_session
elbow joint_session --out joint.json
.simulate reaches --repeats 2 --unperturbed 15 --out reaches
movement reaches --out moving.csv
.simulate random --trials 2 --duration-s 8 --out shaken
random shaken --out shaken.csv
therapy robot calibration --drawings drawings.json --out robot.json
therapy arm patient --robot robot.json --out passive_arm.json
therapy contribution patient --robot robot.json --arm passive_arm.json --out result.csv
.simulate cocontraction --sets 1 --out people/ann
.simulate cocontraction --sets 1 --seed 2 --out people/ben
study people out participant --dry-run
simulate-study coverage.toml --out coverage --workers 1
benchmark make --quick --task joint_torque --out benchmark
figures --only tsuji1997_fig06 --out figures
"""
#: Files that the calls read beside what they write themselves.
FILES = {
    "grid.csv": "q_shoulder_rad,q_elbow_rad\n1.04,1.57\n1.04,1.57\n",
    "emg.csv": "alpha_1,alpha_2,alpha_3,alpha_4,alpha_5,alpha_6\n"
    + "0.1,0.1,0.1,0.1,0.1,0.1\n" * 2,
    "coverage.toml": 'sessions = 4\nseed = 1\n[grid]\nrig = "hand"\nexperiment = "cocontraction"\n'
    'conditions = [["cocontraction_10"]]\nmethod = ["weighted", "exact"]\n',
}
MOST_LINES = 40


def people() -> None:
    """Recordings that take the simulators' commands too long: shorter ones of the same people."""
    from armimpedance.joint.therapy.show import write_robot
    from armimpedance.lab.simulated.therapy import drawings_of
    from armimpedance.recordings import write_recording
    from manipulandum_sim.body import simulate_body
    from manipulandum_sim.passive import simulate_passive
    from manipulandum_sim.therapy import simulate_calibration, simulate_therapy, therapy_device

    for seed, name in enumerate(("c1", "c2", "c3", "p1", "p2", "p3")):
        who = {"c": "1", "p": "2"}[name[0]]
        swing, _ = simulate_passive("release", subject=who, seed=seed, trials=1, duration_s=2.0)
        write_recording(swing, name)
        called(["passive", name, "--rest-angle", "1.5", "--out", f"{name}.json"])
    write_recording(swing, "relaxed")
    write_recording(simulate_body(("walk", "all_joints"))[0], "moving")
    empty, _ = simulate_calibration(seed=3, speeds_deg_s=(20.0, 40.0, 80.0), held_angles=4)
    write_recording(empty, "calibration")
    write_robot(drawings_of(therapy_device()), "drawings.json")
    conditions = ("passive", "active")
    patient, _ = simulate_therapy(subject="P2", seed=3, conditions=conditions, speed_deg_s=60.0)
    write_recording(patient, "patient")


def run_all() -> dict[str, list[dict[str, str]]]:
    """Command -> what was called and printed."""
    kept: dict[str, list[dict[str, str]]] = {}
    for line in CALLS.split("\n"):
        words = shlex.split(line.removeprefix("."))
        if not words or words[0] not in COMMANDS:
            continue
        begun = time.process_time()
        printed = called(words)
        print(f"{time.process_time() - begun:5.1f} s  armimpedance {shlex.join(words)}", flush=True)
        if not line.startswith("."):
            call = {"call": f"armimpedance {shlex.join(words)}", "printed": printed}
            kept.setdefault(words[0], []).append(call)
    return kept


def called(words: list[str]) -> str:
    """What a call prints; one that fails ends everything."""
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        status = main(words)
    if status:
        raise SystemExit(f"armimpedance {shlex.join(words)}: status {status}\n{err.getvalue()}")
    lines = out.getvalue().rstrip().splitlines()
    if len(lines) > MOST_LINES:
        lines = [*lines[:MOST_LINES], f"... {len(lines) - MOST_LINES} more lines"]
    return "\n".join(lines)


if __name__ == "__main__":
    os.environ |= {"COLUMNS": "90", "OMP_NUM_THREADS": "1"}
    with TemporaryDirectory() as folder, chdir(folder):
        for name, text in FILES.items():
            Path(name).write_text(text)
        people()
        found = run_all()
    KEPT.parent.mkdir(parents=True, exist_ok=True)
    KEPT.write_text(json.dumps(found, indent=1))
    missing = sorted(set(COMMANDS) - set(found) - {"demo", "app"})
    sys.exit(f"no example of {', '.join(missing)} is run" if missing else 0)
