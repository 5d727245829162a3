"""The benchmark's folder: names, questions, seeds and seals. Standard library only."""

from __future__ import annotations

import hashlib
import hmac
import math
import os
import secrets
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal, NamedTuple

from armimpedance.core.errors import InputError

#: Another version has other records: raised whenever a task, a seed or the scoring changes.
VERSION: Final = "1.0"

Half = Literal["public", "sealed"]
HALVES: Final[tuple[Half, ...]] = ("public", "sealed")

MARK: Final = "benchmark.json"
SUMS: Final = "SHA256SUMS"
TRUTH: Final = "truth.csv"
ASKED: Final = "asked.csv"
SEALED_TRUTH: Final = "sealed_truth.sha256"
#: What the folder holds at its top.
TOP: Final = (
    MARK, SUMS, "VERSION", "README.md", "LICENSE", "CITATION.cff", "datasheet.md", "tasks",
)  # fmt: skip

ASKED_COLUMNS: Final = ("task", "record", "group", "quantity", "unit")
TRUTH_COLUMNS: Final = (*ASKED_COLUMNS, "value", "scale")


def record_names(half: Half, count: int) -> list[str]:
    """``p01``, ... of the public half, ``s01``, ... of the sealed one.

    Parameters
    ----------
    half : {"public", "sealed"}
    count : int

    Returns
    -------
    list of str
    """
    return [f"{half[0]}{number:02d}" for number in range(1, count + 1)]


def half_of(record: str) -> Half:
    """The half that a record is of, by its name."""
    return "sealed" if record.startswith("s") else "public"


def record_folder(top: Path, task: str, record: str) -> Path:
    """Where a record lies.

    Parameters
    ----------
    top : Path
        The benchmark's folder.
    task, record : str

    Returns
    -------
    Path
    """
    return top / "tasks" / task / half_of(record) / record


# What a task asks of a record, and what is true there. Standard library only.

#: Digits of a truth: far below any error, far above what rounding on another machine moves.
DIGITS = 9


class AskedQuantity(NamedTuple):
    """One number that a task asks for.

    Attributes
    ----------
    task, record : str
    group : str
        Quantities of one group are scored together, such as the four elements of a stiffness.
    quantity, unit : str
    """

    task: str
    record: str
    group: str
    quantity: str
    unit: str


class KnownTruth(NamedTuple):
    """One number that a task asks for, with its truth.

    Attributes
    ----------
    asked : AskedQuantity
    value : float
    scale : float
        What errors are told in parts of.
    """

    asked: AskedQuantity
    value: float
    scale: float


@dataclass(frozen=True)
class AskedGroup:
    """Quantities of one kind in one record, with their truth.

    Attributes
    ----------
    name, unit : str
    values : mapping
        Name of the quantity -> truth.
    scale : float or None
        What errors are told in parts of; None: the root mean square of the values, so that the
        error of a matrix is that of its Frobenius norm.
    """

    name: str
    unit: str
    values: Mapping[str, float]
    scale: float | None = None

    @classmethod
    def matrix(cls, name: str, unit: str, rows: Iterable[Iterable[float]]) -> AskedGroup:
        """The elements of a matrix, ``K_11`` to ``K_22``."""
        values = {
            f"{name}_{i}{j}": float(value)
            for i, row in enumerate(rows, 1)
            for j, value in enumerate(row, 1)
        }
        return cls(name, unit, values)

    @classmethod
    def course(
        cls, name: str, unit: str, times_s: Iterable[float], values: Iterable[float]
    ) -> AskedGroup:
        """A quantity at times, ``K@0.50``."""
        named = {f"{name}@{t:.2f}": float(v) for t, v in zip(times_s, values, strict=True)}
        return cls(name, unit, named)

    def known(self, task: str, record: str) -> list[KnownTruth]:
        """One `Known` a quantity, its numbers rounded as the files hold them."""
        squares = math.fsum(v * v for v in self.values.values())
        scale = math.sqrt(squares / len(self.values)) if self.scale is None else self.scale
        return [
            KnownTruth(
                AskedQuantity(task, record, self.name, name, self.unit),
                rounded(value),
                rounded(scale),
            )
            for name, value in self.values.items()
        ]


def rounded(value: float) -> float:
    """A number of nine digits."""
    return float(f"{value:.{DIGITS}g}")


# Seeds of both halves, and how a sealed truth is fixed beforehand. Standard library only.
#
# Public seeds follow from names that everybody knows. Sealed seeds are a keyed hash of the same
# names (HMAC-SHA256): who has the key makes the same records and the same truth again, who has not
# cannot. The folder holds the SHA-256 of the key and, of each task, that of its sealed truth behind
# a salt that is a keyed hash as well: small truths could be guessed and tried without one.

#: Bytes of a key; fewer could be tried one by one against the published hash.
KEY_BYTES: Final = 32
_NAME: Final = "armimpedance benchmark"


@dataclass(frozen=True, repr=False)
class Key:
    """The secret that sealed records are made from."""

    secret: bytes

    @classmethod
    def drawn(cls, file: Path) -> Key:
        """A new key, written where only its owner reads it.

        Raises
        ------
        InputError
            There is a file of that name, or it cannot be written.
        OSError
            The disk is full; no file is left.
        """
        key = cls(secrets.token_bytes(KEY_BYTES))
        try:
            descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        except OSError as error:
            raise InputError(f"cannot be written: {error.strerror}", file=file) from None
        try:
            with os.fdopen(descriptor, "w", encoding="ascii") as stream:
                stream.write(key.secret.hex() + "\n")
        except OSError as error:
            file.unlink(missing_ok=True)
            error.filename = os.fspath(file)
            raise
        return key

    @classmethod
    def read(cls, file: Path) -> Key:
        """The key in a file: 64 hexadecimal digits.

        Raises
        ------
        InputError
            It is no such file.
        """
        expected = f"a key, {2 * KEY_BYTES} hexadecimal digits in one line"
        try:
            secret = bytes.fromhex(file.read_text(encoding="ascii").strip())
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror}", file=file) from None
        except ValueError:
            raise InputError("is no key", file=file, expected=expected) from None
        if len(secret) != KEY_BYTES:
            raise InputError(f"is a key of {len(secret)} bytes", file=file, expected=expected)
        return cls(secret)

    @property
    def fingerprint(self) -> str:
        """SHA-256 of the key, which is published."""
        return hashlib.sha256(self.secret).hexdigest()

    def salt(self, version: str, task: str) -> str:
        """Salt of a task's sealed truth, which stands before it when it is hashed."""
        return self.digest(version, task, "salt").hex()

    def digest(self, *words: str) -> bytes:
        """A keyed hash of some words."""
        return hmac.digest(self.secret, _said(*words), "sha256")


def seed_of(version: str, task: str, record: str, key: Key | None) -> int:
    """The seed of a record: a sealed one with its key, a public one without.

    Parameters
    ----------
    version, task, record : str
    key : Key or None

    Returns
    -------
    int
        Below 2^63.
    """
    if key is None:
        digest = hashlib.sha256(_said(version, task, record)).digest()
    else:
        digest = key.digest(version, task, record)
    return int.from_bytes(digest[:8], "big") >> 1


def commitment(salt: str, truth: str) -> str:
    """The published hash of a sealed truth: SHA-256 of salt, line feed and its table's text."""
    return hashlib.sha256(f"{salt}\n{truth}".encode()).hexdigest()


def _said(*words: str) -> bytes:
    return "/".join((_NAME, *words)).encode()
