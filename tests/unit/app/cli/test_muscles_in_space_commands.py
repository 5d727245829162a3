"""From joint rows of an arm in space to a model, its predictions and the live hand: commands."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from armimpedance.app.cli.main import run as main
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate, Quality
from armimpedance.hand.levels.show import to_joint
from armimpedance.hand.show import write_results
from armimpedance.hand.still.show import estimate
from armimpedance.muscles.models import joint_rows, matrix, triple
from armimpedance.muscles.show import free_hand_rows
from armimpedance.recordings import write_recording
from armimpedance.show.verbs.results import read_recording
from manipulandum_sim.hand import find_subject
from manipulandum_sim.space import (
    SpaceCondition,
    SpaceRig,
    SpaceTruth,
    find_space_truth,
    simulate_space,
    write_moment_arms,
)
from manipulandum_sim.space.muscles import SPACE_MUSCLES

pytestmark = pytest.mark.study

ANGLES = [f"q_{j}_rad" for j in range(1, 5)]
ALPHAS = [f"alpha_{i}" for i in range(1, 13)]
PERSON = find_subject("A")
MIDDLE, HALF = np.array([-0.8, 0.9, 0.75, 1.4]), np.array([0.35, 0.3, 0.3, 0.4])
HELD = (0, 1, 3)
#: Each joint forth, then back.
STEPS = np.vstack([np.eye(4), -np.eye(4)])


def conditions(seed: int, count: int, reach: float) -> list[SpaceCondition]:
    """Postures in a box, levels and forces that the muscles can bear."""
    rng, found = np.random.default_rng(seed), []
    while len(found) < count:
        q = MIDDLE + reach * HALF * rng.uniform(-1, 1, 4)
        one = SpaceCondition(tuple(q), rng.uniform(0.03, 0.15), tuple(rng.normal(0, 4, 3)))
        try:
            one.plant(PERSON, SpaceRig())
        except InputError:
            continue
        found.append(one)
    return found


def truth_of(asked: list[SpaceCondition], elbow: str) -> tuple[SpaceTruth, np.ndarray]:
    """The truth, and activations (P, 12)."""
    plants = [one.plant(PERSON, SpaceRig(elbow=elbow)) for one in asked]
    forces = np.array([one.force for one in asked])
    names = [str(i) for i in range(len(asked))]
    alpha = np.array([plant.tension / plant.muscles.greatest for plant in plants])
    return find_space_truth(plants, forces, names, 0.164, elbow), alpha


def joint_table(asked: list[SpaceCondition], seed: int) -> pd.DataFrame:
    """What `map --to joint` writes of hands whose elbow was held, with errors of 4 %."""
    rng, rows = np.random.default_rng(seed), []
    for one in asked:
        plant = one.plant(PERSON, SpaceRig())
        row = {"level": "joint", "muscles": "; ".join(SPACE_MUSCLES)}
        row |= dict(zip(ANGLES, plant.posture, strict=True))
        row |= dict(zip(ALPHAS, plant.tension / plant.muscles.greatest, strict=True))
        q, still, h = plant.posture + 1e-5 * STEPS, np.zeros((8, 4)), 2e-5
        torques = {
            "K": plant.torque(q, still),
            "B": plant.torque(0 * q + plant.posture, 1e-5 * STEPS),
        }
        for symbol, tau in torques.items():
            own = -((tau[:4] - tau[4:]) / h).T[np.ix_(HELD, HELD)]
            sd = 0.04 * np.sqrt(np.outer(own.diagonal(), own.diagonal()))
            e = np.triu(rng.normal(size=(3, 3)))
            noisy = (own + own.T) / 2 + sd * (e + np.triu(e, 1).T)
            for i, j in np.ndindex(3, 3):
                row |= {f"{symbol}_{i + 1}{j + 1}": noisy[i, j]}
                row |= {f"sd_{symbol}_{i + 1}{j + 1}": sd[i, j]}
        rows.append(row)
    return pd.DataFrame(rows)


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a session, moment arms of another person, joint rows and a model."""
    folder = tmp_path_factory.mktemp("lab")
    recording, _ = simulate_space(seed=1, sets=1, directions=8, emg=True)
    write_recording(recording, folder / "session")
    write_moment_arms(folder / "arms.csv", seed=1)
    joint_table(conditions(1, 24, 1.0), 1).to_csv(folder / "joint.csv", index=False)
    fit = ["fit", "muscles", "joint.csv", "--arm", "arms.csv", "--order", "1", "--out", "arm.json"]
    assert main([str(folder / a) if "." in a else a for a in fit]) == 0
    return folder


