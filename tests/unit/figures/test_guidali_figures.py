"""Figures of Guidali (2013): what is drawn is what is printed, found and true.

Robot and people come from a stand-in for the simulator: the analysis' own equation with known
shares, a few short trials without static friction but for the lowest speed of the sweeps. The
simulator's stiction, controllers and people have tests of their own.
"""

from __future__ import annotations

from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording, Subject
from armimpedance.joint.therapy.arm.mockup import pipes
from armimpedance.joint.therapy.arm.passive_arm import PassiveArm, arm_bodies, segments_of
from armimpedance.joint.therapy.robot.therapy_robot import (
    Loads,
    load_torque,
    parameter_count,
    robot_bodies,
)
from armimpedance.lab.simulated.therapy import drawings_of
from armimpedance_figures.build_all import CATALOGUE
from armimpedance_figures.guidali2013 import (
    contribution_means as means,
    feedback,
    fig03_cable as fig03,
    fig05_passive_torques as fig05,
    fig06_contribution as fig06,
    printed,
    study as therapy_study,
    table3,
    table4,
)
from armimpedance_figures.source_figure import write
from manipulandum_sim.therapy.device import therapy_device
from manipulandum_sim.therapy.subject import THERAPY_SUBJECTS
from manipulandum_sim.therapy.truth import TherapyMotion, TherapyTruth

pytestmark = pytest.mark.study

OURS = {n: f for n, f in CATALOGUE.items() if n.startswith(("guidali2013", "contribution_"))}
PEOPLE = ("S5", "S4", "P2", "P6")
DEG, RATE = np.pi / 180, 1000.0
DEVICE = therapy_device()
SHARES = {"passive": 0.0, "half_active": 0.5, "active": 1.0, "resistive": -1.5}
PATIENT_SHARES = {"passive": 0.0, "active": 0.4, "resistive": -1.0}
#: Axis from 0, where the movement starts, and where it ends, deg.
MOVES = {"elevation": (0, 45.0, 110.0), "horizontal": (1, 0.0, 90.0)}
MOVE_S = 1.5


def plant():
    """The device as the analysis models it: Table 3, and a polynomial for the spring."""
    law, theta = DEVICE.friction, np.zeros(parameter_count(5))
    for i in range(5):
        k = DEVICE.cable_stiffness[i]
        theta[4 * i : 4 * i + 4] = law.coulomb[i], law.viscous[i], k, -k * DEVICE.cable_rest_rad[i]
    angle = np.linspace(*DEVICE.limits_rad[0], 50)
    theta[-3:] = np.polyfit(angle, DEVICE.spring.torque(angle), 2)[::-1]
    covariance = np.zeros((len(theta), len(theta)))
    return replace(drawings_of(DEVICE), loads=Loads(theta, covariance, np.full(5, 1e-4)))


class Bench:
    """Trials of the plant, one after another."""

    def __init__(self, seed, robot, arm=None):
        self.rng, self.robot, self.arm = np.random.default_rng(seed), robot, arm
        self.own = robot_bodies(robot)
        self.links = robot_bodies(replace(robot, motor_inertia_kgm2=np.zeros(5)))
        self.carried = None if arm is None else arm_bodies(robot, arm)
        self.rows, self.q, self.motor, self.sensor = [], [], [], []
        self.needed, self.user = [], []

    def add(self, row, motion, *, extra=0.0, stiff=0.0, user=0.0):
        """Motor torque that this motion needs; `stiff` and `user` of the moving axis."""
        q, qd, qdd = motion
        arm = np.zeros_like(q) if self.carried is None else self.carried.torque(q, qd, qdd)
        axis = row["axis"] - 1
        arm[:, axis] += stiff
        motor = self.own.torque(q, qd, qdd) + load_torque(self.robot, q, qd) + arm
        own = np.zeros_like(q)
        own[:, axis] = user * arm[:, axis]
        motor[:, axis] += extra
        motor -= own
        self.needed.append(arm)
        self.user.append(own)
        cable = DEVICE.cable_stiffness[1] * (q[:, 1] - DEVICE.cable_rest_rad[1])
        sensor = (self.links.torque(q, qd, qdd) + arm)[:, 1] + cable
        self.rows.append({"trial": len(self.rows) + 1, **row})
        self.q.append(q)
        self.motor.append(motor + 0.05 * self.rng.standard_normal(motor.shape))
        self.sensor.append(sensor + 0.02 * self.rng.standard_normal(len(sensor)))

    def true_motion(self):
        """The person's torques; what no figure looks at is 0."""
        needed, user = np.concatenate(self.needed), np.concatenate(self.user)
        courses = {f.name: 0 * user for f in fields(TherapyMotion)}
        return TherapyMotion(**courses | {"user": user, "arm": needed, "sensor": 0 * user[:, 0]})

    def recording(self, subject):
        lengths = [len(q) for q in self.q]
        return Recording(
            kind="joint",
            sample_rate_hz=RATE,
            trials=pd.DataFrame(self.rows),
            offsets=np.cumsum([0, *lengths]),
            time_s=np.concatenate([np.arange(n) / RATE for n in lengths]),
            position=np.concatenate(self.q),
            force=-np.concatenate(self.motor),
            torque="commanded",
            subject=subject,
            extra={"sensor2_Nm": np.concatenate(self.sensor)},
        )


