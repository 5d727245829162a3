"""What the benchmark's folder holds beside its recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from armimpedance.benchmark.asked import Known
from armimpedance.benchmark.folder import asked_text, file_sha256, known_text
from armimpedance.benchmark.layout import (
    ASKED,
    MARK,
    SEALED_TRUTH,
    SUMS,
    TRUTH,
    VERSION,
    half_of,
    record_folder,
)
from armimpedance.benchmark.sealing import Key, commitment
from armimpedance.json_text import json_text


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
