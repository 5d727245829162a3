"""Stiffness, viscosity and friction of relaxed joints, from any recording that shows them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Final, Literal

from armimpedance.core.errors import InputError
from armimpedance.joint.relaxed.methods import METHODS
from armimpedance.show.verbs.kinds import AnyWord, MethodName, Number, OneOf, PlaceToRead, Switch
from armimpedance.show.verbs.options import DESPITE, LONGEST_GAP, Option, Verb

if TYPE_CHECKING:
    from armimpedance.core.motion import MarkerRecording, MotionRecording
    from armimpedance.core.progress import Progress
    from armimpedance.core.records import Recording
    from armimpedance.joint.relaxed.equations import RestAngle
    from armimpedance.joint.relaxed.passive_fit import PassiveFits
    from armimpedance.show.verbs.results import PathLike


def rest_angles(words: list[str]) -> RestAngle | dict[str, RestAngle]:
    """One rest angle for all joints, or one each; a joint that is not named is free.

    Raises InputError: not an angle, a joint named twice, or an angle for all joints and one for a
    single joint.
    """
    named = {w.split("=", 1)[0]: _angle(w) for w in words if "=" in w}
    if len(words) == 1 and not named:
        return _angle(words[0])
    if len(named) != len(words):
        raise InputError(
            f"--rest-angle {' '.join(words)}", expected="one angle for all joints, or one each"
        )
    return named


def _angle(word: str) -> RestAngle:
    """Parse the angle in ``0.3``, ``free`` or ``elbow=0.3``."""
    text = word.split("=", 1)[-1]
    try:
        value = float("nan" if text == "free" else text)
    except ValueError:
        value = float("nan")
    if value != value and text != "free":
        raise InputError(f"--rest-angle {word}", expected="radians, or free")
    return "free" if text == "free" else value


PASSIVE: Final = Verb(
    "passive",
    (
        DESPITE,
        Option(
            "validate",
            PlaceToRead(),
            "predict its torque too",
            doc="another recording of the same joints, whose torque is predicted",
        ),
        Option(
            "rest_angle",
            AnyWord("RAD|free|JOINT=RAD", 'float, "free", or a mapping of joints to either'),
            "where the elastic torque vanishes: once for all joints, or once per joint (default: "
            "free, that is fitted)",
            "free",
            many=True,
            made=rest_angles,
            doc='where the elastic torque vanishes, rad. ``"free"``: it is fitted, which may widen '
            "the interval of k several times; a joint that a mapping does not name is free",
        ),
        Option(
            "method",
            MethodName(values=METHODS.names),
            f"{METHODS.listed()}; output-error fits the measured swing itself, parallel takes "
            "every term through the filter, ls is the source's with its unfiltered sign",
            doc="a fit to the measured swing itself (the default), every term through the filter, "
            "or the source's with its unfiltered sign",
        ),
        Option(
            "joints",
            AnyWord(python="sequence of str"),
            "an angle of the skeleton (default: its only elbow); may be repeated",
            flag="--joint",
            many=True,
            doc="angles of the skeleton; by default its only elbow. Of a recording of angle and "
            "torque all joints are fitted",
        ),
        Option(
            "quadratic",
            Switch(),
            "fit K (q - q_r)^2 too",
            False,
            doc="whether ``K (q - q_r)^2`` is fitted too",
        ),
        Option(
            "friction",
            Switch(to=False),
            "the joint has no dry friction: f = 0",
            True,
            flag="--without-friction",
            doc="whether ``f sign(qd)`` is fitted; False where the joint has no dry friction",
        ),
        Option(
            "mass_sd_percent",
            Number(unit="%", low=0),
            "standard error of the limb's mass, to which k, h, f are proportional; 0: weighed "
            "(default: the subject's mass_sd_kg, else what tables differ by, 7.5)",
            doc="standard error of the limb's mass, which moves k, h and f in proportion: 0 where "
            "it was weighed. By default that of the recording's subject (``mass_sd_kg``), else "
            "what tables of masses differ by. Not with measured torque",
        ),
        Option(
            "cutoff_hz",
            Number(unit="Hz", above=0, nothing="none"),
            "cut-off of the zero-phase low-pass (default: {default}; a joint that swings at 5 Hz "
            "needs 15)",
            8.0,
            doc="cut-off of the zero-phase low-pass; None: no filter. A joint that swings at 5 Hz "
            "needs 15",
        ),
        Option(
            "emg_gate_percent",
            Number(unit="%", above=0, nothing="off"),
            "a muscle above this part of its maximum is not relaxed (default: {default})",
            3.0,
            flag="--emg-gate",
            doc="a muscle above this part of its maximum is not relaxed; None: the EMG is not "
            "looked at",
        ),
        Option(
            "torque_sign",
            OneOf(values=(1, -1)),
            "kind joint: 1 passive torque, -1 torque of the limb on the device (default: detected)",
            doc="only with angle and torque: 1 where the passive torque is recorded, -1 where it "
            "is the torque of the limb on the device. Without it the sign is turned where no "
            "passive joint could have it",
        ),
        LONGEST_GAP,
    ),
)


@PASSIVE.function
def passive(
    recording: Recording | MarkerRecording | MotionRecording | PathLike,
    *,
    rest_angle: RestAngle | Mapping[str, RestAngle] = "free",
    method: str | None = None,
    quadratic: bool = False,
    friction: bool = True,
    mass_sd_percent: float | None = None,
    joints: Sequence[str] | None = None,
    cutoff_hz: float | None = 8.0,
    emg_gate_percent: float | None = 3.0,
    torque_sign: Literal[1, -1] | None = None,
    longest_gap_s: float | None = None,
    validate: Recording | MarkerRecording | MotionRecording | PathLike | None = None,
    despite: str | Collection[str] = (),
    progress: Progress | None = None,
) -> PassiveFits:
    """Fit ``k (q - q_r) + h qd + f sign(qd) [+ K (q - q_r)^2]`` to the passive torque of joints.

    The torque is measured, or it is minus the torque of inertia and gravity of a skeleton that
    moves like its recorded markers or joints (Venture, in-vivo elbow).

    Parameters
    ----------
    recording : Recording, MarkerRecording, MotionRecording or path
        Angle and torque of joints (kind ``joint``), or markers or joint motion with a skeleton that
        has masses.
    {options}
    progress : function, optional
        Called with the number of steps done and their total: frames of markers, then joints.

    Returns
    -------
    PassiveFits
        One fit per joint, with notes and the level of the EMG.

    Raises
    ------
    InputError
        The recording cannot be read or used, a muscle was active, or an option has no effect on it.
    NotIdentifiableError
        The motion cannot show a parameter; it is named.
    EstimationError
        The search does not converge, or the skeleton cannot follow the markers.

    Examples
    --------
    >>> from armimpedance.joint.relaxed.show import passive
    >>> from manipulandum_sim.passive import simulate_passive
    >>> markers, truth = simulate_passive("release", trials=2, duration_s=4.0)
    >>> elbow = passive(markers, rest_angle=1.5, mass_sd_percent=3)["right_elbow_flexion"]
    >>> elbow.parameters["k"].unit
    'N m/rad'
    >>> list(elbow.to_frame().index)
    ['k', 'h', 'f']
    """
    from armimpedance.joint.relaxed.show.fitting import PassiveModel, PassiveReading, fit_passive

    model = PassiveModel(rest_angle, method, quadratic, friction, mass_sd_percent)
    reading = PassiveReading(
        joints, cutoff_hz, emg_gate_percent, torque_sign, longest_gap_s, progress
    )
    return fit_passive(recording, model, reading, validate=validate, despite=despite)
