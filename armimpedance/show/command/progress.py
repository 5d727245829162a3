"""Progress bars on what takes longer than a second; silent where nobody watches."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from armimpedance.core.progress import Progress

DELAY_S = 1.0


@contextmanager
def bar(title: str) -> Iterator[Progress]:
    """A bar fed by ``progress(done, all)``; it shows after a second, and only on a terminal."""
    from tqdm import tqdm

    with tqdm(desc=title, disable=None, delay=DELAY_S, leave=False) as shown:

        def progress(done: int, total: int) -> None:
            shown.total = total
            shown.update(done - shown.n)

        yield progress
