"""`armimpedance elbow` as a user calls it: what it writes, and what it refuses in one line."""

from __future__ import annotations

import csv
import json
import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.__main__ import main
from armimpedance.recordings.tables.folder import write_folder
from manipulandum_sim.elbow.bench import simulate_bench
from manipulandum_sim.elbow.simulate import simulate_elbow

JOINT = (0.07, 1.2, 20.0)
METHODS = ("arx", "iv", "output-error", "derivative")


@pytest.fixture(scope="module")
def bench():
    return simulate_bench(*JOINT, trials=2, duration_s=8.0, snr_db=35.0, seed=5)[0]


@pytest.fixture(scope="module")
def bench_folder(bench, tmp_path_factory):
    folder = tmp_path_factory.mktemp("elbow") / "bench"
    write_folder(bench, folder, table="csv")
    return folder


@pytest.fixture
def damaged(bench, tmp_path):
    """Write the bench's recording with some of its fields changed."""

    def write(**changes):
        write_folder(replace(bench, **changes), tmp_path / "damaged")
        return tmp_path / "damaged"

    return write


@pytest.fixture(scope="module")
def levels(tmp_path_factory):
    """Trials at levels of co-contraction, with raw EMG, on disk."""
    folder = tmp_path_factory.mktemp("levels") / "levels"
    recording, _ = simulate_elbow("cocontraction", repetitions=1, noise="sensor", duration_s=4.0)
    write_folder(recording, folder)
    return recording, folder


def fit_of(folder, out, *options):
    assert main(["elbow", str(folder), "--out", str(out), *options]) == 0
    return json.loads(out.read_text())


@pytest.mark.parametrize("method", METHODS)
def test_fit_json_holds_the_contract_and_the_truth(bench_folder, method, tmp_path, capsys):
    fit = fit_of(bench_folder, tmp_path / "fit.json", "--method", method)
    assert fit["method"] == method
    assert [p["name"] for p in fit["parameters"]] == ["I", "B", "K"]
    assert {"n", "cond_raw", "cond_scaled", "rank", "r2", "vaf", "warnings"} <= set(fit)
    for parameter, truth in zip(fit["parameters"], JOINT, strict=True):
        assert parameter["joint"] == 1
        low, high = parameter["ci95"]
        assert low < parameter["value"] < high
        # 16 s at 35 dB; four standard errors of a fit that is said to be that sure
        assert abs(parameter["value"] - truth) < 4 * parameter["sd_robust"]
        assert parameter["value"] == pytest.approx(truth, rel=0.1)
    assert [part["part"] for part in fit["parts"]] == ["trial 1", "trial 2"]
    text = capsys.readouterr().out
    assert "signal to noise: torque 3" in text
    assert max(map(len, text.splitlines())) <= 100


def test_a_torque_by_the_device_is_turned_by_the_reader(bench, tmp_path):
    folder = tmp_path / "foreign"
    write_folder(bench, folder, table="csv")
    about = json.loads((folder / "recording.json").read_text())
    (folder / "recording.json").write_text(json.dumps(about | {"force_by": "device"}))
    table = pd.read_csv(folder / "samples.csv")
    table["tau1_Nm"] *= -1
    table.to_csv(folder / "samples.csv", index=False)
    fit = fit_of(folder, tmp_path / "fit.json")
    assert fit["parameters"][2]["value"] == pytest.approx(JOINT[2], rel=0.1)