def said(lab: Path, *arguments: str) -> pd.DataFrame:
    out = lab / "said.csv"
    full = [str(lab / a) if (lab / a).exists() else a for a in arguments]
    assert main([*full, "--out", str(out)]) == 0
    return pd.read_csv(out)


def hand_of(table: pd.DataFrame, prefix: str = "") -> np.ndarray:
    names = [f"{prefix}K_{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)]
    return table[names].to_numpy().reshape(-1, 3, 3)


def test_the_hand_at_postures_never_measured_lies_in_its_bands(lab):
    asked = conditions(2, 6, 0.8)
    truth, alpha = truth_of(asked, "held")
    table = pd.DataFrame(np.hstack([truth.posture, alpha]), columns=[*ANGLES, *ALPHAS])
    table.to_csv(lab / "asked.csv", index=False)
    where = ("--postures", "asked.csv", "--activations", "asked.csv")
    found = []
    for p in range(len(asked)):
        table[p : p + 1].to_csv(lab / "asked.csv", index=False)
        force = [str(x) for x in asked[p].force]
        to_hand = ("--to", "hand", "--recording", "session", "--force", *force)
        found.append(said(lab, "predict", "arm.json", *where, *to_hand))
    rows = pd.concat(found)
    K = (truth.K_e + truth.K_e.swapaxes(1, 2)) / 2
    error = np.linalg.norm(hand_of(rows) - K, axis=(1, 2)) / np.linalg.norm(K, axis=(1, 2))
    assert np.median(error) < 0.1
    low, high = hand_of(rows, "ci_low_"), hand_of(rows, "ci_high_")
    # 36 elements, six a posture that hang together; bands allow for the prior's width, too
    assert ((low <= K) & (high >= K)).mean() > 0.9


@pytest.mark.parametrize("elbow", ["held", "free"])
def test_the_live_hand_is_the_predicted_one(lab, elbow, capsys, monkeypatch):
    joint = pd.read_csv(lab / "joint.csv")[[*ANGLES, *ALPHAS]][:5]
    joint.to_csv(lab / "asked.csv", index=False)
    options = ("--recording", "session", "--elbow", elbow)
    where = ("--postures", "asked.csv", "--activations", "asked.csv", "--to", "hand")
    rows = said(lab, "predict", "arm.json", *where, *options, "--force", "0", "-5", "3")
    lines = [
        {"q_rad": row[ANGLES].tolist(), "activation": row[ALPHAS].tolist(), "force_N": [0, -5, 3]}
        for _, row in joint.iterrows()
    ]
    sent = "\n".join(json.dumps({"time_s": k / 1000, **line}) for k, line in enumerate(lines))
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(sent.encode())))
    capsys.readouterr()
    whose = [options[0], str(lab / "session"), *options[2:]]
    assert main(["live", str(lab / "arm.json"), *whose]) == 0
    told = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert len(told) == len(rows) == 5
    K, half = hand_of(rows), hand_of(rows, "ci_high_") - hand_of(rows)
    for p, now in enumerate(told):
        if not now["definite"]:
            continue
        assert np.abs(np.array(now["K_N_m"]) - K[p]).max() < 1e-12 * np.abs(K[p]).max()
        i, j = np.triu_indices(3)
        assert now["ci95_half_N_m"] == pytest.approx(half[p][i, j], rel=1e-9)
        assert now["axes_N_m"] == pytest.approx(rows.loc[p, [f"K_axis_{a}" for a in (1, 2, 3)]])
        assert len(now["share"]) == 12
    assert elbow == "free" or all(now["definite"] for now in told)


def hand_estimates(asked: list[SpaceCondition], seed: int, error: float) -> list[ImpedanceEstimate]:
    """What `estimate` says of hands with free elbows, with errors of a part of K."""
    rng, (truth, alpha) = np.random.default_rng(seed), truth_of(asked, "free")
    K = (truth.K_e + truth.K_e.swapaxes(1, 2)) / 2
    size = np.sqrt(np.einsum("pii->pi", K))
    sd = error * size[:, :, None] * size[:, None, :]
    e = np.triu(rng.normal(size=K.shape))
    noisy = K + sd * (e + np.triu(e, 1).swapaxes(1, 2))
    quality = Quality(26, 26, 1.0, 1.0, 1.0, 1.0, 27, 0.0)
    return [
        ImpedanceEstimate(
            "hand",
            "weighted",
            truth.M_e[p],
            truth.B_e[p],
            noisy[p],
            np.diag(np.concatenate([np.ones(18), sd[p].ravel() ** 2])),
            30.0,
            quality,
            keys={"condition": str(p)},
            force=np.array(asked[p].force),
            joint_angles=truth.posture[p],
            activation=alpha[p],
            activation_sd=np.full(12, 1e-3),
            muscles=tuple(SPACE_MUSCLES),
            shared_errors={"inner mode": np.full(27, 1.0 + p)},
            warnings=("inner mode: an elbow that swivels",),
        )
        for p in range(len(asked))
    ]


