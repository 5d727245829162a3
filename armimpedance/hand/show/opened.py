"""A recording of the hand, opened with the columns of its groups."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Literal

from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.hand.show.result_row import check_group_columns
from armimpedance.show.verbs.named import as_columns
from armimpedance.show.verbs.sources import PathLike, naming, read_recording

ForceBy = Literal["limb", "device"]


@contextmanager
def opened(
    source: Recording | PathLike, by: str | Sequence[str], seed: int, force_by: ForceBy | None
) -> Iterator[tuple[Recording, tuple[str, ...]]]:
    """The recording and the columns of its groups; errors inside name its path."""
    columns = as_columns(by)
    check_group_columns(columns)
    if seed < 0:
        raise InputError(f"seed {seed}", expected="0 or more")
    with naming(source):
        yield read_recording(source, force_by=force_by), columns