@pytest.mark.study
def test_conditions_are_told_apart(bench, tmp_path, capsys):
    other = simulate_bench(0.07, 1.2, 60.0, trials=2, duration_s=8.0, snr_db=35.0, seed=6)[0]
    trials = pd.DataFrame({"trial": range(1, 5), "condition": ["soft"] * 2 + ["stiff"] * 2})
    both = replace(
        bench,
        trials=trials,
        offsets=np.concatenate([bench.offsets, bench.offsets[-1] + other.offsets[1:]]),
        **{
            name: np.concatenate([getattr(bench, name), getattr(other, name)])
            for name in ("time_s", "position", "force")
        },
        extra={k: np.concatenate([v, other.extra[k]]) for k, v in bench.extra.items()},
    )
    write_folder(both, tmp_path / "both")
    fit = fit_of(tmp_path / "both", tmp_path / "fit.json")
    assert any("pooled" in warning and "K from" in warning for warning in fit["warnings"])
    stiffness = {p["part"]: p["parameters"][2]["value"] for p in fit["parts"]}
    assert stiffness["soft"] == pytest.approx(20, rel=0.1)
    assert stiffness["stiff"] == pytest.approx(60, rel=0.1)
    one = fit_of(tmp_path / "both", tmp_path / "one.json", "--condition", "stiff")
    assert one["parameters"][2]["value"] == pytest.approx(60, rel=0.1)
    assert not any("pooled" in warning for warning in one["warnings"])


@pytest.mark.study
def test_the_commanded_torque_moves_arm_and_device(tmp_path):
    for torque in ("interaction", "commanded"):
        recording, truth = simulate_elbow(
            "posture", repetitions=2, noise="sensor", torque=torque, duration_s=6.0
        )
        write_folder(recording, tmp_path / torque)
    limb = fit_of(tmp_path / "interaction", tmp_path / "limb.json")
    both = fit_of(tmp_path / "commanded", tmp_path / "both.json")
    assert limb["parameters"][0]["value"] == pytest.approx(truth.I, rel=0.1)
    device = both["parameters"][0]["value"] - limb["parameters"][0]["value"]
    assert device == pytest.approx(truth.device_inertia, rel=0.25)
    assert any("arm and device" in warning for warning in both["warnings"])
    assert not any("arm and device" in warning for warning in limb["warnings"])


