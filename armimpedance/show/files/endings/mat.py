"""MATLAB's .mat (version 5, also read by Octave and SciPy): a struct array with units.

``results(1).stiffness``, ``results(1).units.stiffness``, ``results(1).keys.condition``: one struct
a row. Beside it ``checks``, ``methods``, ``made``, and ``mended_names`` with the names that MATLAB
would not take.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from armimpedance.show.files.content import Cells, Content, of_one_cell
from armimpedance.show.files.endings import Ending

#: The first 116 bytes of the file are free text, where SciPy puts the time.
_HEADER: Final = "MATLAB 5.0 MAT-file, written by armimpedance"


def write(content: Content, path: Path) -> None:
    """Write results, checks and methods; the same result gives the same bytes."""
    from scipy.io import savemat

    from armimpedance.show.files.matlab_values import Names, matlab_value, struct_array

    names = Names()
    rows = _structs(content) if content.structs is None else list(content.structs())
    variables = {
        "results": struct_array(rows, names),
        "checks": matlab_value([check.to_dict() for check in content.about.checks], names),
        "methods": content.about.methods,
        "made": matlab_value([{"what": k, "text": v} for k, v in content.about.made], names),
    }
    mended = [{"field": field, "name": name} for field, name in sorted(names.mended.items())]
    variables["mended_names"] = matlab_value(mended, names)
    savemat(str(path), variables, format="5", long_field_names=True, do_compression=True)
    with open(path, "r+b") as stream:
        stream.write(_HEADER.encode("ascii").ljust(116))


def _structs(content: Content) -> list[dict[str, Any]]:
    """Row by row: its texts as `keys`, its numbers by their columns' names, their units."""
    # of columns: where each row has a unit of its own, it stands among the row's keys
    known = {one.quantity: one.unit for one in content.long}
    units = {name: known[name] for name in content.columns if name in known}
    return [_struct(content.columns, row, units) for row in content.rows]


def _struct(columns: Any, row: Cells, units: dict[str, str]) -> dict[str, Any]:
    cells = {name: row.get(name) for name in columns}
    sentences = ("warnings", "provenance", "notes")
    keys = {n: c for n, c in cells.items() if isinstance(c, str) and n not in sentences}
    lists = {name: of_one_cell(str(cells[name] or "")) for name in sentences if name in cells}
    numbers = {n: float("nan") if c is None else c for n, c in cells.items() if n not in keys}
    numbers = {n: c for n, c in numbers.items() if n not in lists}
    return {"keys": keys, **numbers, **({"units": units} if units else {}), **lists}


ENDING = Ending("MATLAB structs with units", write, about=True)
