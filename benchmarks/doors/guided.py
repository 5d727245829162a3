"""Coverage-guided bytes for the readers that are pure Python: what new line does an input reach?

Optional, and for hours: it needs `pip install atheris` (Linux, CPython 3.11 to 3.13), which is no
dependency. A file that ends other than by being read or by a typed error stops the run, and is left
behind as `crash-...`.

    python benchmarks/doors/guided.py .trc corpus -max_total_time=3600
"""

from __future__ import annotations

import sys
import tempfile
import warnings
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["armimpedance"]):
    from small_files import DOORS

    from armimpedance.core.errors import LONGEST_MESSAGE, ArmImpedanceError


def main() -> None:
    """Fuzz one door, from its small valid file on."""
    name = sys.argv.pop(1)
    door = DOORS[name]
    warnings.simplefilter("error")
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            door.build(home)
        place = door.place(home)
        corpus = next((Path(word) for word in sys.argv[1:] if not word.startswith("-")), None)
        if corpus is not None:
            corpus.mkdir(exist_ok=True)
            (corpus / "sound").write_bytes(place.read_bytes())

        def one(data: bytes) -> None:
            place.write_bytes(data)
            try:
                door.read(place)
            except ArmImpedanceError as error:
                text = str(error)
                near = {place.name, *(file.name for file in place.parent.iterdir())}
                named = any(word in text for word in near)
                if not (named and text.isprintable() and len(text) <= LONGEST_MESSAGE):
                    raise AssertionError(text) from error

        atheris.Setup(sys.argv, one)
        atheris.Fuzz()


if __name__ == "__main__":
    main()
