"""The arms that come with the package, against the numbers that they were made from."""

import csv
from pathlib import Path

import numpy as np
import pytest

from armimpedance.core.conventions import MUSCLE_SIGNS, MUSCLES
from armimpedance.core.errors import InputError
from armimpedance.limb.arm.muscular_arms import ARMS, arm_named

ARM26 = Path(__file__).resolve().parents[3] / "reference_data" / "arm26_moment_arms.csv"


COUNTS = {"planar6": 6, "arm26": 6, "myoarm4": 30, "myoarm7": 32}


@pytest.mark.parametrize("name", ARMS)
def test_every_arm_is_whole(name):
    arm = arm_named(name)
    assert arm.name == name
    assert len(arm.paths.muscles) == COUNTS[name]
    assert (arm.max_tension > 0).all()
    assert (arm.angle_range[:, 1] > arm.angle_range[:, 0]).all()
    assert arm.source


def test_planar6_has_the_signs_of_the_convention_and_the_published_arms():
    arm = arm_named("planar6")
    assert arm.paths.muscles == MUSCLES
    G = arm.paths.moment_arms([1.04, 1.57])
    np.testing.assert_array_equal(np.sign(G), MUSCLE_SIGNS)
    # Selen et al. 2009, Table 1: the two-joint muscles
    np.testing.assert_allclose(np.abs(G[4:]), [[0.0386, 0.0427], [0.0388, 0.0300]], atol=1e-15)
    assert arm.stiffness_per_tension == 75


def test_arm26_meets_the_model_s_own_moment_arms():
    arm = arm_named("arm26")
    with ARM26.open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(line for line in stream if not line.startswith("#")))
    assert len(rows) == 20
    apart = np.zeros((len(rows), 2))
    for error, row in zip(apart, rows, strict=True):
        q = np.deg2rad([float(row["shoulder_deg"]), float(row["elbow_deg"])])
        wanted = [float(row["G_shoulder_m"]), float(row["G_elbow_m"])]
        found = arm.paths.moment_arms(q)[arm.paths.muscles.index(row["muscle"])]
        error[:] = found - wanted
    # on the whole grid the largest rms is 1.19 mm, the largest difference 2.4 mm
    assert np.sqrt(np.mean(apart**2, axis=0)).max() < 1.0e-3
    assert np.abs(apart).max() < 2.4e-3


def test_arm26_flexors_shorten_as_the_elbow_bends_and_triceps_lengthens():
    arm = arm_named("arm26")
    q = np.stack(np.meshgrid(*[np.linspace(*r, 9) for r in arm.angle_range]), axis=-1)
    columns = np.moveaxis(arm.paths.moment_arms(q)[..., 1], -1, 0)
    elbow = dict(zip(arm.paths.muscles, columns, strict=True))
    for name in ("BIClong", "BICshort", "BRA"):
        assert elbow[name].max() < -0.01
    for name in ("TRIlong", "TRIlat", "TRImed"):
        assert elbow[name].min() > 0.015


@pytest.mark.parametrize("name", ["planar7", "", "no/such/table.csv"])
def test_an_unknown_arm_is_refused(name):
    with pytest.raises(InputError) as told:
        arm_named(name)
    assert "\n" not in str(told.value)
