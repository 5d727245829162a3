"""The forms in which recordings and results are shared, by their names."""

from __future__ import annotations

from typing import Any, Final

from armimpedance.core.method_table import MethodTable

#: Each with `what`, `endings`, `takes` and `share`; nothing is imported for their names.
SHARED_FORMS: Final[MethodTable[Any]] = MethodTable(
    "armimpedance.show.files.sharing.forms", "FORM", "form", joint="-"
)
