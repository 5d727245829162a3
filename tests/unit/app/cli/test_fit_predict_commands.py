"""`armimpedance fit` and `predict`: from tables to models to tables, and refusals in one line."""

import json

import numpy as np
import pandas as pd
import pytest

from armimpedance.app.cli.main import run as main
from armimpedance.limb.arm.muscular_arms import arm_named
from armimpedance.muscles.models.packed import matrix

ARM = arm_named("planar6")
POSTURE = (1.04, 1.57)
#: Stiffness of each muscle at rest and what full activation adds, N/m.
REST = np.array([1300.0, 1300.0, 5200.0, 5200.0, 2100.0, 2100.0])
ACTIVE = np.array([52000.0, 52000.0, 52000.0, 52000.0, 26000.0, 30000.0])


def true_stiffness(alpha):
    """``G^T K_m G`` of constant moment arms, (P, 2, 2)."""
    G = ARM.paths.moment_arms(POSTURE)
    return np.einsum("mi,pm,mj->pij", G, REST + np.asarray(alpha) * ACTIVE, G)


def table(q, K, alpha=None, torque=None):
    columns = {"condition": [f"c{i}" for i in range(len(q))], "level": "joint"}
    columns |= {"q_shoulder_rad": q[:, 0], "q_elbow_rad": q[:, 1]}
    for symbol, A in (("K", K), ("B", K / 15)):
        columns |= {f"{symbol}_{i + 1}{j + 1}": A[:, i, j] for i in (0, 1) for j in (0, 1)}
    if alpha is not None:
        columns |= {f"alpha_{i + 1}": alpha[:, i] for i in range(6)}
    if torque is not None:
        columns |= {f"torque_{i + 1}_Nm": torque[:, i] for i in (0, 1)}
    return pd.DataFrame(columns)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fits")
    rng = np.random.default_rng(5)
    q = rng.uniform([0.3, 0.7], [1.4, 2.1], (20, 2))
    K = matrix(np.array([15.0, 6.0, 16.0]) + q @ rng.normal(size=(2, 3)))
    table(q, K).to_csv(folder / "postures.csv", index=False)
    alpha = rng.uniform(0, 0.4, (30, 6))
    torque = -alpha * ACTIVE / ARM.stiffness_per_tension @ ARM.paths.moment_arms(POSTURE)
    still = np.broadcast_to(POSTURE, (30, 2))
    active = table(still, true_stiffness(alpha), alpha, torque)
    active[:10].to_csv(folder / "cocontraction.csv", index=False)
    active[10:].to_csv(folder / "force.csv", index=False)
    pd.DataFrame(q[:3], columns=["q_shoulder_rad", "q_elbow_rad"]).to_csv(
        folder / "where.csv", index=False
    )
    new = pd.DataFrame([[0.1] * 6, [0.9, *[0.1] * 5]], columns=[f"alpha_{i}" for i in range(1, 7)])
    new.to_csv(folder / "emg.csv", index=False)
    return folder


def done(*arguments):
    assert main([str(a) for a in arguments]) == 0


def refused(capsys, *arguments):
    assert main([str(a) for a in arguments]) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    return message


def test_postures_are_fitted_and_predicted(folder, tmp_path, capsys):
    model, out = tmp_path / "m.json", tmp_path / "p.csv"
    done("fit", "moment-arms", folder / "postures.csv", "--order", 1, "--out", model)
    shown = capsys.readouterr().out
    assert "K_ss" in shown
    assert max(map(len, shown.splitlines())) <= 100
    done("predict", model, "--postures", folder / "where.csv", "--out", out)
    measured, predicted = pd.read_csv(folder / "postures.csv"), pd.read_csv(out)
    for name in ("K_11", "K_12", "K_21", "K_22", "B_12"):
        assert predicted[name].to_numpy() == pytest.approx(measured[name][:3].to_numpy(), abs=1e-6)
    assert (predicted["extrapolated"] == 0).all()
    assert (predicted["level"] == "joint").all()


def test_a_posture_outside_is_flagged(folder, tmp_path, capsys):
    model, where, out = tmp_path / "m.json", tmp_path / "far.csv", tmp_path / "p.csv"
    done("fit", "moment-arms", folder / "postures.csv", "--order", 1, "--out", model)
    where.write_text("q_shoulder_rad,q_elbow_rad\n1.0,1.5\n2.5,0.4\n")
    capsys.readouterr()
    done("predict", model, "--postures", where, "--out", out)
    assert "1 of them extrapolated" in capsys.readouterr().out
    predicted = pd.read_csv(out)
    assert predicted["extrapolated"].tolist() == [0, 1]
    assert "outside" in predicted["reason"][1]