def sweep(axis, velocity_deg_s):
    v, seconds = velocity_deg_s * DEG, 0.8
    t = np.arange(round(seconds * RATE)) / RATE
    q = np.tile(np.deg2rad([70.0, 30.0, 0.0, 60.0, 0.0]), (len(t), 1))
    q[:, axis] += v * (t - seconds / 2)
    qd = np.zeros_like(q)
    qd[:, axis] = v
    row = {"condition": "sweep", "axis": axis + 1, "velocity_deg_s": velocity_deg_s}
    return {**row, "onset_s": 0.05, "end_s": seconds - 0.05}, (q, qd, 0 * q)


def reach(start, end, seconds=MOVE_S):
    """Minimum jerk between two postures (5,), rad."""
    t = np.arange(round(seconds * RATE) + 1) / RATE / seconds
    s = 10 * t**3 - 15 * t**4 + 6 * t**5
    ds = (30 * t**2 - 60 * t**3 + 30 * t**4) / seconds
    dds = (60 * t - 180 * t**2 + 120 * t**3) / seconds**2
    way = np.subtract(end, start)
    return start + np.outer(s, way), np.outer(ds, way), np.outer(dds, way)


def calibrate(*, seed, speeds_deg_s=(0.2, 5.0, 20.0, 40.0, 60.0), held_angles=6):
    bench = Bench(seed, plant())
    for axis in range(5):
        for speed in speeds_deg_s:
            for sign in (1, -1):
                stuck = 0.3 * DEVICE.friction.coulomb[axis] * (speed < 1)
                row, motion = sweep(axis, sign * speed)
                bench.add(row, motion, extra=sign * stuck)
    for angle in np.linspace(45.0, 120.0, held_angles):
        for side in (1, -1):
            q = np.tile(np.deg2rad([angle, 30.0, 0.0, 60.0, 0.0]), (400, 1))
            row = {"condition": "hold", "axis": 1, "approach": side, "onset_s": 0.0, "end_s": 0.4}
            bench.add(row, (q, 0 * q, 0 * q), extra=side * 3.0)
    recording = bench.recording(Subject("empty", upper_arm_m=0.30))
    return recording, TherapyTruth.of("calibration", "empty", DEVICE, recording.offsets)


def validate(*, seed, trials, device=None):
    """A mismatched device has 30 % more friction here."""
    bench, rng = Bench(seed, plant()), np.random.default_rng(seed)
    for _ in range(trials):
        low, high = DEVICE.limits_rad.T
        ends = rng.uniform(low + 0.2, high - 0.2, (2, 5))
        motion = reach(*ends)
        row = {"condition": "validation", "axis": 1, "onset_s": 0.0, "end_s": MOVE_S}
        extra = 0.0 if device is None else 3.0 * np.sign(motion[1][:, 0])
        bench.add(row, motion, extra=extra)
    recording = bench.recording(Subject("empty", upper_arm_m=0.30))
    return recording, TherapyTruth.of("validation", "empty", DEVICE, recording.offsets)


def place(axis, angle_deg):
    start = np.zeros(5)
    start[0] = 60.0
    start[axis] = angle_deg
    return np.deg2rad(start)


