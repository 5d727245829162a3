"""`coupled.integrate` compiled by Numba: the same equations, one trial after another.

NumPy's path is the oracle: position, velocity and force agree to within rounding, some 1e-12 of
each one's largest value (a test asks for 1e-9). The bits differ, because NumPy's arctangent and
square root of vectors are other routines than those of single numbers, and sums are ordered
otherwise. A trial's bits depend on the trial alone: not on its batch, not on the workers.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.errors import InputError
from manipulandum_sim.hand.coupled import CoupledPlant, Course, Track
from manipulandum_sim.hand.two_link import TwoLink


def check_compiler() -> None:
    """See that Numba is there.

    Raises
    ------
    InputError
        It is not; the message says how to install it.
    """
    try:
        import numba  # noqa: F401
    except ImportError:
        raise InputError(
            "a compiled simulation needs the package numba, which is not installed",
            expected='pip install "armimpedance[fast]", or a run that is not compiled',
        ) from None


def integrate_compiled(
    plant: CoupledPlant,
    course: Course,
    samples: int,
    substeps: int,
    voluntary: FloatArray | None = None,
    reflex_delay_s: float | None = None,
) -> Track:
    """What `coupled.integrate` gives, to within rounding.

    Parameters
    ----------
    plant, course, samples, substeps, voluntary, reflex_delay_s
        As for `coupled.integrate`.

    Returns
    -------
    Track

    Raises
    ------
    InputError
        If Numba is not installed.
    """
    check_compiler()
    h, trials = course.step_s, len(course.onset)
    delay = 0 if reflex_delay_s is None else max(1, round(reflex_delay_s / h))
    push = np.empty((trials, 0, 2)) if voluntary is None else voluntary.transpose(2, 0, 1)
    out = np.empty((trials, samples, 6))
    arguments = (
        _constants(plant),
        _paths(plant),
        _rows(plant.muscles),
        _rows([np.broadcast_to(gain, trials) for gain in plant.gains]),
        _rows([*course.place, *course.direction]),
        np.ascontiguousarray(course.table),
        np.ascontiguousarray(course.onset, dtype=np.int64),
        *(float(h), int(substeps), delay),
        np.ascontiguousarray(push),
        out,
    )
    _compiled()(*arguments)
    position, velocity, force = (out[..., i : i + 2].transpose(1, 2, 0) for i in (0, 2, 4))
    return Track(position, velocity, force)


@cache
def _compiled() -> Callable[..., None]:
    """The kernel, from Numba's files where it keeps them, else compiled in this process."""
    from numba import njit

    from manipulandum_sim.hand.kernel import run_trials

    in_memory: Any = njit(error_model="numpy", nogil=True)
    return in_memory(run_trials)


def _chain(link: TwoLink) -> tuple[float, ...]:
    placed = (link.inertia1, link.inertia2, link.base_x, link.base_y, link.elbow)
    return tuple(float(number) for number in (*link.constants, *placed))


def _constants(plant: CoupledPlant) -> tuple[Any, ...]:
    """`kernel.Plant` of a plant."""
    link, passive = plant.arm.link, plant.arm.passive
    joints = (*passive.stiffness, *passive.viscosity, *passive.rest)
    return (
        _chain(link),
        _chain(plant.robot.link),
        (float(link.l1), float(link.l2)),
        tuple(float(number) for number in joints),
        (float(plant.cast_kg), float(plant.robot.handle_kg)),
    )


def _paths(plant: CoupledPlant) -> FloatArray:
    """Slope, sine and cosine of each muscle over the shoulder, then over the elbow, (6, 6)."""
    paths = plant.arm.paths
    parts = np.stack([paths.slope, paths.sine, paths.cosine])
    return np.ascontiguousarray(parts.transpose(1, 2, 0).reshape(6, 6))


def _rows(entries: Any) -> FloatArray:
    """Entries (..., T) of a batch as rows of its trials, (T, ..., n)."""
    stacked = np.stack([np.asarray(entry, dtype=float) for entry in entries])
    return np.ascontiguousarray(stacked.T)
