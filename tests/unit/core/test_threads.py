"""Linear algebra has one thread in every analysis, whatever the process was given."""

import json
import os
import subprocess
import sys

import scipy.linalg  # noqa: F401 - a library's threads are seen only where it is loaded
from threadpoolctl import threadpool_info, threadpool_limits

from armimpedance.core.workers import crew, one_thread, single_threaded


def threads():
    return [one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"]


def test_a_block_and_a_function_have_one_and_give_it_back():
    with threadpool_limits(2, user_api="blas"):
        before = threads()
        # a library of another package that was built for one thread stays at one
        assert max(before) == 2
        with one_thread():
            assert set(threads()) == {1}
        assert set(single_threaded(threads)()) == {1}
        assert threads() == before


def test_workers_have_one(monkeypatch):
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        monkeypatch.setenv(variable, "2")
    with crew(2) as others:
        pieces = [others.share(threads) for _ in range(2)]
        assert all(set(found) == {1} for found in others.finish(pieces))


SAME = """
import json, sys
import armimpedance as ai
from manipulandum_sim.hand import simulate
session, _ = simulate("cocontraction", seed=1, sets=2, conditions=["cocontraction_10"])
hand = ai.estimate(session)
print(json.dumps(hand.to_frame().iloc[0].tolist(), default=str))
"""


def test_an_estimate_has_the_same_bits_whatever_the_threads():
    found = []
    for count in ("1", "4"):
        own = {**os.environ, "OMP_NUM_THREADS": count, "OPENBLAS_NUM_THREADS": count}
        done = subprocess.run(
            [sys.executable, "-c", SAME], env=own, capture_output=True, text=True, check=True
        )
        found.append(json.loads(done.stdout))
    assert found[0] == found[1]