def mockup(*, seed):
    robot = plant().adjusted_to(0.32)
    arm = PassiveArm("pipes", robot.name, 0.32, pipes(), mass_sd=0.0)
    bench = Bench(seed, robot, arm)
    for name, axis, ends in (
        ("elevation", 0, (45.0, 110.0)),
        ("lowering", 0, (110.0, 45.0)),
        ("horizontal", 1, (0.0, 90.0)),
        ("horizontal_back", 1, (90.0, 0.0)),
    ):
        for _ in range(2):
            row = {"condition": "passive", "movement": name, "axis": axis + 1}
            row |= {"onset_s": 0.0, "end_s": MOVE_S}
            bench.add(row, reach(*(place(axis, e) for e in ends)))
    recording = bench.recording(Subject("pipes", upper_arm_m=0.32))
    return recording, TherapyTruth.of("mockup", "pipes", DEVICE, recording.offsets)


def treat(subjects, seed):
    return [person(name, seed + i) for i, name in enumerate(subjects)]


def person(name, seed):
    """A session with known shares; whose trunk moves has another rest angle in each repetition."""
    someone = THERAPY_SUBJECTS[name]
    robot = plant().adjusted_to(someone.record.upper_arm_m)
    arm = PassiveArm(name, robot.name, robot.upper_arm_m, segments_of(someone.record))
    bench, rng = Bench(seed, robot, arm), np.random.default_rng(seed)
    shares, k, rest = PATIENT_SHARES if someone.patient else SHARES, [], []
    for movement, (axis, start, end) in MOVES.items():
        for condition, share in shares.items():
            for repetition in range(3):
                moved = axis == 1 and someone.trunk_moves
                k.append(np.append(someone.stiffness, np.zeros(3)))
                away = 0.01 * rng.standard_normal() + (repetition - 1.0) * moved
                rest.append(np.append(someone.rest_rad + away, np.zeros(3)))
                motion = reach(place(axis, start), place(axis, end))
                stiff = k[-1][axis] * (motion[0][:, axis] - rest[-1][axis])
                row = {"condition": condition, "movement": movement, "axis": axis + 1}
                row |= {"onset_s": 0.0, "end_s": MOVE_S, "repetition": repetition + 1}
                bench.add(row, motion, stiff=stiff, user=share)
    recording = bench.recording(someone.record)
    true = np.array([100 * shares[c] for c in recording.trials["condition"]])
    truth = TherapyTruth.of(
        "therapy", name, DEVICE, recording.offsets, bench.true_motion(), contribution=true,
        stiffness=np.array(k), rest_rad=np.array(rest),
    )  # fmt: skip
    return recording, truth


@pytest.fixture(scope="module")
def studied():
    with pytest.MonkeyPatch.context() as stand_in:
        for name, function in (
            ("simulate_calibration", calibrate),
            ("simulate_validation", validate),
            ("simulate_mockup", mockup),
            ("simulate_therapy_many", treat),
            ("VALIDATION_TRIALS", 2),
        ):
            stand_in.setattr(therapy_study, name, function)
        found = therapy_study.study("therapy", subject=",".join(PEOPLE), seed=3, sets=1)
        for part in ("robot", "validated", "mismatched", "mockup", "people"):
            getattr(found, part)
        yield found


def dictionaries(rows):
    header, *rest = rows
    return [dict(zip(header, row, strict=True)) for row in rest]


# Every figure


@pytest.mark.parametrize("name", ["fig02_friction", "fig06_contribution", "table4"])
def test_the_same_twice(name, studied, tmp_path):
    figure = OURS[f"guidali2013_{name}"]
    first, again = (
        {p.suffix: p.read_bytes() for p in write(figure, [studied], tmp_path, ["svg"])}
        for _ in range(2)
    )
    assert first == again
    assert set(first) == {".svg", ".txt", ".csv"}


@pytest.mark.parametrize("figure", OURS.values(), ids=OURS)
def test_captions_say_source_simulation_and_difference(figure, studied):
    caption = figure.caption(studied)
    assert caption.startswith(("After Guidali et al. (2013)", "The session of patient P2"))
    for part in ("Simulated: an exoskeleton", "Differs from the source: simulated"):
        assert part in caption
    for slip in ("nan", "  ", "—", "None"):
        assert slip not in caption


