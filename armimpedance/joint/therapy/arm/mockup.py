"""Test the robot with a mock-up of the arm made of weighed pipes.

The source moves a mock-up through elevation at constant speed, where only gravity acts, and about
the vertical axis with minimum jerk, where only inertia acts (Fig. 4). Here the model's torque is
scaled to fit the measured one; a scale of one means that robot and arm model are right. Torques
that a mock-up cannot have are due to the robot, and are fitted as well: a torque that changes its
sign with the direction (friction), and, about the vertical axis, where inertia torques are only
tenths of a N m, a torque that is linear in the angle (cables).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.joint.therapy.arm.axis_stiffness import direction_of, sliding_samples
from armimpedance.joint.therapy.arm.movements import MovementTorques, movement_torques
from armimpedance.joint.therapy.arm.passive_arm import ArmSegment, PassiveArm
from armimpedance.joint.therapy.robot.checks import check_recording
from armimpedance.joint.therapy.robot.steady import no_step
from armimpedance.joint.therapy.robot.therapy_robot import FOREARM, UPPER_ARM, TherapyRobot
from armimpedance.numerics.regression import NamedParameter, fit, pool, ragged_factors

if TYPE_CHECKING:
    import pandas as pd

#: Axes about which a mock-up is moved, by their names in the robot.
ELEVATION: Final = "elevation"
HORIZONTAL: Final = "horizontal"
#: Fewest trials about each.
FEWEST: Final = 2

#: Mass in kg, length and diameter in m of a tube; then those of the source's mock-up.
Tube = tuple[float, float, float]
SOURCE_UPPER: Final[Tube] = (1.8, 0.32, 0.100)
SOURCE_LOWER: Final[Tube] = (1.7, 0.30, 0.090)


@dataclass(frozen=True, repr=False)
class MockupCheck:
    """Gravity and inertia of a mock-up, measured by the robot and from its weight.

    Attributes
    ----------
    gravity, inertia : NamedParameter
        Torque about the elevation axis with the straight arm level, N m; inertia of the straight
        level arm about the vertical axis, kg m^2.
    gravity_model_Nm, inertia_model_kgm2 : float
        The same quantities from its masses and lengths.
    gravity_rms_Nm, inertia_rms_Nm : float
        Root mean square residuals of the fits, N m.
    """

    gravity: NamedParameter
    inertia: NamedParameter
    gravity_model_Nm: float
    inertia_model_kgm2: float
    gravity_rms_Nm: float
    inertia_rms_Nm: float

    def to_dict(self) -> list[dict[str, Any]]:
        """One mapping each for gravity and inertia: measured, with 95 % limits, and from
        weighing."""
        pairs = (
            (self.gravity, self.gravity_model_Nm, self.gravity_rms_Nm),
            (self.inertia, self.inertia_model_kgm2, self.inertia_rms_Nm),
        )
        return [
            {
                "parameter": measured.name,
                "value": measured.value,
                "sd": measured.sd_robust,
                "ci_low": measured.ci95[0],
                "ci_high": measured.ci95[1],
                "unit": measured.unit,
                "model": model,
                "rms_Nm": left,
            }
            for measured, model, left in pairs
        ]

    def to_frame(self) -> pd.DataFrame:
        """Gravity and inertia: measured, with 95 % limits, and from weighing (`model`)."""
        import pandas as pd

        return pd.DataFrame(self.to_dict()).set_index("parameter")

    def __repr__(self) -> str:
        return (
            f"{self.gravity!r}, weighed {self.gravity_model_Nm:.4g}\n"
            f"{self.inertia!r}, weighed {self.inertia_model_kgm2:.4g}"
        )

    def _repr_html_(self) -> str:
        return str(self.to_frame().to_html(escape=True))


def pipes(upper: Tube = SOURCE_UPPER, lower: Tube = SOURCE_LOWER) -> tuple[ArmSegment, ArmSegment]:
    """Segments of a mock-up of the arm: two thin tubes, each starting at its link's origin.

    Parameters
    ----------
    upper, lower : (mass_kg, length_m, diameter_m)
        By default the source's two pipes, its Fig. 4; its robot is adjusted to the first one's
        .32 m.

    Returns
    -------
    tuple of 2 ArmSegment

    Raises
    ------
    RecordError
        A negative number.
    """
    return _pipe("upper_pipe", UPPER_ARM, *upper), _pipe("lower_pipe", FOREARM, *lower)


def _pipe(name: str, link: str, mass_kg: float, length_m: float, diameter_m: float) -> ArmSegment:
    radius = diameter_m / 2
    # thin tube: I = m (l^2 / 12 + r^2 / 2) across, m r^2 about its axis
    across = mass_kg * (length_m**2 / 12 + radius**2 / 2)
    return ArmSegment(name, link, mass_kg, length_m / 2, across, mass_kg * radius**2)


def check_mockup(
    recording: Recording,
    robot: TherapyRobot,
    segments: Sequence[ArmSegment],
    *,
    upper_arm_m: float | None = None,
    step: Callable[[], object] = no_step,
) -> MockupCheck:
    """Measure gravity and inertia of the mock-up with the robot.

    Parameters
    ----------
    recording : Recording
        Movements about elevation, up and down at constant speed, and about the vertical axis.
    robot : TherapyRobot
        Identified.
    segments : sequence of ArmSegment
        The mock-up, weighed; see `pipes`.
    upper_arm_m : float, optional
        Length to which the robot was adjusted, m; by default that of the recording's subject.
    step : function, optional
        Called after every trial.

    Returns
    -------
    MockupCheck

    Raises
    ------
    InputError
        Fewer than two movements about either axis, elevation in one direction only, no length, or a
        recording that `movements.movement_torques` refuses.
    """
    check_recording(recording, robot)
    length = upper_arm_m if upper_arm_m is not None else recording.subject.upper_arm_m
    if length is None:
        raise InputError("the upper arm's length is not known", expected="upper_arm_m")
    arm = PassiveArm(recording.subject.id, robot.name, length, tuple(segments), mass_sd=0.0)
    torques = movement_torques(recording, robot, arm, step=step)
    gravity_model, inertia_model = _straight_and_level(robot, arm)
    gravity, gravity_rms = _scaled("gravity", "N m", gravity_model, ELEVATION, torques, robot)
    inertia, inertia_rms = _scaled("inertia", "kg m^2", inertia_model, HORIZONTAL, torques, robot)
    return MockupCheck(gravity, inertia, gravity_model, inertia_model, gravity_rms, inertia_rms)


def _straight_and_level(robot: TherapyRobot, arm: PassiveArm) -> tuple[float, float]:
    """Gravity torque about elevation, N m, and inertia about the vertical axis, kg m^2."""
    from armimpedance.joint.therapy.arm.passive_arm import arm_bodies

    bodies = arm_bodies(robot.adjusted_to(arm.upper_arm_m), arm)
    level, up = np.zeros((2, robot.n_axes)), np.zeros((2, robot.n_axes))
    high, turn = robot.axes.index(ELEVATION), robot.axes.index(HORIZONTAL)
    level[:, high] = np.pi / 2
    up[1, turn] = 1.0
    still, turned = bodies.torque(level, np.zeros_like(level), up)
    return float(still[high]), float(turned[turn] - still[turn])


def _scaled(
    name: str,
    unit: str,
    model: float,
    axis_name: str,
    torques: Sequence[MovementTorques],
    robot: TherapyRobot,
) -> tuple[NamedParameter, float]:
    """The model's number times the fitted scale, and the residual, N m rms."""
    group = _about(axis_name, torques)
    loads = robot.identified
    rise = float(loads.rise_rad_s[group[0].axis])
    sliding = [sliding_samples(t, rise) for t in group]
    both_ways = len({direction_of(t) for t in group}) > 1
    columns = [_columns(t, rows, both_ways) for t, rows in zip(group, sliding, strict=True)]
    names = tuple(columns[0])
    W = [np.stack(list(named.values()), axis=1) for named in columns]
    S = [t.support[rows, None] for t, rows in zip(group, sliding, strict=True)]
    # S (N, 1) = [rigid arm, direction, q, 1] (N, c) (scale, h, k, b) (c,)
    factors = ragged_factors(W, S, regressors=names, outputs=("support",))
    fitted = fit(factors, covariance="cr1", parameter_names=names)
    gradient = _robot_gradient(W, names, group, sliding)
    of_fit = float(fitted.covariance[0, 0])
    of_robot = float(gradient @ loads.covariance @ gradient)
    spread = of_fit**2 / fitted.dof + of_robot**2 / loads.dof
    parameter = NamedParameter(
        name=name,
        value=model * float(fitted.parameters[0]),
        sd=model * float(np.sqrt(of_fit)),
        sd_robust=model * float(np.sqrt(of_fit + of_robot)),
        unit=unit,
        dof=(of_fit + of_robot) ** 2 / spread if spread > 0 else float("inf"),
    )
    return parameter, fitted.residual_sd


