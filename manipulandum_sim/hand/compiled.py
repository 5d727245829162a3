"""`coupled.integrate` compiled by Numba: the same equations, eight trials side by side.

NumPy's path is the oracle: position, velocity and force agree to within rounding, some 1e-12 of
each one's largest value (a test asks for 1e-9). The bits differ, because the arctangent is another
routine and sums are ordered otherwise. A trial's bits depend on the trial alone: not on its batch,
not on the workers. Compiling takes some 10 s once; later processes take it from Numba's files.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, cast

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
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
    """The same as `coupled.integrate`, to within rounding.

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
    from numba import typeof

    from manipulandum_sim.hand.kernel import LANES

    h, trials = course.step_s, len(course.onset)
    # groups of LANES; the last one is filled up with copies of its last trial
    groups = np.minimum(np.arange(-(-trials // LANES) * LANES), trials - 1).reshape(-1, LANES)
    push = np.empty((0, 2, trials)) if voluntary is None else voluntary
    out = np.empty((trials, samples, 6))
    arguments = (
        _constants(plant),
        _paths(plant),
        _given(plant, course)[:, groups].swapaxes(0, 1).reshape(len(groups), -1),
        np.ascontiguousarray(course.table.T),
        np.asarray(course.onset, dtype=np.int64)[groups],
        *(float(h), int(substeps)),
        0 if reflex_delay_s is None else max(1, round(reflex_delay_s / h)),
        np.moveaxis(push[..., groups], 2, 0).reshape(len(groups), len(push), 2 * LANES),
        out,
    )
    _compiled(tuple(typeof(argument) for argument in arguments))(*arguments)
    position, velocity, force = (out[..., i : i + 2].transpose(1, 2, 0) for i in (0, 2, 4))
    return Track(position, velocity, force)


@cache
def _compiled(types: tuple[Any, ...]) -> Callable[..., None]:
    """The kernel for arguments of such types, from Numba's files, or compiled and kept there.

    Numba keeps machine code beside the kernel, or in the user's own cache folder where that place
    is read-only. No place, a full disk or a damaged file costs the time to compile, and no run.
    """
    from numba import njit

    from manipulandum_sim.hand.kernel import run_trials

    kernel: Any
    try:
        kernel = njit(error_model="numpy", nogil=True, cache=True)(run_trials)
        kernel.compile(types)
    except Exception:
        # of many kinds: what fails without files as well is raised there
        kernel = njit(error_model="numpy", nogil=True)(run_trials)
        kernel.compile(types)
    return cast(Callable[..., None], kernel)


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


def _paths(plant: CoupledPlant) -> tuple[tuple[float, ...], ...]:
    """Slope, sine and cosine of each muscle over the shoulder, then over the elbow."""
    paths = plant.arm.paths
    parts = np.stack([paths.slope, paths.sine, paths.cosine])
    return tuple(tuple(row) for row in parts.transpose(1, 2, 0).reshape(6, 6).tolist())


def _given(plant: CoupledPlant, course: Course) -> FloatArray:
    """`kernel.ROWS` rows of all trials at their start, (ROWS, T)."""
    trials = len(course.onset)
    muscles = np.stack([np.broadcast_to(entry, (6, trials)) for entry in plant.muscles], axis=1)
    # velocity; command, time and voluntary force; delayed stretch and outcome: the kernel sets them
    return np.concatenate(
        [
            *(course.place, np.zeros((2, trials)), course.place, course.direction),
            np.zeros((6, trials)),
            np.stack([np.broadcast_to(gain, trials) for gain in plant.gains]),
            *(muscles.reshape(36, trials), np.zeros((6 + 16, trials))),
        ]
    )