@pytest.mark.parametrize("figure", OURS.values(), ids=OURS)
def test_text_is_readable_and_nothing_lies_on_anything(figure, studied):
    drawn = figure.draw(studied)
    drawn.draw_without_rendering()
    for ax in drawn.axes:
        for label in (ax.get_xlabel(), ax.get_ylabel()):
            assert not label or ("(" in label and ")" in label)
        assert all(t.get_fontsize() >= 7 for t in [*ax.texts, ax.title])
        boxes = [t.get_window_extent() for t in ax.texts if t.get_text()]
        for i, box in enumerate(boxes):
            assert box.x0 >= -1
            assert box.x1 <= drawn.bbox.x1 + 1
            assert not any(overlap(box, other) for other in boxes[:i])
    for legend in drawn.legends:
        box = legend.get_window_extent()
        assert box.x0 >= 0
        assert box.x1 <= drawn.bbox.x1


def overlap(a, b, slack=1.0):
    """Whether two boxes share more than a pixel's width."""
    wide = min(a.x1, b.x1) - max(a.x0, b.x0)
    high = min(a.y1, b.y1) - max(a.y0, b.y0)
    return wide > slack and high > slack


@pytest.mark.parametrize("figure", OURS.values(), ids=OURS)
def test_csv_rows_are_as_long_as_their_header(figure, studied):
    header, *rows = figure.table(studied)
    assert rows
    assert {len(row) for row in rows} == {len(header)}
    assert len(set(header)) == len(header)


# The study


def test_all_figures_share_one_study():
    """`build` keeps what it studied by these three."""
    assert len({(f.study, f.experiments, f.subject) for f in OURS.values()}) == 1
    assert len(OURS) == 10


def test_every_part_is_simulated_when_asked_for_and_once(monkeypatch):
    calls = []

    def counted(*, seed):
        calls.append(seed)
        return calibrate(seed=seed)

    monkeypatch.setattr(therapy_study, "simulate_calibration", counted)
    lazy = therapy_study.study("therapy", subject="S5", seed=5, sets=1)
    assert not calls
    assert lazy.identified is lazy.robot.found.robot
    assert calls == [5]


def test_an_unknown_experiment_or_person_is_refused(studied):
    with pytest.raises(InputError, match="no experiment"):
        therapy_study.study("elbow", subject="S1", seed=0, sets=1)
    with pytest.raises(InputError, match="no subject 'S9'"):
        studied.person("S9")


def test_contributions_of_known_shares_lie_in_their_intervals(studied):
    """95 % intervals of 72 movements, three by three of one calibration: nearly all hold."""
    every = [m for p in studied.people for m in p.measured]
    for metric in fig06.TRUTHS:
        inside = fig06.covered(every, metric)
        assert len(inside) > 0.8 * len(every)
        assert np.mean(inside) > 0.85


def test_the_truth_is_that_of_the_samples_that_count(studied):
    for someone in studied.people:
        shares = PATIENT_SHARES if someone.group == "P" else SHARES
        for m in someone.measured:
            true = 100 * shares[m.found.condition]
            each = [m.truth_percent, m.truth_projection_percent, m.truth_share_percent]
            np.testing.assert_allclose(each, true, atol=1e-9)


def test_who_moves_the_trunk_is_refused_and_left_out(studied):
    refused = {p.name: [axis for axis, _ in p.refused] for p in studied.people}
    assert refused == {name: ["horizontal"] if name == "S4" else [] for name in PEOPLE}
    assert "S4 horizontal (no passive model)" in fig06.caption(studied)
    rows = dictionaries(fig06.table(studied))
    assert {r["movement"] for r in rows if r["subject"] == "S4"} == {"elevation"}


# Figures and tables


def test_cables_make_the_difference_at_a_speed_that_was_not_fitted(studied):
    fitted = studied.robot.recording.trials["velocity_deg_s"].abs()
    shown = fig03.sweeps_of(studied)
    assert [one.velocity_deg_s for one in shown] == [15.0, -15.0]
    assert not (fitted == 15.0).any()
    for one in shown:
        assert one.rms(cables=True) < 0.02
        # k_c over a sweep of 12 degrees about q = 30, 11 degrees off the equilibrium
        assert one.rms(cables=False) > 0.1


