"""Identity of a program: SHA-256 of its files and of the versions of its numerical packages."""

from __future__ import annotations

import hashlib
import json
import sys
from functools import cache
from pathlib import Path
from typing import Final

#: Packages whose versions may change the last bits of results.
_COUNTING: Final = ("numpy", "scipy", "pandas", "pyarrow", "matplotlib", "pin", "cvxpy", "altair")


def of_bytes(content: bytes) -> str:
    """SHA-256 of bytes, as text."""
    return hashlib.sha256(content).hexdigest()


def of_words(*words: object) -> str:
    """SHA-256 of anything that JSON can hold."""
    return of_bytes(json.dumps(words, sort_keys=True, ensure_ascii=True).encode())


@cache
def of_program(*packages: str) -> str:
    """SHA-256 of the files of packages and of the versions of the numerical packages.

    `*packages`: default: the toolkit alone.
    """
    from importlib import metadata  # slow: imported only when needed

    own_files = [(name, *file) for name in packages or ("armimpedance",) for file in _files(name)]
    versions = [(name, metadata.version(name)) for name in _COUNTING]
    return of_words(own_files, versions, list(sys.version_info[:3]))


def _files(package: str) -> list[tuple[str, str]]:
    """Names and SHA-256 of all files of a package."""
    from importlib.util import find_spec

    spec = find_spec(package)
    if spec is None or spec.origin is None:
        return []
    top = Path(spec.origin).parent
    # compiled files of Python and Numba are made from the files listed here
    paths = (path for path in top.rglob("*") if "__pycache__" not in path.parts)
    files = sorted(path for path in paths if path.is_file())
    return [(path.relative_to(top).as_posix(), of_bytes(path.read_bytes())) for path in files]


def software() -> str:
    """Name and version of the program, for a paper."""
    from importlib.metadata import version

    return f"armimpedance {version('armimpedance')}"
