"""`armimpedance map --to muscle` as a user calls it, on a simulated session with its truth."""

import numpy as np
import pandas as pd
import pytest

from armimpedance.__main__ import main
from armimpedance.core.conventions import MUSCLES
from armimpedance.lab.parts.simulation import write_simulated
from manipulandum_sim.hand.muscles import human_paths, joint_basis
from manipulandum_sim.hand.simulate import simulate
from manipulandum_sim.hand.truth import Truth

#: The simulated joints' own springs and dampers (N m/rad, N m s/rad), beside single-joint muscles.
TISSUE = {"K": 1.0, "B": 0.2}
#: From none to the most.
LEVELS = [f"cocontraction_{percent:02d}" for percent in (0, 10, 20, 30)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A session of co-contraction, its estimates, and the subject's own arm as a table."""
    home = tmp_path_factory.mktemp("muscle")
    recording, truth = simulate("cocontraction", subject="A", seed=3, sets=2, conditions=LEVELS)
    write_simulated(recording, truth, home / "session")
    assert main(["estimate", str(home / "session"), "--out", str(home / "hand.csv")]) == 0
    write_table(home / "arm.csv")
    return home


def write_table(path, degrees=((0, 121, 10), (30, 151, 10))):
    q = np.stack(
        np.meshgrid(*(np.deg2rad(np.arange(*d)) for d in degrees), indexing="ij"), axis=-1
    ).reshape(-1, 2)
    G = np.stack(human_paths().moment_arms(joint_basis(*q.T)), axis=-1)
    rows = [
        {"muscle": name, "q_shoulder_rad": s, "q_elbow_rad": e, "G_shoulder_m": a, "G_elbow_m": b}
        for name, arms in zip(MUSCLES, G, strict=True)
        for (s, e), (a, b) in zip(q, arms, strict=True)
    ]
    pd.DataFrame(rows).to_csv(path, index=False)


def mapped(folder, out, *extra, arm="planar6", results="hand.csv"):
    call = ["map", str(folder / results), "--recording", str(folder / "session"), "--to", "muscle"]
    assert main([*call, "--arm", str(arm), "--out", str(out), *extra]) == 0
    return pd.read_csv(out).set_index("condition")


@pytest.fixture(scope="module")
def maps(folder):
    """Of the arm that is built in, and of its table: written once for all tests that read them."""
    return {
        "planar6": mapped(folder, folder / "planar6.csv"),
        "table": mapped(folder, folder / "table.csv", arm=folder / "arm.csv"),
    }


def refused(capsys, folder, *arguments):
    """The one line on stderr of a call that must exit with 2."""
    call = ["map", str(folder / "hand.csv"), "--recording", str(folder / "session")]
    capsys.readouterr()
    try:
        code = main([*call, *map(str, arguments)])
    except SystemExit as end:
        code = end.code
    lines = capsys.readouterr().err.strip().splitlines()
    assert code == 2
    assert len(lines) == 1
    return lines[0]


@pytest.mark.parametrize("kind", ["planar6", "table"])
def test_the_true_muscles_lie_in_the_ranges(folder, maps, kind):
    table = maps[kind]
    truth = Truth.read(folder / "session" / "truth.json")
    held = []
    for row, condition in enumerate(truth.conditions):
        found, G = table.loc[condition], truth.G[row]
        for symbol, k in (("K", truth.muscle_stiffness[row]), ("B", truth.muscle_viscosity[row])):
            values = dict(zip(MUSCLES, k, strict=True))
            values |= {
                "shoulder_ss": (k * G[:, 0] ** 2)[:4].sum() + TISSUE[symbol],
                "elbow_ee": (k * G[:, 1] ** 2)[:4].sum() + TISSUE[symbol],
                "two_joint_ss": (k * G[:, 0] ** 2)[4:].sum(),
                "two_joint_se": (k * G[:, 0] * G[:, 1])[4:].sum(),
                "two_joint_ee": (k * G[:, 1] ** 2)[4:].sum(),
            }
            held += [
                found[f"ci_low_{symbol}_{name}"] <= value <= found[f"ci_high_{symbol}_{name}"]
                for name, value in values.items()
            ]
    # two matrices a level, each with 3 independent numbers that may miss at 5 %
    count = 2 * len(LEVELS) * 3
    assert np.mean(held) >= 0.95 - 4 * np.sqrt(0.05 * 0.95 / count)
    assert len(held) == 2 * len(LEVELS) * 11


def test_co_contraction_stiffens_the_two_joint_muscles(maps):
    table = maps["planar6"]
    assert (np.diff(table["K_sum_se"]) > -4 * table["sd_K_sum_se"].max()).all()
    assert (
        table["feasible_low_K_two_joint_ss"].iloc[-1]
        > table["feasible_high_K_two_joint_ss"].iloc[0]
    )


def test_the_text_is_readable_and_plain(folder, tmp_path, capsys):
    capsys.readouterr()
    mapped(folder, tmp_path / "m.csv")
    printed = capsys.readouterr().out
    assert "Not identifiable: stiffness of single muscles (N/m)" in printed
    assert "4 rows written" in printed
    assert all(len(line) <= 100 for line in printed.splitlines() if "written" not in line)


def test_rows_at_the_joint_already_give_the_same(folder, maps, tmp_path):
    joint = folder / "joint.csv"
    call = ["map", str(folder / "hand.csv"), "--recording", str(folder / "session")]
    assert main([*call, "--to", "joint", "--out", str(joint)]) == 0
    a = maps["table"]
    b = mapped(folder, tmp_path / "b.csv", arm=folder / "arm.csv", results="joint.csv")
    numbers = a.select_dtypes("number").columns
    np.testing.assert_allclose(a[numbers], b[numbers], rtol=1e-9, atol=1e-9)
    # an older file without torque: it follows from the posture and the hand's force
    bare = pd.read_csv(joint).drop(columns=["torque_1_Nm", "torque_2_Nm"])
    bare.to_csv(folder / "bare.csv", index=False)
    c = mapped(folder, tmp_path / "c.csv", arm=folder / "arm.csv", results="bare.csv")
    np.testing.assert_allclose(a[numbers], c[numbers], rtol=1e-9, atol=1e-9)


def test_measured_activation_shares_the_tension(folder, maps, tmp_path):
    effort = maps["planar6"]
    emg = mapped(folder, tmp_path / "b.csv", "--share", "emg")
    column, last = "tension_biceps_long_N", "cocontraction_30"
    # least effort does not see opposing muscles, the EMG does
    assert effort.loc[last, column] < 10
    assert emg.loc[last, column] > 50


@pytest.mark.study
def test_switching_the_curvature_off(folder, tmp_path):
    on = mapped(folder, tmp_path / "a.csv", "--share", "emg", arm=folder / "arm.csv")
    off = mapped(
        folder, tmp_path / "b.csv", "--share", "emg", "--no-curvature", arm=folder / "arm.csv"
    )
    assert np.abs(on["K_sum_ss"] - off["K_sum_ss"]).max() > 0.1
    np.testing.assert_array_equal(on["B_sum_ss"], off["B_sum_ss"])


def test_wrong_calls_are_one_line(folder, tmp_path, capsys):
    out = ["--out", tmp_path / "no.csv"]
    muscle = ["--to", "muscle", *out]
    assert "--arm" in refused(capsys, folder, *muscle)
    assert "planar6" in refused(capsys, folder, *muscle, "--arm", "leg")
    assert "with --to muscle only" in refused(
        capsys, folder, "--to", "joint", *out, "--no-curvature"
    )
    assert "--share" in refused(capsys, folder, "--to", "joint", *out, "--share", "effort")
    assert "--swivel-deg" in refused(
        capsys, folder, *muscle, "--arm", "planar6", "--swivel-deg", "0"
    )
    assert "with --to muscle only" in refused(
        capsys, folder, "--to", "joint", *out, "--arm", "arm26"
    )
    assert "no such folder" in refused(
        capsys, folder, "--to", "muscle", "--arm", "planar6", "--out", tmp_path / "a" / "b.csv"
    )
    small = tmp_path / "small.csv"
    write_table(small, degrees=((0, 41, 10), (30, 151, 10)))
    told = refused(capsys, folder, *muscle, "--arm", small)
    assert "shoulder at 59" in told
    assert "0.0 to 40.0" in told
    assert "cocontraction_00" in told
    damaged = tmp_path / "damaged.csv"
    damaged.write_text(small.read_text().replace("brachialis,0.0,", "brachialis,zero,", 1))
    assert "column q_shoulder_rad" in refused(capsys, folder, *muscle, "--arm", damaged)
    assert not (tmp_path / "no.csv").exists()


def test_emg_of_other_muscles_cannot_share(folder, tmp_path, capsys):
    told = refused(
        capsys,
        folder,
        "--to",
        "muscle",
        "--arm",
        "arm26",
        "--share",
        "emg",
        "--out",
        tmp_path / "x.csv",
    )
    assert "no activation of TRIlong" in told
