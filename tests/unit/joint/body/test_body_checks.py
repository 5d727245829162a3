"""What cannot be a body on force plates in SI units is refused in one line that says why."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.core.records import Subject
from armimpedance.joint.body.checks import check_body
from armimpedance.joint.body.equations import body_equations
from armimpedance.joint.body.identify import identify_body
from armimpedance.joint.body.regressor import JointTerm
from armimpedance.joint.body.rows import RowChoice


@pytest.fixture(scope="module")
def sound(small, rigs):
    # moving little: over four seconds the mean vertical force is the weight within 2 %
    return rigs.moving(small, 4, size=0.1)[0]


def changed(recording, **how):
    """The recording with its wrenches (N, K, 6) or coordinates (N, n) put through a function."""
    return replace(
        recording,
        **{name: change(np.array(getattr(recording, name))) for name, change in how.items()},
    )


def test_a_sound_recording_passes_within_the_tolerance_and_not_below_it(sound):
    check_body(sound)
    with pytest.raises(InputError):
        check_body(sound, weight_tolerance=1e-9)


@pytest.mark.parametrize(
    ("how", "says"),
    [
        ({"wrenches": lambda w: -w}, "upwards"),
        ({"wrenches": lambda w: w[..., [2, 1, 0, 5, 4, 3]]}, "z up"),
        ({"wrenches": lambda w: 0.5 * w}, "is a plate missing"),
        ({"wrenches": lambda w: 2 * w}, "is the mass right"),
        ({"wrenches": lambda w: w * np.repeat([1.0, 1e3], 3)}, "moments in N m"),
        ({"coordinates": lambda q: q * np.array([1e3] * 3 + [1.0] * 7)}, "not millimetres"),
        (
            {"coordinates": lambda q: q * np.array([1.0] * 3 + [np.rad2deg(1.0)] * 7)},
            "radians, not degrees",
        ),
        ({"coordinates": lambda q: 0 * q + 0.1}, "nothing moves"),
    ],
)
def test_units_frames_and_signs(sound, how, says):
    with pytest.raises(InputError, match=says) as caught:
        check_body(changed(sound, **how))
    assert "\n" not in str(caught.value)


def test_the_subjects_mass_goes_before_the_skeletons(sound):
    heavy = replace(sound, subject=Subject(mass_kg=2 * sound.skeleton.mass_kg))
    with pytest.raises(InputError, match="is a plate missing"):
        check_body(heavy)


def test_no_plates(sound):
    bare = replace(sound, wrenches=None, plate_origins_m=None)
    with pytest.raises(InputError, match="no force plates"):
        check_body(bare)
    with pytest.raises(InputError, match="no force plates"):
        identify_body(bare)


def test_a_short_trial_is_named(sound):
    offsets = np.concatenate([sound.offsets[:-1], [sound.offsets[-2] + 10]])
    n = int(offsets[-1])
    short = replace(
        sound,
        offsets=offsets,
        time_s=sound.time_s[:n],
        coordinates=sound.coordinates[:n],
        wrenches=sound.wrenches[:n],
    )
    with pytest.raises(InputError, match=r"trial 3 \(motion2\): 10 samples"):
        body_equations(short, RowChoice())


def test_ends_that_leave_nothing(sound):
    with pytest.raises(InputError, match="left out at the ends"):
        body_equations(sound, RowChoice(trim_s=2.5))


def test_motions_that_excite_too_little_are_told_by_name(sound, small, rigs):
    rng = np.random.default_rng(0)
    t, q, qd, qdd = rigs.splined(len(small.coordinates), 4.0, rng)
    for x in (q, qd, qdd):
        x[:, 6:] = 0
    stiff = rigs.record(small, [(t, q)] * 2, [rigs.contact_wrench(small, q, qd, qdd)] * 2)
    with pytest.raises(NotIdentifiableError, match="motion0, motion1 excite too little"):
        identify_body(stiff, choice=RowChoice(), motions=None)
    # the parameters that they do show can be had: one rigid body has ten
    assert (
        identify_body(stiff, choice=RowChoice(), motions=None, data_dependent=True).base.rank == 10
    )


def test_what_is_asked_for_must_exist(sound):
    with pytest.raises(InputError, match="unknown method"):
        identify_body(sound, method="magic")
    with pytest.raises(InputError, match="no motion 'dance'"):
        identify_body(sound, motions=["dance"])
    with pytest.raises(InputError, match="no torque"):
        body_equations(sound, RowChoice(rows="all"))
    with pytest.raises(InputError, match="the row of forearm_flexion is not used"):
        body_equations(sound, RowChoice(terms=(JointTerm("viscosity", "forearm_flexion"),)))
    with pytest.raises(InputError, match="2 segments for 1 plates"):
        body_equations(sound, RowChoice(standing=("arm", "forearm")))
