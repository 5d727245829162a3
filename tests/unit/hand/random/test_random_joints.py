"""A wrist and an ankle of two axes: the plant against mechanics, truths within their intervals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from armimpedance.__main__ import main
from armimpedance.core.errors import EstimationError, InputError
from armimpedance.hand.random import identify_random
from armimpedance.hand.random.show import random
from armimpedance.recordings import propose_mapping
from manipulandum_sim.hand import Reflex
from manipulandum_sim.random_hand import JointRig, find_joint, simulate_random_joint

JOINTS = ("wrist", "ankle")


def energy(limb, q, qd):
    """Of a swinging segment, by its turning in space and not by the plant's equations."""
    R = Rotation.from_euler("XY", q)
    omega = np.array([qd[0] * R.inv().apply([1.0, 0, 0]) + qd[1] * np.array([0, 1.0, 0])])[0]
    away = q - limb.posture
    spring = 0.5 * away @ (limb.passive + limb.muscles) @ away
    kinetic = 0.5 * omega @ limb.inertia @ omega
    return kinetic + spring - 9.80665 * limb.down @ R.apply(limb.moment)


@pytest.mark.parametrize("joint", JOINTS)
def test_without_viscosity_energy_stays(joint):
    limb = replace(find_joint(joint, 0.02), viscosity=np.zeros((2, 2)))
    rest = limb.at(limb.posture[None], np.zeros((1, 2)), None)
    # what the muscles bear of the weight is a constant torque: its work is taken off
    q0 = limb.posture

    def gravity(q):
        still = np.zeros(2)
        springless = replace(limb, passive=np.zeros((2, 2)), muscles=np.zeros((2, 2)))
        unit = 1e-6 * np.eye(2)
        up, down = ([energy(springless, q + s * e, still) for e in unit] for s in (1, -1))
        return -(np.array(up) - np.array(down)) / 2e-6

    held = gravity(q0)
    assert np.allclose(rest.pull, 0)

    def rate(t, y):
        now = limb.at(y[None, :2], y[None, 2:], None)
        return np.concatenate([y[2:], np.linalg.solve(now.A[0], now.pull[0])])

    start = np.concatenate([q0 + [0.5, -0.4], [3.0, -4.0]])
    run = solve_ivp(rate, (0, 0.25), start, rtol=1e-10, atol=1e-12)
    total = [energy(limb, y[:2], y[2:]) + held @ (y[:2] - q0) for y in run.y.T]
    moved = np.ptp([y[2:] @ y[2:] for y in run.y.T])
    assert moved > 1
    assert np.ptp(total) < 1e-6 * abs(np.ptp([energy(limb, y[:2], 0 * q0) for y in run.y.T]))


@pytest.mark.parametrize("joint", JOINTS)
def test_the_true_stiffness_is_the_slope_of_the_torque_at_rest(joint):
    limb = find_joint(joint, 0.12)
    q, still = limb.posture, np.zeros((1, 2))
    step = 1e-4 * np.eye(2)
    pull = [[limb.at((q + s * e)[None], still, None).pull[0] for e in step] for s in (1, -1)]
    slope = -(np.array(pull[0]) - np.array(pull[1])).T / 2e-4
    assert np.allclose(slope, limb.stiffness, rtol=1e-6, atol=1e-6)
    assert np.allclose(slope, slope.T, atol=1e-6)
    # the weight's share is part of it
    assert np.abs(slope - limb.passive - limb.muscles).max() > 1e-3


def in_errors(recording, truth):
    fit = identify_random(recording)[0]
    true = np.concatenate([m.ravel() for m in (truth.M_e, truth.B_e, truth.K_e)])
    sd = np.sqrt(np.diag(fit.estimate.covariance))
    return fit, (fit.estimate.parameters - true) / sd


@pytest.mark.study
@pytest.mark.parametrize("imposed", ["position", "torque"])
@pytest.mark.parametrize("joint", JOINTS)
def test_truth_within_its_intervals(joint, imposed):
    reflex = Reflex(0.36, 0.04) if joint == "ankle" else None
    asked = {"joint": joint, "imposed": imposed, "trials": 10, "duration_s": 6.0}
    fit, z = in_errors(*simulate_random_joint(seed=11, reflex=reflex, **asked))
    assert np.abs(z).max() < 4
    assert (fit.reflex.probability > 0.5) == (reflex is not None)
    assert fit.estimate.level == "joint"
    wrong = ("lack of fit", "axes", "units")
    assert not [w for w in fit.estimate.warnings if w.startswith(wrong)]


