"""Damaged and hostile files of any layout: typed errors of one line, no room made for claims."""

from __future__ import annotations

import random
import struct
import time
import zlib
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from mapped_files import mat5_bytes, write_mat73

from armimpedance.core.errors import ArmImpedanceError, InputError
from armimpedance.recordings import propose_mapping

HEAD = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"


def tag(kind: int, data: bytes) -> bytes:
    return struct.pack("<2I", kind, len(data)) + data + b"\0" * (-len(data) % 8)


def matrix(kind: int, shape: tuple[int, ...], content: bytes) -> bytes:
    flags = tag(6, struct.pack("<2I", kind, 0))
    return tag(14, flags + tag(5, struct.pack(f"<{len(shape)}i", *shape)) + tag(1, b"x") + content)


def small_csv(path: Path) -> bytes:
    """A valid table with a header, units and a text column."""
    rows = "".join(f"{i};{i // 20};{i / 3:.6f};0,4;relaxed\n".replace(".", ",") for i in range(60))
    path.write_text("t [ms];trial;x [mm];fx [N];cond\n" + rows)
    return path.read_bytes()


def small_mat73(path: Path) -> bytes:
    trials = [{"pos": np.ones((30, 2)), "f": np.ones((30, 2)), "c": "abc"} for _ in range(2)]
    return write_mat73(
        path, {"trials": trials, "fs": 1000.0, "c": [np.arange(5.0), "x"]}
    ).read_bytes()


def small_parquet(path: Path) -> bytes:
    pq.write_table(pa.table({"t": np.arange(50) / 1e3, "x": np.ones(50), "c": ["a"] * 50}), path)
    return path.read_bytes()


KINDS = {
    "a.csv": small_csv,
    "a.mat": mat5_bytes,
    "b.mat": small_mat73,
    "a.parquet": small_parquet,
}


def damaged(data: bytes, chance: random.Random) -> bytes:
    """One to four flips, cuts, insertions or enlarged counts."""
    changed = bytearray(data)
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(max(1, len(changed)))
        what = chance.randrange(5)
        if what == 0:
            changed[at : at + 1] = bytes([chance.randrange(256)])
        elif what == 1:
            del changed[at:]
        elif what == 2:
            del changed[at : at + chance.randrange(1, 30)]
        elif what == 3:
            changed[at:at] = bytes(chance.randrange(256) for _ in range(chance.randrange(1, 30)))
        else:
            at -= at % 4
            changed[at : at + 4] = struct.pack("<I", chance.choice([0, 2**31 - 1, 2**32 - 1]))
    return bytes(changed)


@pytest.mark.parametrize("name", KINDS)
def test_damage_is_a_typed_error(name: str, tmp_path: Path) -> None:
    path, chance = tmp_path / name, random.Random(11)  # noqa: S311 - a seeded damage
    sound = KINDS[name](path)
    propose_mapping(path)
    refused: list[str] = []
    for _ in range(120):
        path.write_bytes(damaged(sound, chance))
        started = time.perf_counter()
        try:
            propose_mapping(path)
        except ArmImpedanceError as error:
            refused.append(str(error))
        assert time.perf_counter() - started < 2.0
    assert len(refused) > 20
    assert not any("\n" in told for told in refused)


BOMBS = {
    "cells": matrix(1, (2**30, 2**30), b""),
    "numbers": matrix(6, (2**30, 2**30), tag(9, b"\0" * 8)),
    "no numbers": matrix(6, (2**31 - 1, 2**31 - 1, 0), tag(9, b"")),
    "empty cells": matrix(1, (400_000, 1), tag(14, b"") * 400_000),
    "fields": matrix(2, (2**15, 2**15), tag(5, b"\x08\0\0\0") + tag(1, b"a".ljust(8, b"\0"))),
    "no fields": matrix(2, (2**15, 2**15), tag(5, b"\x08\0\0\0") + tag(1, b"")),
    "sparse": matrix(5, (2**31 - 1, 2**31 - 1), 2 * tag(5, b"\0" * 4) + tag(9, b"\0" * 8)),
    "a type of its own": matrix(6, (1, 1), tag(99, b"\0" * 8)),
    "a class of its own": matrix(77, (1, 1), tag(9, b"\0" * 8)),
}  # fmt: skip


