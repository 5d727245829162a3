"""Linear algebra has one thread in every analysis, whatever the process was given."""

import numpy as np
import scipy.linalg  # noqa: F401 - a library's threads are seen only where it is loaded
from threadpoolctl import threadpool_info, threadpool_limits

import armimpedance as ai
from armimpedance.core.workers import crew, one_thread, single_threaded
from manipulandum_sim.hand import IDEAL, simulate


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


def test_an_estimate_has_the_same_bits_whatever_the_threads():
    """Of a process that was started with several, the benchmark's folder of the same key tells."""
    session, _ = simulate(
        "cocontraction", seed=1, sets=2, conditions=["cocontraction_10"], servo=IDEAL
    )
    found = []
    for count in (1, 4):
        with threadpool_limits(count, user_api="blas"):
            assert max(threads()) == count
            found.append(ai.estimate(session)[0])
    one, many = found
    for name in ("inertia", "viscosity", "stiffness", "covariance"):
        np.testing.assert_array_equal(getattr(one, name), getattr(many, name))
