"""What tells one program from another: SHA-256 of its files and of what it counts with."""

from __future__ import annotations

import hashlib
import json
import sys
from functools import cache
from pathlib import Path
from typing import Final

#: Packages whose versions may change the last bits.
_COUNTING: Final = ("numpy", "scipy", "pandas", "pyarrow", "matplotlib", "pin", "cvxpy", "altair")


def of_bytes(content: bytes) -> str:
    """SHA-256 of bytes, as text."""
    return hashlib.sha256(content).hexdigest()


def of_words(*words: object) -> str:
    """SHA-256 of anything that JSON can hold."""
    return of_bytes(json.dumps(words, sort_keys=True, ensure_ascii=True).encode())


@cache
def of_program(*packages: str) -> str:
    """SHA-256 of packages, where they are installed, and the versions of what they count with.

    `*packages`: default: the toolkit alone.
    """
    from importlib import metadata  # slow: no --help waits for it

    own = [(name, *one) for name in packages or ("armimpedance",) for one in _files(name)]
    versions = [(name, metadata.version(name)) for name in _COUNTING]
    return of_words(own, versions, list(sys.version_info[:3]))


def _files(package: str) -> list[tuple[str, str]]:
    """Every file of a package, and what it holds."""
    from importlib.util import find_spec

    spec = find_spec(package)
    if spec is None or spec.origin is None:
        return []
    top = Path(spec.origin).parent
    # what Python and Numba compiled is made of the files that stand here
    kept = (path for path in top.rglob("*") if "__pycache__" not in path.parts)
    files = sorted(path for path in kept if path.is_file())
    return [(path.relative_to(top).as_posix(), of_bytes(path.read_bytes())) for path in files]


def software() -> str:
    """The program and its version, as a paper names it."""
    from importlib.metadata import version

    return f"armimpedance {version('armimpedance')}"
