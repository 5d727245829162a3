"""Joint-level estimates become rows: what all have is taken, what is missing is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate, Quality
from armimpedance.hand.show.results_csv import write_results
from armimpedance.muscles.models.from_estimates import joint_rows
from armimpedance.muscles.show.rows_csv import read_joint_rows

QUALITY = Quality(40, 16000, 0.979, 0.958, 2.5e4, 130.0, 12, 0.08)


def estimate(number, **changes):
    """A joint-level estimate, another for each number."""
    rng = np.random.default_rng(number)
    root = rng.normal(size=(12, 12)) / 10
    fields = {
        "level": "joint",
        "method": "exact",
        "inertia": np.eye(2),
        "viscosity": rng.normal(size=(2, 2)),
        "stiffness": rng.normal(size=(2, 2)),
        "covariance": root @ root.T,
        "dof": 39.0,
        "quality": QUALITY,
        "keys": {"condition": f"posture_{number:02d}"},
        "joint_angles": rng.normal(size=2),
        "torque": rng.normal(size=2),
        "activation": rng.uniform(size=6),
        "activation_sd": rng.uniform(size=6),
        "shared_errors": {"reflex": rng.normal(size=12), "gain x": rng.normal(size=12)},
    }
    return ImpedanceEstimate(**(fields | changes))


def test_values_and_standard_errors_are_those_of_the_estimates():
    given = [estimate(n) for n in range(4)]
    rows = joint_rows(given)
    assert rows.labels == ("posture_00", "posture_01", "posture_02", "posture_03")
    for p, one in enumerate(given):
        np.testing.assert_array_equal(rows.stiffness[p], one.stiffness)
        np.testing.assert_array_equal(rows.viscosity[p], one.viscosity)
        np.testing.assert_array_equal(rows.joint_angles[p], one.joint_angles)
        np.testing.assert_array_equal(rows.torque[p], one.torque)
        np.testing.assert_array_equal(rows.activation[p], one.activation)
        np.testing.assert_array_equal(rows.activation_sd[p], one.activation_sd)
        variance = np.diag(one.covariance)
        np.testing.assert_allclose(rows.viscosity_sd[p].ravel() ** 2, variance[4:8])
        np.testing.assert_allclose(rows.stiffness_sd[p].ravel() ** 2, variance[8:])


def test_the_same_rows_come_from_a_table_on_disk(tmp_path):
    given = [estimate(n) for n in range(3)]
    write_results(given, tmp_path / "joint.csv")
    here, there = joint_rows(given), read_joint_rows([tmp_path / "joint.csv"])
    for name in ("joint_angles", "stiffness", "viscosity", "stiffness_sd", "viscosity_sd"):
        np.testing.assert_allclose(getattr(here, name), getattr(there, name), rtol=1e-12)
    for name in ("activation", "activation_sd", "torque"):
        np.testing.assert_allclose(getattr(here, name), getattr(there, name), rtol=1e-12)
    for name, block in (("viscosity_shared", 1), ("stiffness_shared", 2)):
        np.testing.assert_array_equal(getattr(here, name), getattr(there, name))
        for p, one in enumerate(given):
            gain = one.shared_errors["gain x"].reshape(3, 2, 2)[block]
            np.testing.assert_array_equal(getattr(here, name)[p, 1], gain)


@pytest.mark.parametrize("field", ["activation", "activation_sd", "torque"])
def test_what_one_estimate_lacks_no_row_has(field):
    rows = joint_rows([estimate(0), replace(estimate(1), **{field: None})])
    assert getattr(rows, field) is None
    assert rows.n_rows == 2


def test_a_variance_of_zero_says_that_no_error_is_known():
    covariance = np.array(estimate(1).covariance)
    covariance[8, :] = covariance[:, 8] = 0.0
    rows = joint_rows([estimate(0), estimate(1, covariance=covariance)])
    assert rows.stiffness_sd is None
    assert rows.viscosity_sd is not None


def test_labels_name_all_keys():
    rows = joint_rows([estimate(0, keys={"subject": "A", "condition": "rest"})])
    assert rows.labels == ("subject A, condition rest",)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"level": "hand"}, "posture_01: an estimate at the hand level"),
        ({"joint_angles": None}, "posture_01: no joint angles"),
        ({"joint_angles": np.zeros(3)}, "posture_01: no joint angles"),
        ({"activation": np.zeros(5)}, "activation of 5 and of 6 values"),
        (
            {
                "inertia": np.eye(1),
                "viscosity": np.eye(1),
                "stiffness": np.eye(1),
                "covariance": np.eye(3),
                "shared_errors": {},
            },
            "posture_01: 1 joints",
        ),
    ],
)
def test_what_is_not_of_two_joints_is_refused_by_name(changes, words):
    with pytest.raises(InputError, match=words):
        joint_rows([estimate(0), estimate(1, **changes)])


def test_nothing_is_refused():
    with pytest.raises(InputError, match="no estimates"):
        joint_rows([])