@pytest.mark.study
@pytest.mark.parametrize("method", ["windows", "quadratic", "smoother", "spline"])
def test_the_course_is_a_csv_with_bands(bench_folder, method, tmp_path):
    out = tmp_path / "course.csv"
    assert main(["elbow", str(bench_folder), "--time-varying", method, "--out", str(out)]) == 0
    with open(out, newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert {"time_s", "B", "K", "ci_low_B", "ci_high_B", "ci_low_K", "ci_high_K"} <= set(rows[0])
    assert {row["trial"] for row in rows} == {"1", "2"}
    K = np.array([float(row["K"]) for row in rows])
    inside = np.mean([float(r["ci_low_K"]) < JOINT[2] < float(r["ci_high_K"]) for r in rows])
    assert K.mean() == pytest.approx(JOINT[2], rel=0.1)
    assert inside > 0.5


@pytest.mark.study
def test_a_figure_is_drawn_where_it_was_asked_for(bench_folder, levels, tmp_path):
    for name, options in (
        ("fit", [str(bench_folder)]),
        ("course", [str(bench_folder), "--time-varying", "windows"]),
        ("law", [str(levels[1]), "--emg-law"]),
    ):
        assert main(["elbow", *options, "--figure", str(tmp_path / f"{name}.png")]) == 0
        assert (tmp_path / f"{name}.png").read_bytes().startswith(b"\x89PNG")


def test_the_law_over_emg_is_written_with_its_points(levels, tmp_path, capsys):
    calibration, _ = simulate_elbow("calibration", repetitions=1, duration_s=2.0)
    write_folder(calibration, tmp_path / "calibration")
    law = fit_of(
        levels[1], tmp_path / "law.json", "--emg-law", "--imcj", str(tmp_path / "calibration")
    )
    names = [p["name"] for p in law["parameters"]]
    assert names == ["k0", "k_biceps", "k_triceps", "b0", "b_biceps", "b_triceps"]
    assert len(law["points"]) == levels[0].n_trials
    assert all(point["imcj_Nm"] > 0 for point in law["points"])
    assert "IMCJ (N m)" in capsys.readouterr().out


def test_raw_samples_are_refused_for_arx_before_the_fit(bench_folder, refusal):
    said = refusal(
        "elbow", bench_folder, "--method", "arx", "--cutoff-hz", "none", "--decimation", "1",
        "--out", "fit.json",
    )  # fmt: skip
    assert "raw samples" in said
    assert "expected a low-pass" in said


@pytest.mark.parametrize(
    ("options", "match"),
    [
        (["--method", "nonsense"], "iv, arx, derivative, output-error"),
        (["--time-varying", "nonsense"], "windows"),
        (["--time-varying", ""], "windows"),
        (["--cutoff-hz", "500"], "between 0 and 500 Hz"),
        (["--cutoff-hz", "700"], "between 0 and 500 Hz"),
        (["--cutoff-hz", "-1"], "--cutoff-hz -1"),
        (["--cutoff-hz", "ten"], "--cutoff-hz ten"),
        (["--decimation", "0"], "--decimation 0"),
        (["--decimation", "2.5"], "--decimation 2.5"),
        (["--lowest-hz", "0"], "--lowest-hz 0"),
        (["--lowest-hz", "400"], "400"),
        (["--lowest-hz", "2", "--method", "arx"], "arx"),
        (["--time-varying", "windows", "--lowest-hz", "2"], "--lowest-hz"),
        (["--time-varying", "windows", "--decimation", "2"], "--decimation"),
        (["--joint", "2"], "no joint 2"),
        (["--condition", "other"], "bench"),
        (["--emg-law"], "no EMG"),
        (["--time-varying", "emg"], "no EMG"),
        (["--time-varying", "windows", "--emg-law"], "one of them"),
        (["--time-varying", "windows", "--method", "iv"], "without --time-varying"),
        (["--time-varying", "windows", "--window-s", "-1"], "window"),
        (["--time-varying", "windows", "--window-s", "100"], "window"),
        (["--time-varying", "smoother", "--window-s", "1"], "windows or quadratic"),
        (["--time-varying", "smoother", "--cutoff-hz", "none"], "--cutoff-hz none"),
        (["--time-varying", "smoother", "--cutoff-hz", "600"], "500 Hz"),
        (["--emg-cutoff-hz", "6"], "--time-varying emg"),
        (["--emg-cutoff-hz", "0", "--time-varying", "emg"], "--emg-cutoff-hz 0"),
        (["--imcj", "there"], "--emg-law"),
        (["--flexor", "biceps"], "EMG"),
        (["--figure", "drawing.gif"], ".png"),
        (["--out", "no/such/folder/fit.json"], "no such folder"),
    ],
    ids=lambda v: " ".join(v) if isinstance(v, list) else "",
)
def test_a_wrong_call_is_one_line(bench_folder, refusal, options, match):
    out = [] if "--out" in options else ["--out", "fit.json"]
    assert match in refusal("elbow", bench_folder, *options, *out)


def test_a_recording_that_does_not_say_which_torque_it_holds(damaged, refusal):
    said = refusal("elbow", damaged(torque=None), "--out", "fit.json")
    assert "interaction" in said
    assert "commanded" in said


def test_a_hand_is_refused(tmp_path, damaged, refusal):
    folder = damaged()
    text = json.loads((folder / "recording.json").read_text()) | {"kind": "hand"}
    (folder / "recording.json").write_text(json.dumps(text))
    refusal("elbow", folder, "--out", "fit.json")


def a_clipped_angle(recording):
    limit = np.quantile(np.abs(recording.position), 0.8)
    return {"position": np.clip(recording.position, -limit, limit)}


def a_clipped_torque(recording):
    return {"force": np.clip(recording.force, -np.inf, np.quantile(recording.force, 0.85))}


def a_still_joint(recording):
    return {"position": np.zeros_like(recording.position)}


def the_wrong_sign(recording):
    return {"force": -recording.force}


def a_noisy_angle(recording):
    rng = np.random.default_rng(0)
    noise = rng.standard_normal(recording.position.shape)
    return {"position": recording.position + 2 * recording.position.std() * noise}


DAMAGES = [
    (a_clipped_angle, "angle"),
    (a_clipped_torque, "torque"),
    (a_still_joint, "angle"),
    (a_noisy_angle, "dB"),
    (the_wrong_sign, "sign"),
]


def each_with_each(damages, methods):
    """Every damage with another method first, then the other pairs."""
    return [
        pytest.param(*damage, methods[(i + turn) % len(methods)])
        for turn in range(len(methods))
        for i, damage in enumerate(damages)
    ]


@pytest.mark.first_cases(len(DAMAGES))
@pytest.mark.parametrize(("damage", "match", "method"), each_with_each(DAMAGES, METHODS))
def test_a_damaged_recording_is_one_line(bench, damaged, refusal, damage, match, method):
    folder = damaged(**damage(bench))
    assert match in refusal("elbow", folder, "--method", method, "--out", "fit.json")


@pytest.mark.first_cases(len(DAMAGES[:4]))
@pytest.mark.parametrize(
    ("damage", "match", "method"),
    each_with_each(DAMAGES[:4], ("windows", "quadratic", "smoother", "spline")),
)
def test_a_damaged_recording_has_no_course(bench, damaged, refusal, damage, match, method):
    folder = damaged(**damage(bench))
    assert match in refusal("elbow", folder, "--time-varying", method, "--out", "course.csv")


def test_a_gap_in_the_samples_names_its_row(bench_folder, tmp_path, refusal):
    folder = shutil.copytree(bench_folder, tmp_path / "gap")
    lines = (folder / "samples.csv").read_text().splitlines()
    (folder / "samples.csv").write_text("\n".join(lines[:2000] + lines[2100:]) + "\n")
    said = refusal("elbow", folder, "--out", "fit.json")
    assert "samples.csv, row 2001" in said


@pytest.mark.parametrize("word", ["nan", "inf", "", "x"])
def test_a_value_that_is_no_number_names_its_row(bench_folder, tmp_path, refusal, word):
    folder = shutil.copytree(bench_folder, tmp_path / "gap")
    lines = (folder / "samples.csv").read_text().splitlines()
    cells = lines[500].split(",")
    lines[500] = ",".join([*cells[:2], word, *cells[3:]])
    (folder / "samples.csv").write_text("\n".join(lines) + "\n")
    assert "row 501" in refusal("elbow", folder, "--out", "fit.json")


def test_a_short_trial_is_refused(bench, tmp_path, refusal):
    short = simulate_bench(*JOINT, trials=1, duration_s=0.5, snr_db=35.0)[0]
    write_folder(short, tmp_path / "short")
    for options in ([], ["--time-varying", "smoother"]):
        assert " s" in refusal("elbow", tmp_path / "short", *options, "--out", "fit.json")


def flat(emg, _trials):
    emg[:, 1] = 0.0


def saturated(emg, _trials):
    emg[:, 0] = np.clip(emg[:, 0], *np.quantile(emg[:, 0], [0.1, 0.9]))


def no_maximum(_emg, trials):
    trials["mvc_biceps_V"] = 0.0


def unknown_maximum(_emg, trials):
    del trials["mvc_triceps_V"]


@pytest.mark.parametrize(
    ("damage", "muscle"),
    [(flat, "triceps"), (saturated, "biceps"), (no_maximum, "biceps"), (unknown_maximum, "tric")],
)
@pytest.mark.parametrize("options", [["--emg-law"], ["--time-varying", "emg"]], ids=" ".join)
def test_emg_that_cannot_be_used_names_the_muscle(
    levels, tmp_path, refusal, damage, muscle, options
):
    recording, _ = levels
    emg, trials = recording.emg.copy(), recording.trials.copy()
    damage(emg, trials)
    write_folder(replace(recording, emg=emg, trials=trials), tmp_path / "levels")
    assert muscle in refusal("elbow", tmp_path / "levels", *options, "--out", "out.json")


def test_muscles_that_are_not_there_are_refused(levels, refusal):
    for options in (["--flexor", "biceps"], ["--flexor", "deltoid", "--extensor", "triceps"]):
        said = refusal("elbow", levels[1], "--emg-law", *options, "--out", "law.json")
        assert "flexor and extensor, each naming one" in said


def test_a_law_of_one_level_is_refused(levels, tmp_path, refusal):
    posture, _ = simulate_elbow("posture", repetitions=4, noise="sensor", duration_s=2.0)
    write_folder(posture, tmp_path / "one")
    said = refusal("elbow", tmp_path / "one", "--emg-law", "--out", "law.json")
    assert "amplitude" in said
