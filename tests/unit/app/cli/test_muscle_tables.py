"""`armimpedance predict --to moment-arms` and `--to muscle`: what OpenSim's users plot."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from armimpedance.app.cli.main import run as main
from armimpedance.limb.arm import arm_named
from armimpedance.recordings.motion.opensim_tables import read_opensim_table

#: Elbow and shoulder, m, as OpenSim 4.6 computes them in arm26.osim at the postures below
#: (opensim-models, commit 20a888b).
OPENSIM_M = {
    "TRIlong": ([-0.023467, -0.019946, -0.019877], [-0.036466, -0.030037, -0.020016]),
    "TRIlat": ([-0.023467, -0.01995, -0.019888], [0.0, 0.0, 0.0]),
    "BIClong": ([0.031615, 0.048753, 0.048494], [0.020421, 0.014596, 0.000475]),
    "BICshort": ([0.031615, 0.048753, 0.048494], [-0.012488, -0.02884, -0.033203]),
    "BRA": ([0.012577, 0.022694, 0.023969], [0.0, 0.0, 0.0]),
}
POSTURES = np.deg2rad([[20.0, 40.0], [45.0, 90.0], [80.0, 110.0]])


@pytest.fixture
def postures(tmp_path):
    file = tmp_path / "grid.csv"
    columns = ["q_shoulder_rad", "q_elbow_rad"]
    pd.DataFrame(POSTURES, columns=columns).to_csv(file, index=False)
    return file


def moment_arms(source, postures, out, *options):
    words = ["predict", source, "--postures", postures, "--to", "moment-arms", "--out", out]
    assert main([str(word) for word in (*words, *options)]) == 0
    return read_opensim_table(out) if out.suffix == ".sto" else pd.read_csv(out)


def test_signs_and_sizes_are_opensims(postures, tmp_path):
    """Selen's arms, mm, all unsigned in the source: flexors positive, extensors negative."""
    arms = moment_arms("planar6", postures, tmp_path / "arms.sto").columns
    for muscle, joint, r in (
        ("pectoralis_major", "shoulder", 0.0536),
        ("infraspinatus", "shoulder", -0.0536),
        ("biceps_long", "elbow", 0.0427),
        ("triceps_long", "elbow", -0.0300),
        ("triceps_long", "shoulder", -0.0388),
    ):
        np.testing.assert_allclose(arms[f"r_{joint}_{muscle}_m"], r, rtol=1e-12)


def test_arm26_is_what_opensim_computes(postures, tmp_path):
    """Our polynomials are 1.2 mm rms at most from the model's paths, 3 mm beyond TRIlong's kink."""
    arms = moment_arms("arm26", postures, tmp_path / "arms.sto").columns
    for muscle, (elbow, shoulder) in OPENSIM_M.items():
        np.testing.assert_allclose(arms[f"r_elbow_{muscle}_m"], elbow, atol=3e-3)
        np.testing.assert_allclose(arms[f"r_shoulder_{muscle}_m"], shoulder, atol=3e-3)


def test_one_joint_is_a_part_of_all(postures, tmp_path):
    whole = moment_arms("arm26", postures, tmp_path / "all.sto").columns
    for joint in ("shoulder", "elbow"):
        part = moment_arms("arm26", postures, tmp_path / "one.sto", "--joint", joint).columns
        assert len(part) == 6
        for muscle, values in part.items():
            np.testing.assert_array_equal(values, whole[f"r_{joint}_{muscle}_m"])


def test_every_format_holds_the_same(postures, tmp_path):
    table = moment_arms("arm26", postures, tmp_path / "arms.sto").columns
    frame = moment_arms("arm26", postures, tmp_path / "arms.csv")
    assert list(frame) == list(table)
    for name, values in table.items():
        np.testing.assert_allclose(frame[name].to_numpy(float), values, rtol=1e-13, atol=0)


def test_postures_outside_are_told(tmp_path, capsys):
    file = tmp_path / "far.csv"
    file.write_text("q_shoulder_rad,q_elbow_rad\n0.8,1.5\n-0.8,1.5\n")
    arms = moment_arms("arm26", file, tmp_path / "arms.csv")
    assert arms["extrapolated"].tolist() == [0, 1]
    assert "1 of them extrapolated" in capsys.readouterr().out


def test_stiffness_of_muscles_over_activation(tmp_path):
    """Muscles of known stiffness in one posture: what activation adds comes back."""
    arm, rng = arm_named("planar6"), np.random.default_rng(5)
    posture, active = (1.04, 1.57), np.array([52e3, 52e3, 52e3, 52e3, 26e3, 30e3])
    alpha = rng.uniform(0, 0.4, (30, 6))
    G = arm.paths.moment_arms(posture)
    K = np.einsum("mi,pm,mj->pij", G, 2e3 + alpha * active, G)
    columns = {"condition": [f"c{i}" for i in range(30)], "level": "joint"}
    columns |= {"q_shoulder_rad": posture[0], "q_elbow_rad": posture[1]}
    for symbol, A in (("K", K), ("B", K / 15)):
        columns |= {f"{symbol}_{i + 1}{j + 1}": A[:, i, j] for i in (0, 1) for j in (0, 1)}
    columns |= {f"alpha_{i + 1}": alpha[:, i] for i in range(6)}
    tension = alpha * active / arm.stiffness_per_tension
    columns |= {f"torque_{i + 1}_Nm": (-tension @ G)[:, i] for i in (0, 1)}
    rows, model, out = tmp_path / "rows.csv", tmp_path / "m.json", tmp_path / "m.sto"
    pd.DataFrame(columns).to_csv(rows, index=False)
    assert main(["fit", "activation", str(rows), "--torque", "--out", str(model)]) == 0
    words = ["predict", str(model), "--activations", str(rows), "--to", "muscle"]
    assert main([*words, "--out", str(out)]) == 0
    found = read_opensim_table(out).columns
    for i, muscle in enumerate(arm.paths.muscles):
        added = found[f"dK_{muscle}_N_per_m"]
        np.testing.assert_allclose(added, alpha[:, i] * active[i], rtol=1e-4, atol=1)
        assert (found[f"sd_dK_{muscle}_N_per_m"] >= 0).all()
        np.testing.assert_array_equal(found[f"alpha_{i + 1}"], alpha[:, i])
    refused = ["predict", str(model), "--postures", str(rows), "--to", "moment-arms"]
    assert main([*refused, "--out", str(tmp_path / "no.sto")]) == 2


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--to", "moment-arms"], "--to moment-arms without --postures"),
        (["--to", "muscle"], "--to muscle without --activations"),
        (["--joint", "elbow"], "--joint with --to joint"),
        (["--to", "muscle", "--joint", "elbow"], "--joint with --to muscle"),
        (["--to", "moment-arms", "--force", "1", "2"], "--force with --to moment-arms"),
    ],
)
def test_one_line_for_whatever_is_wrong(options, told, tmp_path, capsys):
    words = ["predict", "planar6", "--out", str(tmp_path / "arms.sto"), *options]
    assert main(words) == 2
    message = capsys.readouterr().err
    assert told in message
    assert message.count("\n") == 1
    assert not list(tmp_path.iterdir())
