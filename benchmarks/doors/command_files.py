"""Whole small inputs for every command: recordings of each kind, and what is made of them."""

from __future__ import annotations

import contextlib
import io
import os
import shutil
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import pandas as pd
from small_files import DOORS, hand

from armimpedance.app.cli.main import run
from armimpedance.recordings import write_recording
from manipulandum_sim.body import simulate_body
from manipulandum_sim.hand import simulate
from manipulandum_sim.passive import simulate_passive

sys.path.append(str(Path(__file__).resolve().parents[2] / "tests" / "unit" / "app" / "cli"))

import therapy_bench

#: Folder of the shop -> the reader's door whose small file it holds.
FORMATS: Final = {
    "kinarm": "Kinarm archive",
    "kinarm_c3d": "Kinarm C3D",
    "c3d": "marker C3D",
    "csv_log": "CSV by a mapping",
    "parquet_log": "Parquet by a mapping",
    "matlab": "MATLAB 5",
    "matlab73": "MATLAB 7.3",
    "mcap": "MCAP, CDR",
    "nwb": "NWB",
    "tdms": "TDMS",
    "ros1": "ROS 1",
    "ros2": "ROS 2, database",
    "trc": ".trc",
    "bids": "BIDS",
}

#: Moment arms of one's own, m.
ARMS: Final = {
    "brachialis": (0.0, 0.04),
    "triceps_lateral": (0.0, -0.03),
    "pectoralis_major": (0.04, 0.0),
    "infraspinatus": (-0.04, 0.0),
    "biceps_long": (0.03, 0.03),
    "triceps_long": (-0.03, -0.02),
}

#: What the commands make of the recordings, in this order.
MADE: Final = """
simulate elbow --sets 1 --duration-s 5 --out elbow
simulate elbow-cocontraction --sets 1 --duration-s 2 --out levels
simulate elbow-varying --sets 1 --duration-s 2 --out moving
simulate elbow-calibration --sets 1 --duration-s 2 --out imcj
estimate hand --out hand.csv
estimate hand --out hand.json
estimate hand_csv --out hand_b.csv
estimate hand --method all --out every.csv
estimate post --out post.csv
estimate force --out force.csv
map hand.csv --recording hand --to joint --out coco_joint.csv
map force.csv --recording force --to joint --out force_joint.csv
map post.csv --recording post --to joint --out post_joint.csv
estimate wide --out wide.csv
map wide.csv --recording wide --to joint --out wide_joint.csv
map post.csv --recording post --to muscle --arm planar6 --out muscle.csv
fit moment-arms post_joint.csv --order 1 --out posture.json
fit activation coco_joint.csv force_joint.csv --order 1 --torque --out activation.json
fit muscles post_joint.csv coco_joint.csv force_joint.csv --out arm.json
predict posture.json --postures grid.csv --out predicted.csv
predict arm26 --postures grid.csv --to moment-arms --out arms.sto
elbow elbow --out elbow.json
elbow moving --time-varying smoother --out course.csv
elbow levels --emg-law --imcj imcj --out law.json
passive swing --rest-angle 1.5 --out swing.json
passive swing --rest-angle free --out swing_b.json
passive swing --rest-angle 1.4 --out swing_c.json
passive swing --rest-angle 1.2 --out swing_d.json
passive swing --rest-angle 1.1 --out swing_e.json
passive swing --rest-angle 1.0 --out swing_f.json
body body --motions all --what-shows --out body.json
reflex hand --out reflex.csv
compare hand --out differences.csv
therapy robot empty --drawings drawings.json --out robot.json
therapy arm patient --robot robot.json --out relaxed.json
therapy contribution patient --robot robot.json --arm relaxed.json --out share.csv
study people out_done participant --workers 1
study people out_done group
"""

#: A design of a study over relaxed joints.
DESIGN: Final = """
steps = [
  "inspect {recording} --out checks.csv",
  "passive {recording} --rest-angle 1.5 --out swing.csv",
]
group_steps = []
tables = ["swing.csv"]
"""

#: Simulated sessions of a linear limb, which take no time.
SESSIONS: Final = """
sessions = 2
seed = 3

[grid]
rig = "linear"
noise = ["nominal", "sensor"]
"""


