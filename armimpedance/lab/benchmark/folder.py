"""The benchmark's folder: what it asks, what is true in its public half, its checksums."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import file_digest, sha256
from pathlib import Path

from armimpedance.core.errors import InputError
from armimpedance.core.json_text import Fields, json_text, read_json
from armimpedance.core.outputs import staged_file
from armimpedance.lab.benchmark.layout import (
    ASKED,
    ASKED_COLUMNS,
    MARK,
    SEALED_TRUTH,
    SUMS,
    TRUTH,
    TRUTH_COLUMNS,
    VERSION,
    AskedQuantity,
    Half,
    Key,
    KnownTruth,
    commitment,
    half_of,
    record_folder,
)


@dataclass(frozen=True)
class BenchmarkFolder:
    """A benchmark on disk.

    Attributes
    ----------
    path : Path
    sums : mapping
        File, from the folder -> its SHA-256.
    key_sha256 : str or None
        Of the key that sealed it; None: it has a public half alone.
    asked : tuple of AskedQuantity
        Of both halves.
    """

    path: Path
    sums: Mapping[str, str]
    key_sha256: str | None
    asked: tuple[AskedQuantity, ...]

    @classmethod
    def open(cls, path: Path) -> BenchmarkFolder:
        """Open a folder that `armimpedance benchmark make` wrote.

        Raises
        ------
        InputError
            It is none, another version, or what it asks for was changed.
        """
        if not (path / MARK).is_file():
            raise InputError("is no benchmark", file=path, expected=f"a folder with {MARK}")
        fields = Fields(path / MARK, read_json(path / MARK))
        fields.choice("format", ["armimpedance-benchmark"], required=True)
        if fields.values.get("version") != VERSION:
            raise fields.wrong("version", f'"{VERSION}", the version that this program scores')
        key = fields.values.get("key_sha256")
        bare = cls(path, _read_sums(path / SUMS), key if isinstance(key, str) else None, ())
        bare._checked(MARK)
        files = [bare._checked(f) for f in bare.sums if _is_asked(f)]
        return replace(bare, asked=tuple(a for file in files for a in read_asked(file)))

    @property
    def sha256(self) -> str:
        """SHA-256 of the list of checksums, and so of every file in the folder."""
        return file_sha256(self.path / SUMS)

    @property
    def tasks(self) -> tuple[str, ...]:
        """Names, in the order of the files."""
        return tuple(dict.fromkeys(a.task for a in self.asked))

    def records(self, task: str, half: Half) -> tuple[str, ...]:
        """Names of a task's records."""
        own = (a.record for a in self.asked if a.task == task and half_of(a.record) == half)
        return tuple(dict.fromkeys(own))

    def public_truth(self) -> list[KnownTruth]:
        """The truths that everybody may read.

        Raises
        ------
        InputError
            A file is not the one that the folder was made with.
        """
        files = [f for f in self.sums if f.endswith(f"/{TRUTH}")]
        return [known for file in files for known in read_known(self._checked(file))]

    def check_key(self, key: Key) -> None:
        """Refuse a key that is not the one of the sealed half.

        Raises
        ------
        InputError
        """
        if key.fingerprint != self.key_sha256:
            raise InputError("sealed with another key, or with none", file=self.path / MARK)

    def holds_sealed(self, task: str, truth: Sequence[KnownTruth], key: Key) -> bool:
        """Return True if a sealed truth is the one whose hash was published."""
        file = self._checked(f"tasks/{task}/{SEALED_TRUTH}")
        hash_now = commitment(key.salt(VERSION, task), known_text(truth))
        return hash_now == file.read_text(encoding="ascii").strip()

    def _checked(self, name: str) -> Path:
        file = self.path / name
        if name not in self.sums or not file.is_file() or file_sha256(file) != self.sums[name]:
            expected = f"the file that {SUMS} tells of"
            raise InputError("is missing or was changed", file=file, expected=expected)
        return file


def file_sha256(file: Path) -> str:
    """SHA-256 of a file."""
    with file.open("rb") as stream:
        return file_digest(stream, sha256).hexdigest()


def known_text(truth: Iterable[KnownTruth]) -> str:
    """A table of truths as text."""
    return _csv(TRUTH_COLUMNS, [(*k.asked, repr(k.value), repr(k.scale)) for k in truth])


