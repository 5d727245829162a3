"""The command map-columns: what it writes, prints and refuses."""

from __future__ import annotations

from pathlib import Path

from armimpedance.__main__ import main

ROWS = "".join(f"{i},{i / 1e4},0.4,{i % 7},1\n" for i in range(200))


def log(folder: Path) -> Path:
    file = folder / "log.csv"
    file.write_text("time (ms),x (m),y (m),fx (N),fy (N)\n" + ROWS)
    return file


def test_it_writes_beside_the_file_and_says_what_it_cannot_tell(tmp_path, capsys) -> None:
    file = log(tmp_path)
    assert main(["map-columns", str(file)]) == 0
    printed = capsys.readouterr().out
    assert "Cannot tell:" in printed
    assert "whose force" in printed
    written = tmp_path / "columns.toml"
    assert "# cannot tell: " in written.read_text()
    written.write_text("mine")
    assert main(["map-columns", str(file)]) == 2
    assert "--replace" in capsys.readouterr().err
    assert written.read_text() == "mine"
    assert main(["map-columns", str(file), "--replace"]) == 0
    assert "by =" in written.read_text()
    capsys.readouterr()
    assert main(["inspect", str(file)]) == 2
    assert "force.by" in capsys.readouterr().err


def test_from_the_log_to_a_recording(tmp_path, capsys) -> None:
    file, out = log(tmp_path), tmp_path / "mine.toml"
    assert main(["map-columns", str(file), "--out", str(out)]) == 0
    assert not (tmp_path / "columns.toml").exists()
    out.write_text(out.read_text().replace('# by = "limb"', 'by = "limb"'))
    session = tmp_path / "session"
    assert main(["convert", str(file), str(session), "--mapping", str(out)]) == 0
    assert (session / "recording.json").is_file()
    capsys.readouterr()
    assert main(["map-columns", str(file), "--out", str(tmp_path / "a.txt")]) == 2
    assert main(["map-columns", str(tmp_path / "none.csv")]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 2
