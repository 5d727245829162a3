"""Muscle-level results as CSV and as text: names, empty cells, width."""

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate, Quality
from armimpedance.hand.levels.muscle_map import to_muscle
from armimpedance.hand.levels.show.muscle_estimates import muscle_text, muscles_content
from armimpedance.limb.arm.muscular_arms import arm_named
from armimpedance.limb.arm.polynomial_paths import MuscularArm, constant_paths
from armimpedance.show.files import write_content

POSSIBLE = np.array([[20.0, 8.0], [8.0, 22.0]])
IMPOSSIBLE = np.array([[20.0, -9.0], [-9.0, 22.0]])


def three_muscles():
    paths = constant_paths(("flexor", "bender", "both"), [[-0.05, 0], [0, -0.03], [0.04, 0.04]])
    box = np.array([[0.0, 2.0], [0.0, 2.0]])
    return MuscularArm("three", paths, np.full(3, 500.0), 75.0, box, "made up")


def joint(stiffness=POSSIBLE, condition="quiet", **changes):
    fields = {
        "level": "joint",
        "method": "m",
        "inertia": 0.2 * np.eye(2),
        "viscosity": np.asarray(stiffness) / 10,
        "stiffness": stiffness,
        "covariance": np.diag(np.repeat([1e-4, 0.01, 1.0], 4)),
        "dof": 39,
        "quality": Quality(40, 1000, 0.98, 0.96, 10.0, 3.0, 12, 0.1),
        "keys": {"condition": condition},
        "joint_angles": [1.0, 1.5],
        "torque": [1.0, 2.0],
    }
    return ImpedanceEstimate(**(fields | changes))


def near(value):
    """Not all versions of pandas read a text's last bit."""
    return pytest.approx(value, rel=1e-14, nan_ok=True)


@pytest.fixture
def table(tmp_path):
    def write(estimates, arm):
        path = tmp_path / "muscle.csv"
        found = [to_muscle(e, arm) for e in estimates]
        write_content(muscles_content(found), path)
        return pd.read_csv(path), found

    return write


def test_a_row_holds_what_the_estimate_holds(table):
    read, (found,) = table([joint()], arm_named("planar6"))
    row = read.iloc[0]
    assert (row["condition"], row["level"], row["arm"]) == ("quiet", "muscle", "planar6")
    assert row["n_trials"] == 40
    assert row["q_elbow_rad"] == 1.5
    assert row["tension_brachialis_N"] == near(found.tension[2])
    for symbol, share in (("K", found.stiffness), ("B", found.viscosity)):
        for c in share.combinations:
            assert row[f"{symbol}_sum_{c.name}"] == near(c.value)
            assert row[f"sd_{symbol}_sum_{c.name}"] == near(c.sd)
            assert row[f"ci_high_{symbol}_sum_{c.name}"] == near(c.high)
        for r in (*share.single, *share.groups):
            name = f"{symbol}_{r.name}"
            shown = [row[f"{p}_{name}"] for p in ("feasible_low", "feasible_high")]
            limits = [row[f"{p}_{name}"] for p in ("ci_low", "ci_high")]
            assert shown == near([r.low, r.high])
            assert limits == near([r.outer_low, r.outer_high])
        # no single muscle of six is known
        assert np.isnan(row[f"{symbol}_brachialis"])


def test_a_muscle_that_is_determined_has_its_value(table):
    read, (found,) = table([joint()], three_muscles())
    row, values = read.iloc[0], {c.name: c for c in found.stiffness.combinations}
    for name in ("flexor", "bender", "both"):
        assert row[f"K_{name}"] == near(values[name].value)
        assert row[f"sd_K_{name}"] == near(values[name].sd)
    assert row["K_both"] == pytest.approx(8 / 0.0016)


def test_what_cannot_be_stays_empty_and_is_warned_of(table):
    read, _ = table([joint(), joint(IMPOSSIBLE, "odd", torque=None)], arm_named("planar6"))
    good, odd = read.iloc[0], read.iloc[1]
    assert np.isnan(
        odd[["feasible_low_K_brachialis", "ci_high_K_two_joint_ss"]].to_numpy(float)
    ).all()
    assert np.isnan(odd["tension_brachialis_N"])
    assert odd["K_sum_se"] == pytest.approx(-9)
    assert odd["K_outside_se"] > 5
    assert "no ranges" in odd["warnings"]
    assert "torque unknown" in odd["warnings"]
    assert good["feasible_high_K_brachialis"] > 0
    assert pd.isna(good["warnings"])


def test_a_group_named_like_a_column_is_refused():
    found = to_muscle(joint(keys={"arm": "left"}), arm_named("planar6"))
    with pytest.raises(InputError, match="column arm"):
        muscles_content([found])


@pytest.mark.parametrize("name", ["planar6", "arm26"])
def test_the_text_fits_the_terminal_and_says_what_is_identifiable(name):
    long = "a very long condition with a number at its end, "
    rows = [joint(scale * POSSIBLE, f"{long}{scale}") for scale in (0.3, 1, 30)]
    rows.append(joint(IMPOSSIBLE, "odd", torque=None))
    text = muscle_text([to_muscle(row, arm_named(name)) for row in rows])
    assert max(map(len, text.splitlines())) <= 100
    assert "Identifiable: sums" in text
    assert "Not identifiable: stiffness of single muscles" in text
    assert "standard errors outside" in text
    for muscle in arm_named(name).paths.muscles:
        assert muscle[:5] in text


def test_the_text_of_an_arm_with_everything_determined_lists_values_not_ranges():
    text = muscle_text([to_muscle(joint(), three_muscles())])
    assert "Identifiable: stiffness of single muscles (N/m)" in text
    assert "Not identifiable" not in text
    assert "5000 ±" in text
