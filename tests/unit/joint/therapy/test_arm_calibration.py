"""The passive arm: a known truth comes back, intervals cover it, what cannot be is refused."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from arm_bench import MOVEMENTS, REST_RAD, SEGMENTS, STIFFNESS, Session, bench, heavier, repeated

from armimpedance.core.errors import InputError
from armimpedance.joint.therapy.arm.calibrate import identify_arm
from armimpedance.joint.therapy.arm.movements import movement_torques
from armimpedance.joint.therapy.robot.steady import slides
from armimpedance.joint.therapy.share.of_movement import contribution_of
from armimpedance.joint.therapy.show.models_json import read_arm, write_arm


def calibrated(session: Session, robot=None, segments=SEGMENTS, **given):
    return identify_arm(session.recording(), robot or bench(), segments, **given)


def people(rng, times=3, **given):
    """Repetitions of which each has a stiffness and rest angle of its own."""
    session = Session(**given)
    for _ in range(times):
        for movement in ("elevation", "horizontal"):
            k = STIFFNESS * (1 + 0.03 * rng.standard_normal(2))
            session.add(movement, k=k, rest=REST_RAD + 0.02 * rng.standard_normal(2))
    return session


def test_a_steady_person_comes_back():
    found = calibrated(repeated(Session()))
    for i, axis in enumerate(("elevation", "horizontal")):
        elastic = found.arm.elastic_of(axis)
        assert elastic.stiffness == pytest.approx(STIFFNESS[i], abs=2e-3)
        assert elastic.rest_rad == pytest.approx(REST_RAD[i], abs=2e-3)
        assert elastic.repeatable
    assert [(p.name, p.joint) for p in found.summary.parameters] == [
        ("k_s", 1), ("q_0", 1), ("k_s", 2), ("q_0", 2),
    ]  # fmt: skip
    # what one direction and no EMG cannot tell is all that is said
    names = ["viscosity", "viscosity", "muscles silent"]
    *untold, zero, silent, mass = found.summary.checks
    untold.append(silent)
    assert [(one.name, one.verdict) for one in untold] == [(name, "cannot tell") for name in names]
    assert (mass.name, mass.verdict) == ("mass", "ok")
    assert (zero.name, zero.verdict) == ("encoder zero", "ok")
    assert len(found.warnings) == len(names)
    for movement in found.movements:
        assert np.abs(movement.user[np.abs(movement.qd) > 0.1]).max() < 5e-3


def test_the_order_of_repetitions_and_other_conditions_do_not_matter():
    rng = np.random.default_rng(1)
    session = people(rng, wander=(0.1, 0.02), seed=1)
    alone = calibrated(session)
    session.add("elevation", condition="active", extra=lambda t, _q, _qd: 0 * t + 5.0)
    recording = session.recording()
    turned = identify_arm(recording.select([5, 3, 6, 4, 0, 2, 1]), bench(), SEGMENTS)
    for a, b in zip(alone.summary.parameters, turned.summary.parameters, strict=True):
        assert a.value == pytest.approx(b.value, rel=1e-9)
        assert a.sd_robust == pytest.approx(b.sd_robust, rel=1e-9)


def test_gradients_are_those_of_another_calibration():
    session = people(np.random.default_rng(2), seed=2)
    base = calibrated(session)
    heavy = calibrated(session, segments=heavier(SEGMENTS, 1.01))
    for a, b in zip(base.arm.elastic, heavy.arm.elastic, strict=True):
        moved = np.array([b.stiffness - a.stiffness, b.offset - a.offset])
        assert np.allclose(moved, 0.01 * a.mass_gradient, atol=1e-9)
    # of the elevation axis: coulomb, viscous, spring_0 and spring_2
    for j in (0, 1, 12, 14):
        theta = bench().identified.theta + 0.1 * (np.arange(15) == j)
        other = bench(loads=replace(bench().identified, theta=theta))
        a, b = base.arm.elastic[0], calibrated(session, other).arm.elastic[0]
        moved = np.array([b.stiffness - a.stiffness, b.offset - a.offset])
        assert np.allclose(moved, 0.1 * a.robot_gradient[:, j], atol=1e-9)


@pytest.mark.study
def test_intervals_cover_persons_whose_masses_and_robot_differ_from_what_is_believed():
    rng, covered, believed = np.random.default_rng(3), [], bench(relative_sd=0.01)
    loads = believed.identified
    for seed in range(24):
        drawn = loads.theta + np.sqrt(np.diag(loads.covariance)) * rng.standard_normal(15)
        session = people(
            rng, robot=bench(loads=replace(loads, theta=drawn)), seed=seed,
            segments=heavier(SEGMENTS, 1 + 0.03 * rng.standard_normal()),
            wander=(0.12, 0.02), noise=0.05,
        )  # fmt: skip
        found = calibrated(session, believed).summary.parameters
        truths = (STIFFNESS[0], REST_RAD[0], STIFFNESS[1], REST_RAD[1])
        covered += [p.ci95[0] <= x <= p.ci95[1] for p, x in zip(found, truths, strict=True)]
    # 96 intervals, those of one axis not independent: 3 standard errors of 48
    assert np.mean(covered) > 0.95 - 3 * np.sqrt(0.95 * 0.05 / 48)


def test_masses_and_robot_widen_the_interval_but_not_the_scatters_covariance():
    session = people(np.random.default_rng(4), seed=4)
    sure = calibrated(session, mass_sd=0.0)
    unsure = calibrated(session, bench(relative_sd=0.02), mass_sd=0.05)
    for a, b in zip(sure.axes, unsure.axes, strict=True):
        assert np.allclose(a.elastic.covariance, b.elastic.covariance)
        assert b.stiffness.sd_robust > a.stiffness.sd_robust
        assert b.stiffness.sd == pytest.approx(a.stiffness.sd)
        assert a.stiffness.sd == pytest.approx(a.stiffness.sd_robust, rel=1e-3)


def test_more_repetitions_tell_more():
    few, many = (people(np.random.default_rng(5), times, seed=5) for times in (3, 12))
    few, many = calibrated(few, mass_sd=0.0), calibrated(many, mass_sd=0.0)
    for a, b in zip(few.axes, many.axes, strict=True):
        assert b.elastic.dof > a.elastic.dof
        assert b.stiffness.sd < a.stiffness.sd


def test_repetitions_that_are_too_different_refuse_their_axis_alone():
    session = repeated(Session(), ("elevation",))
    for k, rest in ((0.4, -0.9), (1.8, 0.3), (1.0, 1.0)):
        session.add("horizontal", k=(5.0, k), rest=(1.1, rest))
    found = calibrated(session)
    horizontal, elevation = found.arm.elastic_of("horizontal"), found.arm.elastic_of("elevation")
    assert elevation.repeatable
    assert not horizontal.repeatable
    assert not horizontal.stiffness_identified
    assert not horizontal.rest_identified
    assert "too different" in horizontal.verdict
    assert any("too different" in said for said in found.warnings)


def test_an_axis_without_stiffness_has_no_rest_angle(tmp_path):
    found = calibrated(repeated(Session(wander=(0.1, 0.02), seed=6), k=(5.0, 0.003)))
    axis = found.axes[1]
    assert axis.elastic.repeatable
    assert axis.elastic.stiffness_identified
    assert not axis.elastic.rest_identified
    assert np.isnan(axis.rest.value)
    assert "q_0 not identified" in axis.elastic.verdict
    write_arm(found, tmp_path / "arm.json")
    content = json.loads((tmp_path / "arm.json").read_text())
    assert content["parameters"][3]["value"] is None
    assert read_arm(tmp_path / "arm.json").elastic_of("horizontal").verdict == axis.elastic.verdict


def test_the_reference_is_the_mean_support_of_every_repetition_while_it_moves():
    found = calibrated(people(np.random.default_rng(7), seed=7))
    (elevation, _) = found.arm.references
    ups = [m for m in found.movements if m.movement == "elevation"]
    rise = float(bench().identified.rise_rad_s[0])
    means = [m.support[slides(m.qd, rise)].mean() for m in ups]
    assert np.allclose(elevation.support_Nm, means)
    assert np.rad2deg([elevation.from_rad, elevation.to_rad]) == pytest.approx([45, 110], abs=0.1)


def test_up_and_down_separate_friction_that_the_model_misses():
    loads = bench().identified
    theta = loads.theta.copy()
    theta[0] += 0.5
    worn = bench(loads=replace(loads, theta=theta))
    both = calibrated(repeated(Session(worn), ("elevation", "lowering")))
    (axis,) = both.axes
    assert axis.direction_Nm is not None
    assert axis.direction_Nm.value == pytest.approx(0.5, abs=0.01)
    assert axis.elastic.offset == pytest.approx(-STIFFNESS[0] * REST_RAD[0], abs=0.01)
    assert {r.movement for r in both.arm.references} == {"elevation", "lowering"}
    # one way only it cannot be told from an offset
    (alone,) = calibrated(repeated(Session(worn), ("elevation",))).axes
    assert alone.direction_Nm is None
    assert alone.elastic.offset - axis.elastic.offset == pytest.approx(0.5, abs=0.01)


def test_a_person_who_is_not_passive_is_told():
    push = repeated(Session(), ("elevation",), extra=lambda t, _q, _qd: 4 * np.sin(3 * t))
    assert any("may not have been passive" in said for said in calibrated(push).warnings)
    drift = Session()
    for help_Nm in (-6.0, -3.0, 0.0):
        drift.add("elevation", extra=lambda t, _q, _qd, more=help_Nm: more + 0 * t)
    assert any("support goes from" in said for said in calibrated(drift).warnings)
    soft = repeated(Session(), ("elevation",), k=(-2.0, 0.0))
    assert any("negative" in said for said in calibrated(soft).warnings)


def test_sticking_at_either_end_does_not_matter():
    def sticks(_t, _q, qd):
        # breakaway friction above the model's, gone within .2 deg/s
        return np.sign(qd[:, 0]) * 4.0 * np.exp(-np.abs(qd[:, 0]) / np.deg2rad(0.2))

    (axis,) = calibrated(repeated(Session(), ("elevation",), extra=sticks)).axes
    assert axis.stiffness.value == pytest.approx(STIFFNESS[0], abs=0.02)
    assert axis.rest.value == pytest.approx(REST_RAD[0], abs=0.01)
    assert 0 < axis.fitted.left_out < 0.3


def test_what_cannot_be_calibrated_is_refused_in_one_line():
    session = repeated(Session(), ("elevation",)).add("horizontal").add("horizontal")
    with pytest.raises(InputError, match="2 passive repetitions of the movement horizontal") as few:
        calibrated(session)
    active = repeated(Session(), ("elevation",), condition="active")
    with pytest.raises(InputError, match="missing passive calibration") as none:
        calibrated(active)
    mixed = repeated(Session(), ("elevation", "horizontal"), 2)
    mixed.rows = [{**row, "movement": "both"} for row in mixed.rows]
    with pytest.raises(InputError, match="both is about elevation and horizontal"):
        calibrated(mixed)
    with pytest.raises(InputError, match="not known"):
        calibrated(session, bench(loads=None))
    assert all("\n" not in str(error.value) for error in (few, none))


def viscous(b):
    """An arm that resists its speed by b, N m s/rad, about whichever axis moves."""
    return lambda _t, _q, qd: b * qd[:, np.abs(qd).max(axis=0).argmax()]


def test_a_viscous_arm_moved_one_way_only_has_a_rest_angle_no_better_known_than_that():
    # .3 N m s/rad move the rest angle of the soft axis by .07 rad; nothing else is uncertain here
    found = calibrated(repeated(Session(), extra=viscous(0.3)), mass_sd=0.0)
    for axis, rest in zip(found.axes, REST_RAD, strict=True):
        assert axis.rest.ci95[0] < rest < axis.rest.ci95[1]
        assert axis.viscosity.name == "viscosity"
        assert axis.viscosity.verdict in ("cannot tell", "warning")
        assert axis.elastic.one_way == 1
    soft = found.axes[1]
    assert abs(soft.rest.value - REST_RAD[1]) > 0.06
    assert not soft.elastic.rest_identified
    # without noise the shape of the movement tells it: the message has the size
    assert soft.fitted.viscosity == pytest.approx(0.3, abs=0.01)
    assert "0.3 N m s/rad" in soft.viscosity.message


def test_up_and_down_tell_viscosity_from_the_rest_angle():
    session = repeated(Session(), ("elevation", "lowering"), extra=viscous(0.3))
    (axis,) = calibrated(session, mass_sd=0.0).axes
    assert axis.rest.value == pytest.approx(REST_RAD[0], abs=2e-3)
    assert axis.viscosity.verdict == "ok"
    assert axis.elastic.rest_identified
    assert axis.elastic.one_way == 0


def test_a_movement_against_the_calibrated_direction_is_told():
    session = repeated(Session(), ("elevation",))
    arm = calibrated(session).arm
    session.add("lowering")
    robot = bench().adjusted_to(arm.upper_arm_m)
    torques = movement_torques(session.recording(), bench(), arm)
    up, down = (contribution_of(torques[i], robot, arm) for i in (0, -1))
    assert not any(note.startswith("viscosity") for note in up.notes)
    assert any(note.startswith("viscosity") for note in down.notes)


@pytest.mark.parametrize("level", [0.02, 0.08])
def test_muscles_that_were_not_silent_refuse_the_calibration(level):
    session = repeated(Session(), ("elevation",))
    samples = sum(map(len, session.time))
    noise = np.random.default_rng(8).standard_normal((samples, 1))
    # the mean of a rectified normal signal is sqrt(2 / pi) of its sd
    emg = 0.5 * level * np.sqrt(np.pi / 2) * noise
    recording = session.recording(emg=emg, muscles=("deltoid",), emg_unit="normalised")
    if level > 0.05:
        with pytest.raises(InputError, match="deltoid at .* of its maximum"):
            identify_arm(recording, bench(), SEGMENTS)
        off = identify_arm(recording, bench(), SEGMENTS, emg_gate_percent=None)
        assert off.summary.checks[-2].verdict == "cannot tell"
        return
    silent = identify_arm(recording, bench(), SEGMENTS).summary.checks[-2]
    assert (silent.name, silent.verdict) == ("muscles silent", "ok")


def test_somebody_who_carries_half_of_the_arm_is_told_without_emg():
    def carries(_t, q, _qd):
        return -5.0 * np.sin(q[:, 0])

    found = calibrated(repeated(Session(), ("elevation",), extra=carries))
    silent = found.summary.checks[-2]
    assert (silent.name, silent.verdict) == ("muscles silent", "warning")
    assert silent.sentence in found.warnings
    # masses that are a tenth off are no such thing
    light = calibrated(repeated(Session()), segments=heavier(SEGMENTS, 1.1))
    assert light.summary.checks[-2].verdict == "cannot tell"


@pytest.mark.parametrize(
    ("off_deg", "verdict"), [(10.0, "warning"), (-10.0, "warning"), (1.0, "ok")]
)
def test_the_zero_of_one_encoder_shows_in_the_inertia_about_another_axis(
    off_deg, verdict, monkeypatch
):
    monkeypatch.setitem(MOVEMENTS, "horizontal", (1, 0.0, 90.0, 1.5))
    session = people(np.random.default_rng(4), wander=(0.1, 0.02), seed=4)
    recording = session.recording()
    read = recording.position + np.deg2rad(off_deg) * np.eye(3)[0]
    found = identify_arm(replace(recording, position=read), bench(), SEGMENTS)
    zero = next(c for c in found.summary.checks if c.name == "encoder zero")
    assert zero.verdict == verdict
    assert (zero.sentence in found.warnings) == (verdict == "warning")


def test_a_zero_cannot_be_told_where_weight_loads_every_axis():
    found = calibrated(repeated(Session(), ("elevation",)))
    zero = next(c for c in found.summary.checks if c.name == "encoder zero")
    assert zero.verdict == "cannot tell"


@pytest.mark.parametrize(("factor", "verdict"), [(1.04, "ok"), (1.2, "warning"), (0.8, "warning")])
def test_masses_of_another_body_than_the_recordings_are_named(factor, verdict):
    found = calibrated(repeated(Session(), ("elevation",)), segments=heavier(SEGMENTS, factor))
    mass = found.summary.checks[-1]
    assert (mass.name, mass.verdict) == ("mass", verdict)
    assert (mass.sentence in found.warnings) == (verdict == "warning")
