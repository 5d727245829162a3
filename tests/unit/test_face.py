"""The face of the whole: `import armimpedance as ai` in a notebook."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module
from types import ModuleType

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
from sessions import LEVELS, pushes

import armimpedance as ai
from armimpedance.__main__ import main
from armimpedance.recordings import write_recording

mpl.use("Agg")
CONDITIONS = list(LEVELS)


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """A folder with two conditions."""
    folder = tmp_path_factory.mktemp("face") / "session"
    write_recording(pushes(1), folder)
    return folder


def test_the_face_is_one_screen_and_every_name_is_there():
    assert 60 <= len(ai.__all__) <= 90
    assert dir(ai) == sorted(ai.__all__)
    for name in ai.__all__:
        assert not isinstance(getattr(ai, name), ModuleType), name


@pytest.mark.parametrize("room", ["joint.elbow", "joint.body", "hand.random"])
def test_a_room_does_not_hide_the_verb_of_its_name(room):
    room, name = f"{room}", room.split(".")[-1]
    verb = getattr(ai, name)
    assert isinstance(import_module(f"armimpedance.{room}"), ModuleType)
    assert getattr(ai, name) is verb
    assert callable(verb)


def test_importing_the_face_loads_nothing_heavy():
    code = (
        "import sys, armimpedance\n"
        "assert not {'numpy', 'pandas', 'scipy', 'matplotlib'} & set(sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_a_session_in_a_few_lines(session, tmp_path):
    recording = ai.read(session)
    assert ai.inspect(recording).usable
    hand = ai.estimate(recording, by="condition", method="weighted")
    stiffness = hand["cocontraction_10"].stiffness
    assert (stiffness.low < stiffness.value).all()
    assert (stiffness.value < stiffness.high).all()
    assert np.asarray(stiffness).shape == (2, 2)
    hand.to_csv(tmp_path / "hand.csv")
    pd.testing.assert_frame_equal(
        hand.to_frame()[["condition", "K_11", "ci_low_K_11"]],
        pd.read_csv(tmp_path / "hand.csv")[["condition", "K_11", "ci_low_K_11"]],
    )
    joint = ai.to_joint(hand)
    assert [e.level for e in joint] == ["joint", "joint"]
    assert ai.plot_ellipses(hand).get_xlabel()
    assert ai.plot_ellipses(joint).get_legend() is not None


def test_a_path_gives_what_the_command_writes(session, tmp_path):
    assert main(["estimate", str(session), "--out", str(tmp_path / "command.csv")]) == 0
    ai.estimate(session).to_csv(tmp_path / "verb.csv")
    assert (tmp_path / "verb.csv").read_bytes() == (tmp_path / "command.csv").read_bytes()


def test_results_show_themselves_in_a_few_lines(session):
    hand = ai.estimate(session)
    one = [hand["cocontraction_30"], hand[0]]
    shown = [ai.read(session), hand, *one, ai.inspect(session), ai.reflex(session)]
    for result in shown:
        assert len(repr(result)) < 2000
        assert "<" in result._repr_html_()
