"""Ways in which a file is damaged: by a disk, a transfer, an editor, another program, an attacker.

A mutation is a function of the bytes and a generator of random numbers. An archive is damaged as a
whole or in one member, whose checksum is then right again; a folder in one of its files.
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np
from meanings import other_meaning

Rng = np.random.Generator
Mutation = Callable[[bytes, Rng], bytes]

#: Where most formats keep their counts and offsets.
HEADER: Final = 2048

#: How often a file stays well-formed, where its format is known.
MEANINGS: Final = 0.5

EXTREMES: Final = (0, 1, -1, 2**7, 2**15 - 1, 2**16 - 1, 2**24, 2**31 - 1, -(2**31), 2**32 - 1)
FLOATS: Final = (np.nan, np.inf, -np.inf, 0.0, -1.0, 1e38, 1e-38, 5e-324, 1e300)
WORDS: Final = (
    b"nan", b"inf", b"-inf", b"1e999", b"-1", b"0", b"", b"9" * 20, b"1e-400", b"=1+1",
    b"\x1b[31m", b"\x00", b"\xff\xfe", b'"', b"[[[[[[[[", b"{", b"true", b"null", b"\xed\xa0\x80",
    b"1,5", b"\t\t\t", b"\r", b"1_000", b"0x10", b"\xf0\x9f\x92\xa5", b"../../x", b"A" * 300,
    b"9" * 401, b"[" * 100_000, b'{"a":' * 5000, b"alpha_99999999", b'"\\ud800"', b"$x_{", b"a ",
)  # fmt: skip


def flip_bits(data: bytes, rng: Rng) -> bytes:
    """A few bits turned."""
    out = bytearray(data)
    for place in _places(out, rng, int(rng.integers(1, 9))):
        out[place] ^= 1 << int(rng.integers(8))
    return bytes(out)


def set_bytes(data: bytes, rng: Rng) -> bytes:
    """A few bytes of any value."""
    out = bytearray(data)
    for place in _places(out, rng, int(rng.integers(1, 9))):
        out[place] = int(rng.integers(256))
    return bytes(out)


def cut(data: bytes, rng: Rng) -> bytes:
    """Only a beginning of the file is left."""
    return data[: int(rng.integers(len(data) + 1))]


def drop(data: bytes, rng: Rng) -> bytes:
    """A stretch is missing."""
    first, last = _stretch(data, rng)
    return data[:first] + data[last:]


def repeat(data: bytes, rng: Rng) -> bytes:
    """A stretch stands twice."""
    first, last = _stretch(data, rng)
    return data[:last] + data[first:last] + data[last:]


def blank(data: bytes, rng: Rng) -> bytes:
    """A stretch was never written to the disk."""
    first, last = _stretch(data, rng)
    return data[:first] + bytes(last - first) + data[last:]


def insert(data: bytes, rng: Rng) -> bytes:
    """Bytes that belong to nobody."""
    place = int(rng.integers(len(data) + 1))
    return data[:place] + rng.bytes(int(rng.integers(1, 40))) + data[place:]


def extreme_integer(data: bytes, rng: Rng) -> bytes:
    """A count or an offset of 8 to 64 bits that nobody meant, in either byte order."""
    size = int(rng.choice([1, 2, 4, 8]))
    value = int(rng.choice(np.array(EXTREMES))) % 2 ** (8 * size)
    order = "little" if rng.random() < 0.8 else "big"
    return _put(data, value.to_bytes(size, order), rng)  # type: ignore[arg-type]


def extreme_float(data: bytes, rng: Rng) -> bytes:
    """A number that is none."""
    kind = str(rng.choice(["<f4", "<f8", ">f4"]))
    with np.errstate(over="ignore"):
        return _put(data, np.array(float(rng.choice(FLOATS))).astype(kind).tobytes(), rng)


def other_number(data: bytes, rng: Rng) -> bytes:
    """One number of a text is replaced by a word."""
    found = list(re.finditer(rb"-?\d+(\.\d+)?([eE][+-]?\d+)?", data[:200_000]))
    if not found:
        return insert(data, rng)
    match = found[int(rng.integers(len(found)))]
    return data[: match.start()] + _word(rng) + data[match.end() :]


def other_name(data: bytes, rng: Rng) -> bytes:
    """One name of a text is replaced by a word, or by another name of it."""
    found = list(re.finditer(rb"[A-Za-z_][A-Za-z_0-9.]{1,}", data[:20_000]))
    if not found:
        return insert(data, rng)
    match = found[int(rng.integers(len(found)))]
    other = found[int(rng.integers(len(found)))].group()
    word = other if rng.random() < 0.5 else _word(rng)
    return data[: match.start()] + word + data[match.end() :]


def other_line(data: bytes, rng: Rng) -> bytes:
    """A line is lost, doubled, moved or cut in two."""
    lines = data.split(b"\n")
    place = int(rng.integers(len(lines)))
    line = lines.pop(place)
    how = int(rng.integers(4))
    if how == 1:
        lines[place:place] = [line, line]
    elif how == 2:
        lines.insert(int(rng.integers(len(lines) + 1)), line)
    elif how == 3:
        half = len(line) // 2
        lines[place:place] = [line[:half], line[half:]]
    return b"\n".join(lines)


BINARY: Final[tuple[Mutation, ...]] = (
    flip_bits, set_bytes, cut, drop, repeat, blank, insert, extreme_integer, extreme_integer,
    extreme_float,
)  # fmt: skip
TEXT: Final[tuple[Mutation, ...]] = (
    flip_bits, set_bytes, cut, drop, repeat, insert, other_number, other_number, other_name,
    other_line,
)  # fmt: skip


def mutated(data: bytes, rng: Rng) -> bytes:
    """The bytes of a file after one to three kinds of damage."""
    if rng.random() < MEANINGS:
        other = other_meaning(data, rng)
        if other is not None:
            return other
    if data[:4] == b"PK\x03\x04" and rng.random() < 0.8:
        return _in_member(data, rng)
    kinds = TEXT if _is_text(data) else BINARY
    for _ in range(int(rng.integers(1, 4))):
        data = kinds[int(rng.integers(len(kinds)))](data, rng)
    return data


def damage(place: Path, rng: Rng) -> None:
    """Damage a file, or one file of a folder, where it lies."""
    files = [place] if place.is_file() else sorted(p for p in place.rglob("*") if p.is_file())
    # Small files hold what the large ones mean.
    weights = np.array([1.0 / (1.0 + np.log2(1 + p.stat().st_size)) for p in files])
    file = files[int(rng.choice(len(files), p=weights / weights.sum()))]
    if len(files) > 1 and rng.random() < 0.03:
        file.unlink()
        return
    data = mutated(file.read_bytes(), rng)
    # Another name of the same file must keep what it holds.
    file.unlink()
    file.write_bytes(data)


def _in_member(data: bytes, rng: Rng) -> bytes:
    """An archive with one member damaged, and checksums that are right."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = [(info.filename, archive.read(info)) for info in archive.infolist()]
    chosen = int(rng.integers(len(members)))
    name, content = members[chosen]
    how = rng.random()
    if how < 0.05:
        del members[chosen]
    elif how < 0.1:
        members[chosen] = (name + str(_word(rng)[:1000], "latin-1"), content)
    else:
        members[chosen] = (name, mutated(content, rng))
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for member, content in members:
            archive.writestr(zipfile.ZipInfo(member.replace("\x00", "_")), content)
    return stream.getvalue()


def _is_text(data: bytes) -> bool:
    return b"\x00" not in data[:4096]


def _word(rng: Rng) -> bytes:
    return WORDS[int(rng.integers(len(WORDS)))]


def _places(data: bytearray, rng: Rng, count: int) -> list[int]:
    """Places to damage, half of them where the header is."""
    if not data:
        return []
    end = min(HEADER, len(data)) if rng.random() < 0.5 else len(data)
    return [int(p) for p in rng.integers(end, size=count)]


def _stretch(data: bytes, rng: Rng) -> tuple[int, int]:
    first = int(rng.integers(len(data) + 1))
    return first, min(len(data), first + int(2 ** rng.uniform(0, 12)))


def _put(data: bytes, value: bytes, rng: Rng) -> bytes:
    """The bytes with a value written over them, aligned half of the time."""
    places = _places(bytearray(data), rng, 1)
    if not places:
        return value
    place = places[0] // len(value) * len(value) if rng.random() < 0.5 else places[0]
    return data[:place] + value + data[place + len(value) :]
