"""`armimpedance body` as a user calls it: its table, FIT.json, and what it refuses."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from armimpedance.__main__ import main
from armimpedance.core.records import Subject
from armimpedance.core.skeleton import Skeleton
from armimpedance.recordings.motion.marker_and_motion_folder import write_motion
from manipulandum_sim.body.simulate import simulate_body

MOTIONS = ("walk", "all_joints", "trunk_twist")


@pytest.fixture(scope="module")
def studio():
    """Three motions on force plates and their truth."""
    return simulate_body(MOTIONS)


@pytest.fixture(scope="module")
def session(studio, tmp_path_factory):
    folder = tmp_path_factory.mktemp("body") / "session"
    write_motion(studio[0], folder, "parquet")
    return folder


@pytest.fixture(scope="module")
def fit(session, tmp_path_factory):
    """FIT.json of the usual call."""
    out = tmp_path_factory.mktemp("fit") / "fit.json"
    assert main(["body", str(session), "--out", str(out)]) == 0
    return json.loads(out.read_text())


def test_fit_json_keeps_its_contract(fit):
    assert fit["method"] == "body_weighted"
    assert fit["rank"] == len(fit["parameters"]) == 128
    for p in fit["parameters"]:
        low, high = p["ci95"]
        assert low < p["value"] < high
        assert {"sd", "sd_robust", "rel_sd_percent", "well_identified", "unit"} <= set(p)
        assert "joint" not in p
    assert set(fit["expressions"]) == {p["name"] for p in fit["parameters"]}
    assert set(fit["motions_fitted"]) < set(MOTIONS)


def test_the_whole_mass_is_found_within_its_interval(fit, studio):
    mass = fit["parameters"][0]
    true = studio[1].parameters[:, 0].sum()
    assert mass["unit"] == "kg"
    assert abs(mass["value"] - true) < 5 * mass["sd_robust"]


@pytest.mark.study
def test_what_is_printed_fits_the_screen(session, tmp_path, capsys):
    figure = tmp_path / "check.png"
    call = ["body", str(session), "--motions", "walk", "--method", "prior"]
    assert main([*call, "--figure", str(figure)]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert max(map(len, printed)) <= 100
    assert not any("e+" in line for line in printed)
    table = next(i for i, line in enumerate(printed) if line.startswith("base parameter"))
    assert len({len(line) for line in printed[table : table + 13]}) == 1
    assert "fitted: walk" in "\n".join(printed)
    assert figure.stat().st_size > 10_000


@pytest.mark.study
def test_either_table_gives_the_same(studio, session, fit, tmp_path):
    out = tmp_path / "fit.json"
    write_motion(studio[0], tmp_path / "as_csv", "csv")
    assert main(["body", str(tmp_path / "as_csv"), "--out", str(out)]) == 0
    assert json.loads(out.read_text()) == fit


@pytest.mark.study
def test_poor_motion_is_told(session, tmp_path):
    out = tmp_path / "fit.json"
    assert main(["body", str(session), "--motions", "trunk_twist", "--out", str(out)]) == 0
    assert any("excite poorly" in w for w in json.loads(out.read_text())["warnings"])


@pytest.fixture(scope="module")
def quiet(tmp_path_factory):
    """The pelvis held on a stand, without noise."""
    folder = tmp_path_factory.mktemp("quiet") / "session"
    recording, _ = simulate_body(
        ("pelvis_still",), angle_noise_rad=0.0, force_noise_N=0.0, moment_noise_Nm=0.0
    )
    write_motion(recording, folder, "parquet")
    return folder


@pytest.mark.study
def test_motion_that_excites_too_little_is_refused_and_what_it_shows_is_not(
    quiet, refusal, tmp_path
):
    call = ("body", quiet, "--motions", "all")
    line = refusal(*call, "--out", "fit.json")
    assert "excite too little" in line
    assert "Ixx_pelvis" in line
    out = tmp_path / "fit.json"
    shows = [*call, "--what-shows", "--out", str(out)]
    assert main(list(map(str, shows))) == 0
    # the pelvis' six inertias and the height of its centre do not show while it is held
    assert json.loads(out.read_text())["rank"] == 121


def changed(recording, **how):
    """The recording with its wrenches (N, K, 6) or coordinates (N, n) put through a function."""
    return replace(
        recording,
        **{name: change(np.array(getattr(recording, name))) for name, change in how.items()},
    )


def silent_plate(wrenches):
    wrenches[:, 1] = 0.0
    return wrenches


def lifted_in_one_trial(recording):
    """One plate shows nothing in the second motion."""
    wrenches = np.array(recording.wrenches)
    wrenches[recording.samples_of(1), 0] = 0.0
    return replace(recording, wrenches=wrenches)


def y_up(wrenches):
    """x, y, z -> x, z, -y of forces and moments."""
    pairs = wrenches.reshape(*wrenches.shape[:2], 2, 3)
    turned = np.stack([pairs[..., 0], pairs[..., 2], -pairs[..., 1]], axis=-1)
    return turned.reshape(wrenches.shape)


def massless(recording):
    segments = tuple(
        replace(s, mass_kg=0.0, inertia_kgm2=np.zeros((3, 3))) for s in recording.skeleton.segments
    )
    skeleton = Skeleton(segments, recording.skeleton.markers, floating=True)
    return replace(recording, skeleton=skeleton, subject=Subject())


def first(recording, samples):
    """The first samples of the first motion."""
    return replace(
        recording,
        trials=recording.trials.iloc[:1],
        offsets=np.array([0, samples]),
        time_s=recording.time_s[:samples],
        coordinates=recording.coordinates[:samples],
        wrenches=recording.wrenches[:samples],
    )


@pytest.mark.study
@pytest.mark.parametrize(
    ("damage", "options", "says"),
    [
        (lambda r: changed(r, wrenches=silent_plate), (), ("plate 2 shows nothing", "weighs")),
        (
            lambda r: replace(r, wrenches=None, plate_origins_m=None),
            (),
            ("no force plates", "contacts"),
        ),
        (lifted_in_one_trial, (), ("trial 2 (all_joints)", "plate 1 shows nothing")),
        (lambda r: changed(r, wrenches=y_up), (), ("along y", "z up")),
        (lambda r: changed(r, wrenches=np.negative), (), ("-7", "upwards")),
        (
            lambda r: changed(r, wrenches=lambda w: w * np.repeat([1.0, 1e3], 3)),
            (),
            ("centre of pressure", "N m"),
        ),
        (lambda r: changed(r, coordinates=lambda q: 0 * q + q[:1]), (), ("nothing moves",)),
        (lambda r: first(r, 20), (), ("20 samples", "26")),
        (massless, ("--method", "prior"), ("mass",)),
        (lambda r: r, ("--cutoff-hz", "60"), ("cut-off 60 Hz", "50 Hz", "trial 1 (walk)")),
    ],
    ids=[
        *("silent plate", "no plates", "silent in one trial", "y up", "turned", "Nmm", "still"),
        *("short", "massless", "cut-off"),
    ],
)
def test_wrong_recordings_are_one_line(damage, options, says, studio, refusal, tmp_path):
    write_motion(damage(studio[0]), tmp_path / "damaged", "parquet")
    line = refusal("body", tmp_path / "damaged", *options, "--out", "fit.json")
    assert "damaged" in line
    for word in says:
        assert word in line


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--method", "magic"), ("--method magic", "weighted, consistent, ls, prior")),
        (("--motions", "jump"), ("'jump'", "walk, all_joints, trunk_twist")),
        (("--motions", "0"), ("0 motions",)),
        (("--rows", "all"), ("torque",)),
        (("--term", "viscosity"), ("terms of joints", "rows 'all'")),
        (("--longest-gap-s", "0.1"), ("gaps", "recording of markers")),
        (("--passive-joint", "knee=0"), ("'knee'", "right_elbow_flexion")),
        (("--passive-joint", "right_elbow_flexion"), ("NAME=REST_RAD",)),
        (("--passive-joint", "right_elbow_flexion=90"), ("degrees", "radians")),
        (("--prior-sd-percent", "30"), ("method 'prior'",)),
        (("--method", "prior", "--prior-sd-percent", "-3"), ("-3", "more than 0")),
        (("--cutoff-hz", "nan"), ("--cutoff-hz nan", "none")),
        (("--figure", "x.tiff"), ("x.tiff", ".png")),
        (("--out", "no/such/fit.json"), ("no/such", "existing folder")),
    ],
)
def test_wrong_options_are_one_line(options, says, session, refusal):
    line = refusal("body", session, *options)
    for word in says:
        assert word in line


def without_a_plates_columns(folder):
    lines = (folder / "samples.csv").read_text().splitlines()
    names = lines[0].split(",")
    keep = [i for i, name in enumerate(names) if not name.startswith("plate2")]
    kept = [",".join(line.split(",")[i] for i in keep) for line in lines]
    (folder / "samples.csv").write_text("\n".join(kept) + "\n")


def in_degrees(folder):
    lines = (folder / "samples.csv").read_text().splitlines()
    at = lines[0].split(",").index("right_elbow_flexion_rad")
    for row in range(1, len(lines)):
        cells = lines[row].split(",")
        cells[at] = repr(57.3 * (float(cells[at]) + 0.5))
        lines[row] = ",".join(cells)
    (folder / "samples.csv").write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (without_a_plates_columns, ("samples.csv", "plate2_fx_N", "no such column")),
        (in_degrees, ("samples.csv", "row 2", "right_elbow_flexion_rad", "degrees", "radians")),
        (lambda folder: (folder / "skeleton.json").unlink(), ("skeleton.json", "no such file")),
        (lambda folder: (folder / "trials.csv").unlink(), ("trials.csv", "No such file")),
    ],
    ids=["a plate's columns", "degrees", "skeleton", "trials"],
)
def test_wrong_folders_are_one_line(damage, says, studio, refusal, tmp_path):
    write_motion(first(studio[0], 100), tmp_path / "damaged", "csv")
    damage(tmp_path / "damaged")
    line = refusal("body", tmp_path / "damaged", "--out", "fit.json")
    for word in says:
        assert word in line


def test_other_kinds_are_one_line(limb, refusal, relaxed, tmp_path):
    from armimpedance.recordings.tables.folder import write_folder

    write_folder(limb.record(sets=1), tmp_path / "hand")
    line = refusal("body", tmp_path / "hand")
    assert "kind 'hand'" in line
    assert "'motion'" in line
    assert "kind 'hand'" in refusal("passive", tmp_path / "hand")
    line = refusal("body", relaxed)
    assert "without force plates" in line
    line = refusal("body", shutil.move(relaxed / "samples.csv", tmp_path / "samples.csv"))
    assert "samples.csv" in line
    assert "armimpedance map-columns" in line