def asked_text(asked: Iterable[AskedQuantity]) -> str:
    """A table of what is asked as text."""
    return _csv(ASKED_COLUMNS, list(asked))


def read_known(file: Path) -> list[KnownTruth]:
    """A table of truths."""
    rows = _rows(file, TRUTH_COLUMNS)
    return [KnownTruth(AskedQuantity(*row[:-2]), float(row[-2]), float(row[-1])) for row in rows]


def read_asked(file: Path) -> list[AskedQuantity]:
    """A table of what is asked."""
    return [AskedQuantity(*row) for row in _rows(file, ASKED_COLUMNS)]


def _csv(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([columns, *rows])
    return text.getvalue()


def _rows(file: Path, columns: Sequence[str]) -> list[list[str]]:
    """The rows of one of the benchmark's own tables."""
    header, *rows = csv.reader(io.StringIO(file.read_text(encoding="utf-8")))
    if tuple(header) != tuple(columns) or any(len(row) != len(columns) for row in rows):
        raise InputError("has another layout", file=file, expected=",".join(columns))
    return rows


def _read_sums(file: Path) -> dict[str, str]:
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
        pairs = [line.split("  ", 1) for line in lines]
        return {name: checksum for checksum, name in pairs}
    except (OSError, ValueError) as error:
        raise InputError("no list of checksums", file=file) from error


def _is_asked(name: str) -> bool:
    """Return True if the file holds a task's questions."""
    parts = name.split("/")
    return len(parts) == 3 and parts[0] == "tasks" and parts[2] == ASKED


# What the benchmark's folder holds beside its recordings.


def write_task(top: Path, task: str, truth: Sequence[KnownTruth], key: Key | None) -> None:
    """Write what a task asks, the truth of its public records, the hash of the sealed one.

    Parameters
    ----------
    top : Path
        The benchmark's folder, its records' folders made.
    task : str
    truth : sequence of KnownTruth
        Of all records.
    key : Key or None
        None: there is no sealed half.
    """
    folder = top / "tasks" / task
    (folder / ASKED).write_text(asked_text(known.asked for known in truth), encoding="utf-8")
    for record in dict.fromkeys(known.asked.record for known in truth):
        if half_of(record) == "public":
            own = [known for known in truth if known.asked.record == record]
            file = record_folder(top, task, record) / TRUTH
            file.write_text(known_text(own), encoding="utf-8")
    if key is not None:
        sealed = [known for known in truth if half_of(known.asked.record) == "sealed"]
        published = commitment(key.salt(VERSION, task), known_text(sealed))
        (folder / SEALED_TRUTH).write_text(published + "\n", encoding="ascii")


def write_index(top: Path, lines: Mapping[str, str], key: Key | None) -> None:
    """Write what the whole is, and the SHA-256 of every file, as `sha256sum -c` reads them.

    Parameters
    ----------
    top : Path
        All else is written.
    lines : mapping
        Task -> what it is.
    key : Key or None
    """
    about = {
        "format": "armimpedance-benchmark",
        "version": VERSION,
        "key_sha256": key.fingerprint if key else None,
        "tasks": lines,
    }
    (top / MARK).write_text(json_text(about), encoding="utf-8")
    files = sorted(p.relative_to(top).as_posix() for p in top.rglob("*") if p.is_file())
    sums = [f"{file_sha256(top / f)}  {f}\n" for f in files if f != SUMS]
    (top / SUMS).write_text("".join(sums), encoding="utf-8")


def keep_truth(key_file: Path, truth: Sequence[KnownTruth]) -> None:
    """Keep the sealed truths beside the key, where only its owner reads them.

    It saves their simulation at each scoring; what is believed of them is checked by their hash.

    Parameters
    ----------
    key_file : Path
    truth : sequence of KnownTruth
        Of both halves.
    """
    sealed = [known for known in truth if half_of(known.asked.record) == "sealed"]
    with staged_file(_beside(key_file)) as staged:
        staged.touch(0o600)
        staged.write_text(known_text(sealed), encoding="utf-8")


def kept_truth(key_file: Path) -> list[KnownTruth]:
    """The truth that `keep_truth` stored; an empty list without it.

    Parameters
    ----------
    key_file : Path

    Returns
    -------
    list of KnownTruth
    """
    return read_known(_beside(key_file)) if _beside(key_file).is_file() else []


def _beside(key_file: Path) -> Path:
    return key_file.with_name(f"{key_file.name}.truth.csv")
