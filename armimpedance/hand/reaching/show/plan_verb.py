"""The verb `plan_movement`: compare pushes of a reaching hand by the trials that they need."""

from __future__ import annotations

from collections.abc import Collection

from armimpedance.core.records import Recording
from armimpedance.hand.reaching.push_plan import MovementPlan, plan_movement as plan_pushes
from armimpedance.hand.reaching.show.fitting import CHECKS
from armimpedance.hand.show.estimates import ForceBy
from armimpedance.show.verbs.checks import checked
from armimpedance.show.verbs.results import PathLike, naming, read_recording


def plan_movement(
    pilot: Recording | PathLike,
    *,
    k_percent: float = 10.0,
    phase: str | None = None,
    robot_kg: float = 1.0,
    max_force_n: float = 10.0,
    max_displacement_m: float = 0.01,
    force_by: ForceBy | None = None,
    despite: str | Collection[str] = (),
) -> MovementPlan:
    """Compare pushes of a reaching hand by the trials that they need, from a small pilot.

    Parameters
    ----------
    pilot : Recording or path
        At least ten free reaches and eight pushed ones of a phase.
    k_percent : float
        Required error of K, which 95 of 100 experiments stay below.
    phase : str, optional
        Default: the pilot's first.
    robot_kg : float
        Mass of robot and handle that a pushed hand carries.
    max_force_n, max_displacement_m : float
        Limits of the pushes.
    force_by : {"limb", "device"}, optional
    despite : str or collection of str
        Names of checks of `inspect` whose STOP is overruled.

    Returns
    -------
    MovementPlan
        Shapes of pushes, the best first.

    Raises
    ------
    InputError
        The pilot cannot be read or lacks something, or a number is not positive.
    NotIdentifiableError
        The pilot does not determine the arm's impedance.

    Examples
    --------
    >>> from armimpedance.hand.reaching.show import plan_movement
    >>> from manipulandum_sim.movement import simulate_movement
    >>> pilot, _ = simulate_movement(seed=1, repeats=2, unperturbed=15, phases=(0.5,))
    >>> plan_movement(pilot).pushes[0].shape.kind
    'displacement'
    """
    with naming(pilot):
        read = read_recording(pilot, force_by=force_by)
        checked(read, despite, CHECKS)
        return plan_pushes(
            read,
            k_percent=k_percent,
            phase=phase,
            robot_kg=robot_kg,
            max_force_n=max_force_n,
            max_displacement_m=max_displacement_m,
        )
