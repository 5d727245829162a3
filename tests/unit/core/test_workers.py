"""A crew does each piece once, wherever it is done, and tells what went wrong there."""

from __future__ import annotations

import operator
import os
import signal
import time

import pytest

from armimpedance.core.errors import InputError, WorkerError
from armimpedance.core.workers import Crew, crew


def process_of(number):
    """Which process does this piece."""
    return number, os.getpid()


def fail(words):
    """A piece with a problem."""
    raise InputError(words)


@pytest.mark.parametrize("processes", [1, 2])
def test_results_and_errors_are_those_of_the_pieces_in_their_order(processes):
    with crew(processes) as workers:
        first = [workers.share(operator.mul, n, 2) for n in range(20)]
        assert workers.finish(first) == [2 * n for n in range(20)]
        again = [workers.share(operator.add, n, 1) for n in range(3)]
        assert workers.finish(again[::-1]) == [3, 2, 1]
        # what is wrong with a piece arrives as it was raised
        wrong = workers.share(fail, "no such piece")
        with pytest.raises(InputError, match="no such piece"):
            workers.finish([wrong])


def test_this_process_works_while_the_other_starts():
    with crew(2) as workers:
        pieces = [workers.share(process_of, n) for n in range(3)]
        found = workers.finish(pieces)
    assert [number for number, _ in found] == [0, 1, 2]
    assert found[0][1] != os.getpid()
    assert os.getpid() in (found[1][1], found[2][1])


def test_a_process_that_is_gone_is_told():
    with crew(2) as workers:
        gone, ours = workers.share(os._exit, 1), workers.share(operator.add, 1, 1)
        with pytest.raises(WorkerError, match="ended before its work was done.*fewer workers"):
            workers.finish([gone, ours])
        assert ours.result() == 2


def kill(number):
    """A piece whose process is killed, as by a system without memory."""
    os.kill(os.getpid(), number)


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no such signal here")
def test_one_that_is_killed_costs_its_own_piece_and_another_one_goes_on():
    with Crew(1) as beside:
        gone = beside.share(kill, signal.SIGKILL)
        others = [beside.share(process_of, n) for n in range(3)]
        with pytest.raises(WorkerError, match="killed, or out of memory"):
            gone.result(60)
        found = [other.result(60) for other in others]
    assert [number for number, _ in found] == [0, 1, 2]
    assert len({process for _, process in found} - {os.getpid()}) == 1


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no such signal here")
def test_that_one_was_killed_is_told_before_all_else_is_done():
    with crew(2) as workers:
        gone = workers.share(kill, signal.SIGKILL)
        others = [workers.share(time.sleep, 0.05) for _ in range(2000)]
        with pytest.raises(WorkerError):
            workers.finish([*others, gone])
        assert not others[-1].done()


def test_a_result_that_cannot_be_sent_is_told():
    with Crew(1) as beside:
        for piece in ((open, os.devnull), (eval, "lambda: 1")):
            with pytest.raises(WorkerError, match="pickle"):
                beside.share(*piece).result(60)


def hold(folder):
    """A piece that would take for ever, with something half done."""
    inner = folder / "half"
    inner.mkdir()
    try:
        time.sleep(600)
    finally:
        inner.rmdir()


def deaf(folder):
    """A piece that does not let itself be asked."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    (folder / "half").mkdir()
    time.sleep(600)


@pytest.mark.parametrize("piece", [hold, pytest.param(deaf, marks=pytest.mark.study)])
def test_what_is_under_way_when_the_block_ends_is_stopped_and_tidies_up(tmp_path, piece):
    with Crew(1) as beside:
        asked = beside.share(piece, tmp_path)
        until = time.monotonic() + 60
        while not (tmp_path / "half").exists() and time.monotonic() < until:
            time.sleep(0.02)
        assert not asked.done()
    assert time.monotonic() < until
    assert (tmp_path / "half").exists() == (piece is deaf)
    with pytest.raises(WorkerError):
        asked.result(60)


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