@pytest.mark.parametrize("name", BOMBS)
@pytest.mark.parametrize("packed", [False, True], ids=["plain", "packed"])
def test_claims_of_a_matlab_file_are_checked(name: str, packed: bool, tmp_path: Path) -> None:
    body = BOMBS[name]
    packing = zlib.compress(body)
    body = struct.pack("<2I", 15, len(packing)) + packing if packed else body
    (tmp_path / "a.mat").write_bytes(HEAD + body)
    with pytest.raises(InputError):
        propose_mapping(tmp_path / "a.mat")


def test_levels_without_end_are_refused(tmp_path: Path) -> None:
    body = matrix(6, (1, 1), tag(9, b"\0" * 8))
    for _ in range(100):
        body = matrix(1, (1, 1), body)
    (tmp_path / "a.mat").write_bytes(HEAD + body)
    with pytest.raises(InputError, match="levels"):
        propose_mapping(tmp_path / "a.mat")
    with h5py.File(tmp_path / "b.mat", "w", userblock_size=512) as file:
        group = file.create_group("a")
        group["again"] = group
    with pytest.raises(InputError, match="levels"):
        propose_mapping(tmp_path / "b.mat")


def test_claims_of_hdf5_and_parquet_are_checked(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as file:
        data = file.create_dataset("x", shape=(10**10,), dtype="f8", chunks=(10**6,))
        data.attrs["MATLAB_class"] = np.bytes_("double")
    with pytest.raises(InputError, match="80 GB"):
        propose_mapping(tmp_path / "a.mat")
    zeros = pa.chunked_array([pa.array(np.zeros(1_000_000))] * 40)
    pq.write_table(pa.table({"x": zeros}), tmp_path / "a.parquet", compression="zstd")
    with pytest.raises(InputError, match="GB"):
        propose_mapping(tmp_path / "a.parquet")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "empty"),
        (b"\0" * 5000, "no text"),
        (b"1," * 400_000, "characters"),
        (b"a,b\nx,y\nz,w\n", "no rows of numbers"),
        (b"a,b\n1,2\n3,4\n5\n6,7\n8,9\n10,11\n12,13\n", "row 4: 1 cells"),
    ],
)
def test_texts_that_are_no_tables(content: bytes, words: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(content)
    with pytest.raises(InputError, match=words):
        propose_mapping(tmp_path / "a.csv")


def test_a_long_text_in_one_cell_costs_only_its_column(tmp_path: Path) -> None:
    rows = "".join(f"{i},{i},{'n' if i != 500 else 'z' * 20_000}\n" for i in range(2000))
    (tmp_path / "a.csv").write_text("t,x,note\n" + rows)
    proposed = propose_mapping(tmp_path / "a.csv")
    assert "note" not in proposed.text


def test_a_heap_without_end_in_a_file_of_matlab_is_refused(tmp_path: Path) -> None:
    path = write_mat73(tmp_path / "a.mat", {"x": np.arange(3.0)})
    with h5py.File(path, "r+") as file:
        file["x"].attrs["note"] = "a text in a heap"
    data = bytearray(path.read_bytes())
    heap = data.index(b"GCOL")
    (length,) = struct.unpack_from("<Q", data, heap + 24)
    following = heap + 32 + (length + 7) // 8 * 8
    # A part of a number and no length: HDF5 would look at it for ever.
    data[following : following + 16] = bytes(16)
    path.write_bytes(bytes(data))
    with pytest.raises(InputError, match="heap"):
        propose_mapping(path)


@pytest.mark.parametrize("cells", ["0.000 s,0.01 m,1.5 N", '"0,5 mm";"3,2 N"', "3.2mm\t-4 N"])
def test_a_unit_behind_each_number_is_named(cells: str, tmp_path: Path) -> None:
    file = tmp_path / "trial.csv"
    file.write_text("a,b,c\n" + f"{cells}\n" * 5)
    with pytest.raises(InputError, match="unit.*header"):
        propose_mapping(file)
