"""A crew does each piece once, wherever it is done, and tells what went wrong there."""

from __future__ import annotations

import operator
import os
import time

import pytest

from armimpedance.core.errors import InputError, WorkerError
from armimpedance.core.workers import crew


def process_of(number):
    """Which process does this piece."""
    return number, os.getpid()


def fail(words):
    """A piece with a problem."""
    raise InputError(words)


@pytest.mark.parametrize("processes", [1, 2])
def test_results_are_those_of_the_pieces_in_their_order(processes):
    with crew(processes) as workers:
        first = [workers.share(operator.mul, n, 2) for n in range(20)]
        assert workers.finish(first) == [2 * n for n in range(20)]
        again = [workers.share(operator.add, n, 1) for n in range(3)]
        assert workers.finish(again[::-1]) == [3, 2, 1]


def test_this_process_works_while_the_other_starts():
    with crew(2) as workers:
        pieces = [workers.share(process_of, n) for n in range(3)]
        found = workers.finish(pieces)
    assert [number for number, _ in found] == [0, 1, 2]
    assert found[0][1] != os.getpid()
    assert os.getpid() in (found[1][1], found[2][1])


@pytest.mark.parametrize("processes", [1, 2])
def test_an_error_arrives_from_any_process(processes):
    with crew(processes) as workers:
        piece = workers.share(fail, "no such piece")
        with pytest.raises(InputError, match="no such piece"):
            workers.finish([piece])


def test_a_process_that_is_gone_is_told():
    with crew(2) as workers:
        gone, ours = workers.share(os._exit, 1), workers.share(operator.add, 1, 1)
        with pytest.raises(WorkerError, match="ended before its work was done"):
            workers.finish([gone, ours])
        assert ours.result() == 2


def interrupted(path):
    """A crew that is stopped with one piece begun and one not."""
    with crew(2) as workers:
        workers.share(time.sleep, 0.1)
        workers.share(os.mkdir, path)
        raise KeyboardInterrupt


def test_what_was_not_begun_is_left_when_the_block_ends(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        interrupted(tmp_path / "never")
    assert not (tmp_path / "never").exists()