def test_the_sensor_needs_no_friction_model(studied):
    """Sensor and motor say the same of the support, within the sensor's noise."""
    who = studied.person("P6")
    for sensed, m in zip(
        fig05.sensor_support(studied, who), fig05.passive_of(who, "horizontal"), strict=True
    ):
        assert sensed.shape == m.support.shape
        inner = slice(len(sensed) // 10, -(len(sensed) // 10))
        np.testing.assert_allclose(sensed[inner], m.support[inner], atol=0.1)


def test_panels_of_people_who_are_not_in_the_study_are_left_out(studied):
    few = SimpleNamespace(subjects=("S5", "P6"), person=studied.person)
    assert [(a, p.name) for a, p, _ in fig05.shown(few)] == [("a", "S5"), ("d", "P6")]


def test_table_3_is_printed_true_and_found(studied):
    rows = dictionaries(table3.table(studied))
    assert len(rows) == 20
    for row in rows:
        assert float(row["true"]) == pytest.approx(float(row["printed"]), abs=1e-9)
    assert table3.cells_of(studied, "k_c")[0].error_text == "-"
    for cell in table3.cells_of(studied, "tau_c"):
        assert cell.value == pytest.approx(cell.true, abs=4 * (cell.high - cell.low))


def test_table_4_has_everybody_and_says_who_is_refused(studied):
    rows = dictionaries(table4.table(studied))
    assert len(rows) == 4 * len(PEOPLE)
    refused = {(r["subject"], r["axis"]) for r in rows if r["refused"] == "yes"}
    assert refused == {("S4", "2")}
    texts = [c.text for c in table4.cells_of(studied.person("S4"))]
    assert texts[2:] == ["refused", "refused"]
    cells = [c for p in studied.people for c in table4.cells_of(p) if not c.refused]
    assert np.mean([c.covered for c in cells if np.isfinite(c.found.value)]) > 0.8


@pytest.mark.parametrize("metric", fig06.TRUTHS)
def test_means_are_those_of_the_single_movements(metric, studied):
    singles = dictionaries(fig06.table(studied))
    for row in dictionaries(means.table(studied)):
        wanted = [
            float(s[f"{metric}_percent"])
            for s in singles
            if s["subject"][0] == row["group"]
            and (s["movement"], s["condition"]) == (row["movement"], row["condition"])
            and s[f"{metric}_valid"] == "yes"
        ]
        assert float(row[f"{metric}_mean"]) == pytest.approx(np.mean(wanted), rel=1e-4, abs=1e-4)
        assert int(row[f"{metric}_valid"]) == len(wanted)


def test_the_therapist_s_view_is_that_of_one_patient(studied):
    assert len(feedback.draw(studied).axes) == 6
    rows = dictionaries(feedback.table(studied))
    assert len(rows) == 18
    assert all(not p.movements for p in studied.people if p.name != therapy_study.SHOWN)


# What the source prints


def test_printed_means_of_elevation_recompute_and_those_of_horizontal_do_not():
    for group, means_of in printed.TABLE_4_MEANS.items():
        off = np.abs(printed.recomputed_means(group) - np.array(means_of))
        assert (off[:2] < 0.011).all()
        assert (off[2:] > 0.02).any(axis=1).all()


def test_the_print_s_third_axis_contradicts_its_own_friction():
    i = printed.TABLE_2_IMPOSSIBLE - 1
    spread = printed.TABLE_2_RMS[i] / np.sqrt(1 - printed.TABLE_2_R2[i])
    assert spread < 0.5 * printed.TABLE_3["tau_c"][i]


def test_doubtful_prints_are_the_two_known_and_are_marked(studied):
    doubtful = {key for key, value in printed.CONTRIBUTIONS.items() if value.doubt}
    assert doubtful == {("elevation", "S", "resistive"), ("horizontal", "S", "resistive")}
    texts = [t.get_text() for t in means.draw(studied).axes[0].texts]
    assert sum(t.endswith(" *") for t in texts) == 2
    known = {"S": 4, "P": 3}
    for movement in MOVES:
        for group, count in known.items():
            assert sum(k[:2] == (movement, group) for k in printed.CONTRIBUTIONS) == count