def build(shop: Path) -> None:
    """Write every input into a folder."""
    for folder, door in FORMATS.items():
        (shop / folder).mkdir()
        DOORS[door].build(shop / folder)
    _hands(shop)
    _bodies(shop)
    therapy_bench.write_robot(therapy_bench.DRAWINGS, shop / "drawings.json")
    therapy_bench.write_folder(therapy_bench.calibration(), shop / "empty")
    therapy_bench.write_folder(therapy_bench.session(), shop / "patient")
    therapy_bench.write_folder(_pipes(), shop / "pipes")
    moving = [therapy_bench.lifted("free") for _ in range(2)]
    moving = therapy_bench.recorded(moving, therapy_bench.Subject("empty"))
    therapy_bench.write_folder(moving, shop / "validation")
    _tables(shop)
    _people(shop)
    before = Path.cwd()
    os.chdir(shop)
    try:
        for line in MADE.strip().splitlines():
            _made(line)
    finally:
        os.chdir(before)


def _made(line: str) -> None:
    with contextlib.redirect_stdout(io.StringIO()):
        status = run(line.split())
    if status != 0:
        raise SystemExit(f"a sound input was refused: {line}")


def _pipes() -> Any:
    """A mock-up that is lifted and lowered, twice."""
    trials = []
    for axis in (0, 1):
        t, q, qd, qdd, row = therapy_bench.lifted("passive", axis)
        trials += [(t, q, qd, qdd, row), (t, q[::-1], -qd[::-1], qdd[::-1], row)] * 2
    arm = therapy_bench.PassiveArm(
        "S", therapy_bench.DRAWINGS.name, 0.3, therapy_bench.segments_of(therapy_bench.PERSON)
    )
    return therapy_bench.recorded(trials, therapy_bench.Subject("pipes"), arm, elastic=False)


def _hands(shop: Path) -> None:
    """Recordings of the hand: as two tables, in three experiments."""
    few = ["cocontraction_00", "cocontraction_30"]
    recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=few, noise="sensor")
    write_recording(_short(recording), shop / "hand")
    write_recording(_short(recording.select(range(8))), shop / "hand_csv", "csv")
    write_recording(
        _short(simulate("cocontraction", seed=1, sets=2, conditions=few[:1])[0]), shop / "twice"
    )
    for name, experiment, count in (
        ("post", "postures", 7),
        ("wide", "postures", 16),
        ("force", "force", 7),
    ):
        made, _ = simulate(experiment, seed=1, sets=1, noise="sensor")
        keep = sorted(set(made.trials["condition"]))[:count]
        write_recording(_short(made.select(made.trials["condition"].isin(keep))), shop / name)
    write_recording(hand(), shop / "short")
    (shop / "left_out.csv").write_text("trial,why\n2,moved\n3,odd\n", encoding="utf-8")


def _short(recording: Any) -> Any:
    """The recording without its history, which says what made it."""
    return replace(recording, provenance=())


def _bodies(shop: Path) -> None:
    """A filmed forearm; a body on force plates; the same as tables of motion capture."""
    swing, _ = simulate_passive("release", seed=1, trials=2, duration_s=3.0)
    write_recording(swing, shop / "swing", "csv")
    body, _ = simulate_body(["squat", "walk"], sample_rate_hz=50.0)
    write_recording(body, shop / "body", "csv")
    for form in ("trc", "mot"):
        from armimpedance.lab.lab_forms import FORMS

        (shop / f"body_{form}").mkdir()
        recording = swing if form == "trc" else body
        FORMS[form].write(recording, shop / f"body_{form}")


def _people(shop: Path) -> None:
    """Three people's relaxed joints, and what is to be done with them."""
    for number in range(1, 4):
        shutil.copytree(shop / "swing", shop / "people" / f"sub-{number}" / "swing")
    (shop / "people" / "study.toml").write_text(DESIGN)
    people = "participant_id,age,group\nsub-1,30,patient\nsub-2,41,control\nsub-3,39,control\n"
    (shop / "people" / "participants.tsv").write_text(people.replace(",", "\t"))
    (shop / "sessions.toml").write_text(SESSIONS)


def _tables(shop: Path) -> None:
    """Postures and activations to predict, moment arms of one's own."""
    grid = pd.DataFrame({"q_shoulder_rad": [0.8, 1.0, 1.2], "q_elbow_rad": [1.4, 1.6, 1.8]})
    grid.to_csv(shop / "grid.csv", index=False)
    emg = pd.DataFrame({f"alpha_{i}": [0.1, 0.2, 0.3] for i in range(1, 7)})
    emg.to_csv(shop / "emg.csv", index=False)
    rows = [
        (muscle, s, e, *arms)
        for muscle, arms in ARMS.items()
        for s in (0.0, 0.5, 1.0, 1.5)
        for e in (0.2, 1.0, 1.7, 2.4)
    ]
    names = ["muscle", "q_shoulder_rad", "q_elbow_rad", "G_shoulder_m", "G_elbow_m"]
    pd.DataFrame(rows, columns=names).to_csv(shop / "arms.csv", index=False)
