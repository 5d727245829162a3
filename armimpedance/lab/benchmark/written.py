"""What the benchmark's folder holds beside its recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from armimpedance.core.json_text import json_text
from armimpedance.core.outputs import staged_file
from armimpedance.lab.benchmark.asked import Known
from armimpedance.lab.benchmark.folder import asked_text, file_sha256, known_text, read_known
from armimpedance.lab.benchmark.layout import (
    ASKED,
    MARK,
    SEALED_TRUTH,
    SUMS,
    TRUTH,
    VERSION,
    half_of,
    record_folder,
)
from armimpedance.lab.benchmark.sealing import Key, commitment


def write_task(top: Path, task: str, truth: Sequence[Known], key: Key | None) -> None:
    """Write what a task asks, the truth of its public records, the hash of the sealed one.

    Parameters
    ----------
    top : Path
        The benchmark's folder, its records' folders made.
    task : str
    truth : sequence of Known
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
        told = commitment(key.salt(VERSION, task), known_text(sealed))
        (folder / SEALED_TRUTH).write_text(told + "\n", encoding="ascii")


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


def keep_truth(key_file: Path, truth: Sequence[Known]) -> None:
    """Keep the sealed truths beside the key, where only its owner reads them.

    It saves their simulation at each scoring; what is believed of them is checked by their hash.

    Parameters
    ----------
    key_file : Path
    truth : sequence of Known
        Of both halves.
    """
    sealed = [known for known in truth if half_of(known.asked.record) == "sealed"]
    with staged_file(_beside(key_file)) as staged:
        staged.touch(0o600)
        staged.write_text(known_text(sealed), encoding="utf-8")


def kept_truth(key_file: Path) -> list[Known]:
    """What `keep_truth` kept; nothing if it did not.

    Parameters
    ----------
    key_file : Path

    Returns
    -------
    list of Known
    """
    return read_known(_beside(key_file)) if _beside(key_file).is_file() else []


def _beside(key_file: Path) -> Path:
    return key_file.with_name(f"{key_file.name}.truth.csv")
