"""Published tables and what follows from them."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.records import Subject
from armimpedance.limb.arm.anthropometry import DE_LEVA, WINTER, arm_of, arm_ratios, two_link_arm

PUBLISHED = Path(__file__).parents[3] / "reference_data" / "arm_segments.csv"


@pytest.mark.parametrize(
    "row",
    list(pd.read_csv(PUBLISHED, comment="#").itertuples()),
    ids=lambda r: f"{r.table}-{r.sex}-{r.segment}",
)
def test_published_rows(row):
    winter = row.table == "winter"
    ratios = WINTER if winter else arm_ratios("de_leva", row.sex)
    unit = 1.0 if winter else 0.01
    height = 1.0 if winter else {"male": 1741, "female": 1735}[row.sex]
    found = getattr(ratios, row.segment)
    assert found.length * height == pytest.approx(row.length)
    assert (found.mass, found.com) == pytest.approx((unit * row.mass, unit * row.com))
    assert found.gyration == pytest.approx(unit * row.gyration_transverse)
    if not winter:
        other = (found.gyration_sagittal, found.gyration_long)
        assert other == pytest.approx((unit * row.gyration_sagittal, unit * row.gyration_long))


def test_winter_agrees_with_his_own_row_for_forearm_and_hand():
    # Winter (1990), Table 4.1, "forearm and hand": .022 of the mass, centre at .682 of the forearm
    arm = two_link_arm(1.0, 1.0)
    assert arm.forearm_hand_kg == pytest.approx(0.022)
    assert arm.forearm_hand_com_m == pytest.approx(0.682 * 0.146, rel=0.01)


def test_winter_total_arm_mass():
    # Winter (1990), Table 4.1, "total arm": .050 of the body's mass, centre at .530 of its length
    # shoulder to styloid (.332 of the height)
    arm = two_link_arm(1.0, 1.0)
    assert arm.upper_arm_kg + arm.forearm_hand_kg == pytest.approx(0.050)
    lower = arm.forearm_hand_kg * (arm.upper_arm_m + arm.forearm_hand_com_m)
    centre = (arm.upper_arm_kg * arm.upper_arm_com_m + lower) / 0.050
    assert centre == pytest.approx(0.530 * 0.332, rel=0.05)


def test_default_lengths():
    arm = two_link_arm(65, 1.70)
    assert arm.upper_arm_m == pytest.approx(0.186 * 1.70)
    assert arm.forearm_hand_m == pytest.approx(0.34)


def test_de_leva_mean_man():
    # de Leva (1996), Table 4: 73.0 kg, 1.741 m; segment lengths 281.7, 268.9 and 86.2 mm
    arm = two_link_arm(73.0, 1.741, table="de_leva")
    assert arm.upper_arm_m == pytest.approx(0.2817)
    assert arm.forearm_hand_m == pytest.approx(0.2689 + 0.0862)
    assert arm.upper_arm_com_m == pytest.approx(0.5772 * 0.2817)
    assert arm.upper_arm_inertia_kgm2 == pytest.approx(73 * 0.0271 * (0.269 * 0.2817) ** 2)


@pytest.mark.parametrize("ratios", [WINTER, *DE_LEVA.values()])
def test_rows_are_physical(ratios):
    for row in (ratios.upper_arm, ratios.forearm, ratios.hand):
        assert 0 < row.mass < 0.04
        assert 0 < row.com < 1
        assert row.gyration > 0
        if row.gyration_sagittal is not None:
            # a rigid body: no principal moment exceeds the sum of the other two
            squares = np.array([row.gyration, row.gyration_sagittal, row.gyration_long]) ** 2
            assert (squares < squares.sum() - squares).all()


def test_one_link_replaces_forearm_and_hand():
    ratios = arm_ratios("de_leva", "female")
    mass, height = 61.9, 1.735
    forearm, hand = ratios.forearm, ratios.hand
    points, weights = [], []
    start = 0.0
    for row in (forearm, hand):
        centre, radius = start + row.com * row.length, row.gyration * row.length
        # two half masses at +- the radius of gyration have the segment's moments
        points += [centre - radius, centre + radius]
        weights += [row.mass / 2] * 2
        start += row.length
    points, weights = np.array(points) * height, np.array(weights) * mass
    arm = two_link_arm(mass, height, table="de_leva", sex="female")
    com = weights @ points / weights.sum()
    assert arm.forearm_hand_com_m == pytest.approx(com)
    assert arm.forearm_hand_inertia_kgm2 == pytest.approx(weights @ (points - com) ** 2)


def test_inertia_scales_with_mass_and_the_square_of_height():
    small, large = two_link_arm(50, 1.5), two_link_arm(100, 3.0)
    q = [1.04, 1.57]
    np.testing.assert_allclose(large.inertia(q), 8 * small.inertia(q), rtol=1e-12)


def test_measured_lengths_need_no_height():
    arm = two_link_arm(65, upper_arm_m=0.30, forearm_hand_m=0.34)
    assert (arm.upper_arm_m, arm.forearm_hand_m) == (0.30, 0.34)
    assert arm == two_link_arm(65, 1.7, upper_arm_m=0.30, forearm_hand_m=0.34)


def test_arm_of_a_subject():
    subject = Subject("A", 65, 1.70, 0.30, None)
    assert arm_of(subject) == two_link_arm(65, 1.70, upper_arm_m=0.30)
    with pytest.raises(InputError, match="no body mass"):
        arm_of(Subject("A", None, 1.70))
    with pytest.raises(InputError, match="forearm_hand_m is not known"):
        arm_of(Subject("A", 65, None, 0.30))


def test_hostile_numbers():
    with pytest.raises(InputError, match="body mass"):
        two_link_arm(-70, 1.75)
    with pytest.raises(InputError, match=r"height in m is 175"):
        two_link_arm(70, 175)
    with pytest.raises(InputError, match=r"upper_arm_m is 300"):
        two_link_arm(70, 1.75, upper_arm_m=300)
    with pytest.raises(InputError, match="unknown table"):
        two_link_arm(70, 1.75, table="dempster")
    with pytest.raises(InputError, match="unknown sex"):
        two_link_arm(70, 1.75, sex="m")
