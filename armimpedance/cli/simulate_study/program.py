"""What tells that analysis or simulator changed: SHA-256 of their files and of what they use."""

from __future__ import annotations

import hashlib
import json
import sys
from functools import cache
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Final

_PACKAGES: Final = ("armimpedance", "manipulandum_sim")
#: Packages whose versions may change the last bits.
_COUNTING: Final = ("numpy", "scipy", "pandas")


def of_words(*words: object) -> str:
    """SHA-256 of anything that JSON can hold."""
    return hashlib.sha256(json.dumps(words, sort_keys=True).encode()).hexdigest()


@cache
def of_program() -> str:
    """SHA-256 of the analysis and the simulator, and the versions of what they count with."""
    found = []
    for package in _PACKAGES:
        spec = find_spec(package)
        if spec is None or spec.origin is None:
            continue
        top = Path(spec.origin).parent
        files = sorted(path for path in top.rglob("*.py") if path.is_file())
        found += [
            (
                package,
                path.relative_to(top).as_posix(),
                hashlib.sha256(path.read_bytes()).hexdigest(),
            )
            for path in files
        ]
    versions = [(name, metadata.version(name)) for name in _COUNTING]
    return of_words(found, versions, list(sys.version_info[:3]))
