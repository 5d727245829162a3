"""``--figure`` of the commands: what is written, its caption, and what is refused."""

from pathlib import Path

import pytest
from sessions import pushes

from armimpedance.__main__ import main
from armimpedance.recordings import write_recording


def call(*words) -> int:
    return main([str(word) for word in words])


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A session of two conditions, its results, and its joints' results."""
    path = tmp_path_factory.mktemp("figures")
    write_recording(pushes(1), path / "session")
    return path


@pytest.mark.study
def test_each_step_draws_what_it_finds(folder, capsys):
    session, hand = folder / "session", folder / "hand.csv"
    assert call("inspect", session, "--figure", folder / "quality.svg") == 0
    assert call("estimate", session, "--out", hand, "--figure", folder / "hand.png") == 0
    mapped = ("map", hand, "--recording", session)
    assert (
        call(*mapped, "--to", "joint", "--out", folder / "j.csv", "--figure", folder / "j.pdf") == 0
    )
    muscles = ("--to", "muscle", "--arm", "planar6", "--out", folder / "m.csv")
    assert call(*mapped, *muscles, "--figure", folder / "m.svg", "--caption") == 0
    said = capsys.readouterr().out
    for name in ("quality.svg", "hand.png", "hand_motion.png", "j.pdf", "m.svg"):
        assert (folder / name).stat().st_size > 5000, name
        assert f"figure written to {folder / name}" in said
        caption = (folder / name).with_suffix(".txt")
        assert caption.exists() == (name != "m.svg")
    assert "95 %" in (folder / "hand.txt").read_text()


@pytest.mark.study
def test_a_talk_is_larger(folder, capsys):
    for style in ("print", "talk"):
        picture = folder / f"{style}.png"
        assert call("inspect", folder / "session", "--figure", picture, "--style", style) == 0
    sizes = [width_of(folder / f"{style}.png") for style in ("print", "talk")]
    # 17.5 cm at 300 dpi
    assert sizes[0] == pytest.approx(17.5 / 2.54 * 300, abs=1)
    assert sizes[1] > 1.3 * sizes[0]


def width_of(picture: Path) -> int:
    return int.from_bytes(picture.read_bytes()[16:20], "big")


def test_a_picture_without_a_folder_is_refused_before_any_work(folder, capsys):
    words = ("estimate", folder / "session", "--figure", folder / "nowhere" / "a.png")
    assert call(*words) != 0
    assert "no such folder" in capsys.readouterr().err
