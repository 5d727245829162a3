"""A simulated session as Kinarm exams: every door gives the same, and what was simulated."""

from __future__ import annotations

import zipfile
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.still.show import estimate
from armimpedance.recordings.kinarm.exam import read_kinarm
from armimpedance.recordings.kinarm.trials import Choice
from manipulandum_sim.hand import IDEAL, simulate
from manipulandum_sim.lab_files import write_kinarm_archive, write_kinarm_c3d

TIMED = Choice(onset_event="PERTURB_ON", end_event="PERTURB_OFF")


@pytest.fixture(scope="module")
def session():
    recording, _ = simulate(
        "cocontraction", seed=18, sets=2, conditions=["cocontraction_00"], servo=IDEAL
    )
    return recording


def read(path, session):
    channels = {f"ACH{i}": muscle for i, muscle in enumerate(session.muscles, start=1)}
    return read_kinarm(path, choice=TIMED, emg_channels=channels)


def assert_close(read_back, session):
    """What was simulated, to single precision."""
    for name, within in (("position", 2e-7), ("force", 1e-5), ("emg", 1e-9), ("time_s", 1e-12)):
        np.testing.assert_allclose(
            getattr(read_back, name), getattr(session, name), atol=within, err_msg=name
        )
    np.testing.assert_array_equal(read_back.offsets, session.offsets)
    for column in ("trial", "condition", "set", "direction_deg", "onset_s", "end_s"):
        assert read_back.trials[column].tolist() == session.trials[column].tolist()


def test_every_door_gives_the_same_to_the_last_bit(session, tmp_path):
    write_kinarm_c3d(session, tmp_path / "exam.zip")
    write_kinarm_c3d(session, tmp_path / "exam")
    write_kinarm_archive(session, tmp_path / "exam.kinarm")
    write_kinarm_archive(session, tmp_path / "older.kinarm", version=2)
    names = ("exam.zip", "exam", "exam.kinarm", "older.kinarm")
    first, *others = (read(tmp_path / name, session) for name in names)
    assert_close(first, session)
    for other in others:
        pd.testing.assert_frame_equal(first.trials, other.trials, check_exact=True)
        for name in ("position", "force", "emg", "time_s"):
            np.testing.assert_array_equal(getattr(first, name), getattr(other, name))
        assert all((first.extra[name] == other.extra[name]).all() for name in first.extra)
        assert first.provenance == other.provenance
    archive, c3d = estimate(others[1]).to_frame(), estimate(first).to_frame()
    pd.testing.assert_frame_equal(archive, c3d, check_exact=True)


def test_what_was_simulated_is_estimated(session, tmp_path):
    write_kinarm_archive(session, tmp_path / "exam.kinarm")
    found = estimate(read(tmp_path / "exam.kinarm", session)).to_frame()
    # What a Kinarm does not record stays out of both.
    held = {"joint_angles": None, "shoulder_m": None, "handle_mass_kg": 0.0, "imposed": None}
    straight = estimate(replace(session, extra={}, **held)).to_frame()
    names = [f"{letter}_{ij}" for letter in "MBK" for ij in (11, 12, 21, 22)]
    # Single precision of the angles, twice differentiated, is noise: far below the rest of it.
    doubt = straight[[f"sd_{name}" for name in names]].to_numpy()
    assert (np.abs(found[names].to_numpy() - straight[names].to_numpy()) < 0.2 * doubt).all()


@pytest.mark.parametrize("write", [write_kinarm_archive, write_kinarm_c3d])
def test_a_left_arm_is_the_mirror_image(session, tmp_path, write):
    name = "exam.kinarm" if write is write_kinarm_archive else "exam.zip"
    write(session, tmp_path / name, side="left")
    left = read(tmp_path / name, session)
    assert any("Left arm mirrored" in sentence for sentence in left.provenance)
    assert_close(left, session)


def test_the_robot_shows_whose_force_it_is(session, tmp_path):
    """The motors follow from d'Alembert's principle, the reader's balance from Lagrange's."""
    write_kinarm_c3d(session, tmp_path / "exam")
    (sign,) = (f for f in read(tmp_path / "exam", session).findings if f.name == "force sign")
    assert (sign.verdict, sign.message[:11]) == ("ok", "by the limb")
    share = float(sign.message.split("unbalanced by the limb ")[1].split(" %")[0])
    assert share < 1e-3


def test_the_same_session_gives_the_same_bytes(session, tmp_path):
    for name in ("a.kinarm", "b.kinarm"):
        write_kinarm_archive(session, tmp_path / name)
    assert (tmp_path / "a.kinarm").read_bytes() == (tmp_path / "b.kinarm").read_bytes()
    with zipfile.ZipFile(tmp_path / "a.kinarm") as archive:
        assert archive.testzip() is None


def test_what_a_kinarm_cannot_hold_is_refused(session, tmp_path):
    far = replace(session, position=session.position * 100.0)
    for recording, match in (
        (far, "for a Kinarm to reach"),
        (replace(session, kind="joint"), "of the hand in a plane"),
    ):
        with pytest.raises(InputError, match=match):
            write_kinarm_archive(recording, tmp_path / "exam.kinarm")
    assert list(tmp_path.iterdir()) == []