def test_without_noise_the_truth_comes_back():
    recording, truth = simulate_random_joint(
        seed=12, noise="none", trials=3, duration_s=4.0, amplitude_rad=2e-3
    )
    one = identify_random(recording)[0].estimate
    assert np.linalg.norm(one.stiffness - truth.K_e) < 0.01 * np.linalg.norm(truth.K_e)
    assert np.linalg.norm(one.inertia - truth.M_e) < 0.01 * np.linalg.norm(truth.M_e)


def test_what_a_laboratory_forgets_is_refused_or_named():
    recording, _ = simulate_random_joint(seed=13, joint="ankle", trials=5, duration_s=4.0)
    with pytest.raises(InputError, match="torque"):
        identify_random(replace(recording, torque=None))
    with pytest.raises(InputError, match="degrees"):
        identify_random(replace(recording, position=np.degrees(recording.position)))
    told = identify_random(replace(recording, torque="commanded"))[0].estimate.warnings
    assert any("device" in w for w in told)
    milli = replace(recording, force=1e3 * recording.force)
    with pytest.raises(EstimationError, match="units"):
        identify_random(milli)
    with pytest.raises(InputError, match="tau1_perturbation_Nm"):
        identify_random(replace(recording, extra={}, imposed="torque"))


@pytest.mark.parametrize(
    "wrong", [{"joint": "knee"}, {"imposed": "force"}, {"torque_nm": 0.0}, {"trials": 0}]
)
def test_a_rig_that_cannot_be_is_refused(wrong):
    with pytest.raises(InputError):
        JointRig(**wrong)


@pytest.mark.study
@pytest.mark.parametrize("imposed", ["position", "torque"])
def test_a_laboratorys_table_in_degrees_gives_the_same(imposed, tmp_path):
    recording, _ = simulate_random_joint(seed=14, imposed=imposed, trials=5, duration_s=4.0)
    told = np.stack(list(recording.extra.values()))
    moved = imposed == "position"
    trial = np.repeat(recording.trials["trial"], np.diff(recording.offsets))
    columns = {"trial": trial, "time_ms": 1e3 * recording.time_s}
    columns |= dict(zip(["FE_deg", "RUD_deg"], np.degrees(recording.position.T), strict=True))
    columns |= dict(zip(["Torque_FE_Nm", "Torque_RUD_Nm"], -recording.force.T, strict=True))
    columns |= dict(zip(["Cmd_FE", "Cmd_RUD"], np.degrees(told) if moved else told, strict=True))
    pd.DataFrame(columns).to_csv(tmp_path / "wrist.csv", index=False)
    proposed = propose_mapping(tmp_path / "wrist.csv")
    section, unit = ("commanded", "deg") if moved else ("added_torque", "N m")
    text = proposed.text.replace('# by = "device"', 'by = "device"')
    head = f'torque = "interaction"\nperturbation = "stochastic"\nimposed = "{imposed}"\n'
    tail = f'\n[{section}]\ncolumns = ["Cmd_FE", "Cmd_RUD"]\nunit = "{unit}"\n'
    proposed.place.write_text(head + text + tail, encoding="utf-8")
    ours, theirs = (random(one)[0] for one in (recording, tmp_path / "wrist.csv"))
    assert np.allclose(ours.parameters, theirs.parameters, rtol=1e-6)


@pytest.mark.study
def test_the_commands_as_a_user_calls_them(tmp_path):
    session, table, figure = (tmp_path / name for name in ("s", "r.csv", "r.svg"))
    asked = ["--imposed", "torque", "--trials", "6", "--duration-s", "5"]
    assert main(["simulate", "ankle", *asked, "--out", str(session)]) == 0
    assert main(["random", str(session), "--out", str(table), "--figure", str(figure)]) == 0
    row = pd.read_csv(table).iloc[0]
    assert row["level"] == "joint"
    assert row["ci_low_K_11"] < 72.7 < row["ci_high_K_11"]
    assert "N m/rad" in figure.read_text()
    assert "mathdefault" not in figure.read_text()