@pytest.fixture(scope="module")
def free(lab: Path) -> Path:
    """The same folder with a session whose elbow was free."""
    recording = read_recording(lab / "session")
    trials = recording.trials.assign(elbow="free")
    write_recording(replace(recording, trials=trials), lab / "free")
    return lab


def test_rows_of_a_free_hand_are_what_the_plants_joints_make(free):
    asked = conditions(4, 5, 1.0)
    truth, _ = truth_of(asked, "free")
    given = hand_estimates(asked, 0, 1e-12)
    write_results(given, free / "hand.csv")
    for source in (given, free / "hand.csv"):
        rows = free_hand_rows(source, free / "free")
        # derivatives of the plant's torque, apart from the mapping; its weight's gradient is some
        # .02 N m/rad from that of the tables
        seen = matrix(rows.seen(triple(truth.K_j))[0])
        np.testing.assert_allclose(seen, rows.stiffness, atol=2e-3 * seen.max())
        assert rows.doubts == ("inner mode",)
        np.testing.assert_array_equal(rows.shared("K")[0, :, 0], 1.0 + np.arange(5))
        assert rows.muscles == tuple(SPACE_MUSCLES)
    assert free_hand_rows(rows, free / "free") is rows


def test_hands_of_a_free_elbow_tell_the_muscles_and_so_other_hands(free, capsys):
    write_results(hand_estimates(conditions(1, 24, 1.0), 1, 0.04), free / "hand.csv")
    arguments = ["fit", "muscles", str(free / "hand.csv"), "--recording", str(free / "free")]
    arguments += ["--arm", str(free / "arms.csv"), "--order", "1", "--out", str(free / "f.json")]
    assert main(arguments) == 0
    told = capsys.readouterr().out
    assert "24 rows" in told
    assert "inner mode" in told
    asked = conditions(2, 6, 0.8)
    truth, alpha = truth_of(asked, "free")
    table = pd.DataFrame(np.hstack([truth.posture, alpha]), columns=[*ANGLES, *ALPHAS])
    where = ("--postures", "asked.csv", "--activations", "asked.csv", "--to", "hand")
    found = []
    for p in range(len(asked)):
        table[p : p + 1].to_csv(free / "asked.csv", index=False)
        force = [str(x) for x in asked[p].force]
        found.append(
            said(free, "predict", "f.json", *where, "--recording", "free", "--force", *force)
        )
    rows, K = pd.concat(found), (truth.K_e + truth.K_e.swapaxes(1, 2)) / 2
    error = np.linalg.norm(hand_of(rows) - K, axis=(1, 2)) / np.linalg.norm(K, axis=(1, 2))
    assert np.median(error) < 0.1
    low, high = hand_of(rows, "ci_low_"), hand_of(rows, "ci_high_")
    assert ((low <= K) & (high >= K)).mean() > 0.9


def test_half_axes_have_the_intervals_of_small_turns_and_stretches(lab):
    rows = said(lab, "predict", "arm.json", "--postures", "joint.csv", "--activations",
                "joint.csv", "--to", "hand", "--recording", "session")  # fmt: skip
    for p in range(3):
        lengths, axes = np.linalg.eigh(hand_of(rows)[p])
        for a in (1, 2, 3):
            direction = rows.loc[p, [f"K_axis_{a}_{x}" for x in "xyz"]].to_numpy(float)
            assert abs(direction @ axes[:, 3 - a]) == pytest.approx(1)
            assert rows.loc[p, f"K_axis_{a}"] == pytest.approx(lengths[3 - a])
            low, high = (rows.loc[p, f"ci_{x}_K_axis_{a}"] for x in ("low", "high"))
            assert low < lengths[3 - a] < high
        assert rows.loc[p, "K_size"] == pytest.approx(4 / 3 * np.pi * lengths.prod())


