"""A long record as blocks that take the place of trials."""

from __future__ import annotations

from armimpedance.core.errors import InputError


def split_blocks(n_rows: int, block_rows: int) -> tuple[slice, ...]:
    """Split a long trial into blocks that serve as its clusters.

    All blocks have `block_rows` rows or up to twice less one more: a short rest would be a
    cluster that says little, so it joins the last block. Blocks must be much longer than the
    memory of the residuals.

    Parameters
    ----------
    n_rows, block_rows : int

    Returns
    -------
    tuple of slice

    Raises
    ------
    InputError
        Fewer than two blocks fit.
    """
    count = n_rows // block_rows if block_rows > 0 else 0
    if count < 2:
        raise InputError(
            f"{n_rows} rows in blocks of {block_rows}", expected="room for two blocks or more"
        )
    edges = [*range(0, count * block_rows, block_rows), n_rows]
    return tuple(slice(a, b) for a, b in zip(edges[:-1], edges[1:], strict=True))