@pytest.mark.parametrize("options", [(), ("--torque",), ("--model", "bernstein", "--increasing")])
def test_activations_are_fitted_and_predicted(folder, tmp_path, options):
    model, out = tmp_path / "m.json", tmp_path / "p.csv"
    files = folder / "cocontraction.csv", folder / "force.csv"
    done("fit", "activation", *files, *options, "--out", model)
    done("predict", model, "--activations", folder / "emg.csv", "--out", out)
    alpha = pd.read_csv(folder / "emg.csv").to_numpy()
    predicted = pd.read_csv(out)
    truth = true_stiffness(alpha)
    for i, j in ((0, 0), (0, 1), (1, 1)):
        found = predicted[f"K_{i + 1}{j + 1}"].to_numpy()
        assert found == pytest.approx(truth[:, i, j], rel=1e-5)
    assert predicted["extrapolated"].tolist() == [0, 1]
    assert json.loads(model.read_text())["kind"] == "activation"


def test_at_the_hand_the_recordings_arm_is_needed(folder, tmp_path, capsys):
    model, out = tmp_path / "m.json", tmp_path / "p.csv"
    done("fit", "moment-arms", folder / "postures.csv", "--order", 1, "--out", model)
    capsys.readouterr()
    given = ("predict", model, "--postures", folder / "where.csv", "--to", "hand", "--out", out)
    assert "--recording" in refused(capsys, *given)
    session = tmp_path / "session"
    session.mkdir()
    metadata = {"format": "armimpedance-recording", "version": 1, "kind": "hand"}
    subject = {"id": "A", "upper_arm_m": 0.3, "forearm_hand_m": 0.34}
    (session / "recording.json").write_text(
        json.dumps({**metadata, "sample_rate_hz": 1000, "subject": subject})
    )
    done(*given, "--recording", session)
    hand = pd.read_csv(out)
    assert (hand["level"] == "hand").all()
    # some 15 N m/rad over a lever of some .3 m
    assert hand["K_22"].between(20, 2000).all()
    assert (hand["ci_low_K_size"] < hand["K_size"]).all()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("fit", "moment-arms", "postures.csv", "--order", "9"), "order 9"),
        (("fit", "moment-arms", "postures.csv", "--model", "cubic"), "'cubic'"),
        (("fit", "moment-arms", "postures.csv", "--torque"), "--torque with fit moment-arms"),
        (("fit", "moment-arms", "emg.csv"), "column level"),
        (("fit", "activation", "postures.csv"), "alpha"),
        (("fit", "activation", "force.csv", "--model", "sos"), "'sos'"),
        (("fit", "activation", "force.csv", "--box", "0", "1", "0", "1"), "--box with fit"),
        (("fit", "activation", "force.csv", "--arm", "lobster"), "lobster"),
        (("fit", "activation", "force.csv", "--prior-percent", "9"), "--prior-percent with fit"),
        (("fit", "muscles", "force.csv", "--prior-percent", "-9"), "prior_percent -9"),
        (("fit", "moment-arms", "missing.csv"), "missing.csv"),
        (("predict", "postures.csv", "--postures", "where.csv"), "a MODEL.json"),
    ],
)
def test_bad_calls_are_refused_and_write_nothing(folder, tmp_path, capsys, arguments, words):
    given = [folder / a if str(a).endswith(".csv") else a for a in arguments]
    out = "out.json" if arguments[0] == "fit" else "out.csv"
    message = refused(capsys, *given, "--out", tmp_path / out)
    assert words in message
    assert not list(tmp_path.iterdir())


def test_a_model_is_asked_for_what_it_has(folder, tmp_path, capsys):
    model = tmp_path / "m.json"
    done("fit", "moment-arms", folder / "postures.csv", "--order", 1, "--out", model)
    capsys.readouterr()
    given = ("predict", model, "--activations", folder / "emg.csv", "--out", tmp_path / "p.csv")
    assert "without postures" in refused(capsys, *given)
    both = (*given, "--postures", folder / "where.csv")
    assert "with activations" in refused(capsys, *both)
