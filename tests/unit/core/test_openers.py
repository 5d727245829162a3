"""What is no file is refused before a byte of it is read: it may never end."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import armimpedance as ai
from armimpedance.__main__ import main
from armimpedance.app.study.design import read_design
from armimpedance.core.errors import InputError
from armimpedance.core.inputs import read_toml
from armimpedance.core.json_text import read_json
from armimpedance.lab.simulate_study.config import read_config
from armimpedance.recordings import read_skeleton
from armimpedance.recordings.mapped.columns_toml import read_mapping
from armimpedance.show.files import read_left_out
from manipulandum_sim.hand import IDEAL, simulate

OPENERS = {
    "a model": ai.read_model,
    "results": ai.read_results,
    "a mapping": read_mapping,
    "a list of trials": read_left_out,
    "a skeleton": read_skeleton,
    "a design": lambda path: read_design(path, path.parent),
    "settings": read_config,
    "a robot": ai.read_robot,
    "an arm": ai.read_arm,
    "JSON": read_json,
}


@pytest.fixture
def place(tmp_path, request):
    path = tmp_path / "given"
    if request.param == "a pipe":
        os.mkfifo(path)
    elif request.param == "a folder":
        path.mkdir()
    elif request.param == "a socket":
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(str(path))
    elif request.param == "a device":
        return Path("/dev/zero")
    return path


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes and devices as POSIX has them")
@pytest.mark.parametrize("place", ["a pipe", "a folder", "a socket", "a device"], indirect=True)
@pytest.mark.parametrize("opener", OPENERS)
def test_what_is_no_file_is_said_at_once(opener, place):
    with pytest.raises(InputError) as refused:
        OPENERS[opener](place)
    assert refused.value.file is not None


def test_a_key_of_very_many_parts_is_refused_by_its_line(tmp_path):
    file = tmp_path / "deep.toml"
    file.write_text("a = 1\n" + ".".join(["b"] * 30_000) + " = 1\n")
    with pytest.raises(InputError, match="row 2: a key of 30000 parts"):
        read_toml(file, "settings")
    file.write_text('a = "' + "." * 500 + '"\n[a2.b.c]\nd.e = 1.5\n')
    assert read_toml(file, "settings")[0]["a2"]["b"]["c"]["d"]["e"] == 1.5


def test_a_file_that_is_far_too_large_is_not_read(tmp_path):
    file = tmp_path / "huge.json"
    with file.open("wb") as made:
        made.truncate(300_000_000)
    with pytest.raises(InputError, match="300 MB, more than 200 MB"):
        read_json(file)


def test_a_small_table_that_claims_gigabytes_is_refused_before_room_is_made(tmp_path):
    recording, _ = simulate(
        "cocontraction", seed=1, sets=1, conditions=["cocontraction_10"], servo=IDEAL
    )
    ai.write_recording(recording, tmp_path / "session")
    samples = tmp_path / "session" / "samples.parquet"
    names = pq.read_schema(samples).names
    zeros = pa.array(np.zeros(4_000_000, np.int8))
    pq.write_table(pa.table(dict.fromkeys(names, zeros)), samples)
    assert samples.stat().st_size < 1_000_000
    with pytest.raises(InputError, match="claims"):
        ai.read(tmp_path / "session")


@pytest.mark.parametrize(
    ("line", "key"),
    [
        ("at = 07:32:00", "at"),
        ("a.days = [2024-05-01]", "a.days"),
        ("n = 2024-05-01T07:32:00Z", "n"),
    ],
)
def test_dates_of_toml_are_named(line, key, tmp_path):
    file = tmp_path / "dated.toml"
    file.write_text(line + "\n")
    with pytest.raises(InputError, match=f"column {key}: holds a date or a time"):
        read_toml(file, "settings")


def test_a_table_with_carriage_returns_alone_is_no_table_of_results(tmp_path):
    file = tmp_path / "old.csv"
    file.write_bytes(b"a,b\r1,2\r3,4\r")
    with pytest.raises(InputError, match=r"old\.csv"):
        ai.write_report(file, tmp_path / "page.html")


@pytest.mark.parametrize("epoch", ["abc", "-5", "", "1.5"])
def test_a_wrong_time_in_the_environment_is_said_before_the_work(epoch, monkeypatch, capsys):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", epoch)
    assert main(["inspect", "nowhere"]) == 2
    assert "SOURCE_DATE_EPOCH" in capsys.readouterr().err