def _about(axis_name: str, torques: Sequence[MovementTorques]) -> list[MovementTorques]:
    group = [t for t in torques if t.axis_name == axis_name]
    one_way = len({direction_of(t) for t in group}) == 1
    vertical = axis_name == ELEVATION
    if len(group) < FEWEST or (vertical and one_way):
        raise InputError(
            f"{len(group)} movements of the mock-up about {axis_name}"
            + (", in one direction" if one_way else ""),
            expected=f"{FEWEST} or more" + (", up and down" if vertical else ""),
        )
    return group


def _columns(torques: MovementTorques, rows: slice, both_ways: bool) -> dict[str, FloatArray]:
    ones = np.ones_like(torques.q[rows])
    columns = {"scale": torques.rigid_arm[rows]}
    if both_ways:
        columns["direction"] = direction_of(torques) * ones
    if torques.axis_name == HORIZONTAL:
        columns |= {"k": torques.q[rows], "offset": ones}
    return columns


def _robot_gradient(
    W: Sequence[FloatArray],
    names: tuple[str, ...],
    group: Sequence[MovementTorques],
    kept: Sequence[slice],
) -> FloatArray:
    """Derivative ``d scale / d theta`` (p,), by the same regression of ``-d tau_r / d theta``."""
    parts = [-t.robot_gradient[rows] for t, rows in zip(group, kept, strict=True)]
    outputs = tuple(f"theta_{i}" for i in range(parts[0].shape[1]))
    beside = ragged_factors(W, parts, regressors=names, outputs=outputs)
    return np.asarray(pool(beside).coefficients[0])