def test_moment_arms_and_single_muscles_of_an_arm_in_space(lab):
    arms = said(lab, "predict", "arms.csv", "--postures", "joint.csv", "--to", "moment-arms")
    fitted = said(lab, "predict", "arm.json", "--postures", "joint.csv", "--to", "moment-arms")
    columns = [name for name in arms if name.startswith("r_")]
    assert len(columns) == 48
    # corrections have a prior of 20 % of each arm
    assert np.abs(arms[columns] - fitted[columns]).to_numpy().max() < 0.02
    one = said(lab, "predict", "arms.csv", "--postures", "joint.csv", "--to", "moment-arms",
               "--joint", "4")  # fmt: skip
    assert one["brachialis"].to_numpy() == pytest.approx(arms["r_4_brachialis_m"].to_numpy())
    muscles = said(lab, "predict", "arm.json", "--activations", "joint.csv", "--to", "muscle")
    assert (muscles.filter(like="K_").to_numpy() >= 0).all()


def test_a_simulated_session_has_the_activations_of_its_muscles(lab):
    recording = read_recording(lab / "session")
    rows = joint_rows([*to_joint(estimate(recording), recording=recording)])
    assert rows.moving == HELD
    assert rows.joints == 4
    plant = SpaceCondition().plant(PERSON, SpaceRig())
    true = plant.tension / plant.muscles.greatest
    off = np.abs(np.array(rows.activation)[0] - true) / np.array(rows.activation_sd)[0]
    assert np.median(off) < 2


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["fit", "moment-arms", "joint.csv"], "rows of 4 joints"),
        (["fit", "activation", "joint.csv"], "rows of 4 joints"),
        (["fit", "muscles", "joint.csv"], "an arm of 2"),
        (["fit", "muscles", "mixed.csv", "--arm", "arms.csv"], "4 of 4"),
        (["fit", "muscles", "two.csv", "--arm", "arms.csv"], "2 joints and 4 angles"),
        (["fit", "muscles", "joint.csv", "--arm", "wrong.csv"], "no smooth length"),
        (["fit", "muscles", "joint.csv", "--arm", "apart.csv"], "other postures"),
        (["fit", "muscles", "joint.csv", "--arm", "arms.csv", "--recording", "free"], "n_trials"),
        (["fit", "muscles", "one.csv", "--arm", "arms.csv", "--recording", "session"], "was held"),
        (["fit", "muscles", "flat.csv", "--arm", "arms.csv", "--recording", "free"], "2 axes"),
        (["fit", "muscles", "still.csv", "--arm", "arms.csv", "--recording", "free"], "activation"),
        (["fit", "muscles", "three.csv", "--arm", "arms.csv", "--recording", "free"], "angles"),
        (["fit", "muscles", "one.csv", "--arm", "arms.csv", "--recording", "light"], "gravity"),
        (["fit", "activation", "one.csv", "--recording", "free"], "fit activation"),
        (["predict", "arm.json", "--postures", "planar.csv", "--activations", "joint.csv"], "2"),
        (["predict", "planar6", "--postures", "joint.csv", "--to", "moment-arms"], "4 joints"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(free, capsys, arguments, problem):
    lab = free
    (one,) = hand_estimates(conditions(4, 1, 1.0), 0, 0.04)
    two = {name: getattr(one, name)[:2, :2] for name in ("inertia", "viscosity", "stiffness")}
    two |= {"inertia_with_handle": None, "covariance": np.eye(12), "shared_errors": {}}
    two |= {"force": one.force[:2]}
    for name, changed in {
        "one": {},
        "flat": two,
        "still": {"activation": None, "activation_sd": None},
        "three": {"joint_angles": one.joint_angles[:3]},
    }.items():
        write_results([replace(one, **changed)], lab / f"{name}.csv")
    light = replace(read_recording(lab / "free"), gravity_m_s2=None)
    if not (lab / "light").exists():
        write_recording(light, lab / "light")
    joint, arms = pd.read_csv(lab / "joint.csv"), pd.read_csv(lab / "arms.csv")
    pd.concat([joint, joint.assign(K_44=1.0)]).to_csv(lab / "mixed.csv", index=False)
    joint.assign(K_33=np.nan).to_csv(lab / "two.csv", index=False)
    arms.assign(G_1_m=arms["G_1_m"] + 0.03 * arms["q_2_rad"]).to_csv(lab / "wrong.csv", index=False)
    arms[:-1].to_csv(lab / "apart.csv", index=False)
    (lab / "planar.csv").write_text("q_shoulder_rad,q_elbow_rad\n1.0,1.5\n")
    full = [str(lab / a) if (lab / a).exists() else a for a in arguments]
    capsys.readouterr()
    ending = "json" if arguments[0] == "fit" else "csv"
    assert main([*full, "--out", str(lab / f"none.{ending}")]) == 2
    told = capsys.readouterr().err.strip()
    assert problem in told
    assert "\n" not in told
    assert not (lab / f"none.{ending}").exists()
