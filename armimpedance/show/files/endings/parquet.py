"""Parquet: the columns of the CSV file with their types."""

from __future__ import annotations

from pathlib import Path

from armimpedance.show.files.content import Content
from armimpedance.show.files.endings import Ending


def write(content: Content, path: Path) -> None:
    """Write the table."""
    import pandas as pd

    pd.DataFrame(list(content.rows), columns=list(content.columns)).to_parquet(path, index=False)


ENDING = Ending("columns with types, for large tables", write, long=True)
