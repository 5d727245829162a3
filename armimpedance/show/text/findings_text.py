"""What the checks of a fit found, as lines of text."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from armimpedance.core.findings import Finding
from armimpedance.show.text.numbers import TABLE_WIDTH


def checks_lines(checks: Sequence[Finding]) -> list[str]:
    """One line a check: its mark, what was seen, the smallest violation it would have seen.

    Parameters
    ----------
    checks : sequence of Finding

    Returns
    -------
    list of str
        A heading above them; empty where nothing was checked.
    """
    if not checks:
        return []
    indent = " " * 8
    lines = [textwrap.fill(f"  {check}", TABLE_WIDTH, subsequent_indent=indent) for check in checks]
    return ["", "Checks of the model's assumptions", *lines]
