"""Base parameters of a body or a robot, from its motion and the forces on it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final, Literal

from armimpedance.core.errors import InputError
from armimpedance.joint.body.methods import METHODS
from armimpedance.show.verbs.kinds import AnyWord, MethodName, Number, OneOf, Switch
from armimpedance.show.verbs.options import LONGEST_GAP, Option, Verb

if TYPE_CHECKING:
    from armimpedance.core.motion import MarkerRecording, MotionRecording
    from armimpedance.core.progress import Progress
    from armimpedance.core.skeleton import Skeleton
    from armimpedance.joint.body.regressor import TermKind
    from armimpedance.joint.body.result import BodyFit
    from armimpedance.show.verbs.results import PathLike


def _rest_angles(words: list[str]) -> dict[str, float]:
    """Parse passive joints and their rest angles from ``NAME=REST_RAD``."""
    rests: dict[str, float] = {}
    for word in words:
        name, _, rest = word.partition("=")
        try:
            rests[name] = float(rest)
        except ValueError:
            raise InputError(
                f"--passive-joint {word}", expected="NAME=REST_RAD, as elbow=0.3"
            ) from None
    return rests


def _motions(word: str) -> int | list[str] | None:
    if word == "all":
        return None
    return int(word) if word.lstrip("-").isdigit() else word.split(",")


BODY: Final = Verb(
    "body",
    (
        Option(
            "method",
            MethodName(values=METHODS.names),
            METHODS.listed(),
            doc="rows weighted by their "
            "residuals (the default), every segment physically possible, plain least squares, or "
            "possible and near the prior",
        ),
        Option(
            "motions",
            AnyWord("N|all|NAMES", "int, sequence of str, or None"),
            "to fit: at most N, chosen by how they excite (default: {default}), all, or these "
            "conditions",
            4,
            made=_motions,
            doc="which conditions to fit: at most so many, chosen by how they excite; these; or "
            "all (None). The others are predicted",
        ),
        Option(
            "prior_sd_percent",
            Number(unit="%", above=0),
            "--method prior: how far a mass may be from the skeleton's (default: 30)",
            doc="only with the method ``prior``: how far a mass may be from the expected one "
            "(default: 30)",
        ),
        Option(
            "what_shows",
            Switch(),
            "fit what these motions show instead of refusing where they show too little",
            False,
        ),
        Option(
            "rows",
            OneOf(values=("base", "all")),
            "base: the root's wrench alone (default of a body); all: every joint's torque too "
            "(default of a robot)",
            doc="the root's wrench alone (default of a body), or every joint's torque too (of a "
            "robot)",
        ),
        Option(
            "cutoff_hz",
            Number(unit="Hz", above=0, nothing="none"),
            "cut-off of the zero-phase low-pass (default: {default})",
            6.0,
            doc="cut-off of the zero-phase low-pass; None: no filter",
        ),
        Option(
            "terms",
            AnyWord(python='sequence of {"viscosity", "friction", "inertia", "offset"}'),
            "what every joint of a robot adds: viscosity, friction, inertia or offset; may be "
            "given again",
            (),
            flag="--term",
            many=True,
            doc="what every joint of a robot adds",
        ),
        Option(
            "passive_joints",
            AnyWord("NAME=REST_RAD", "mapping of names to float"),
            "a relaxed joint: its k, h and f are fitted too; may be repeated",
            flag="--passive-joint",
            many=True,
            made=_rest_angles,
            doc="relaxed joints and their rest angles, rad: their k, h and f are fitted too",
        ),
        LONGEST_GAP,
    ),
)


@BODY.function
def body(
    recording: MotionRecording | MarkerRecording | PathLike,
    *,
    method: str | None = None,
    motions: int | Sequence[str] | None = 4,
    rows: Literal["base", "all"] | None = None,
    cutoff_hz: float | None = 6.0,
    terms: Sequence[TermKind] = (),
    passive_joints: Mapping[str, float] | None = None,
    prior_sd_percent: float | None = None,
    what_shows: bool = False,
    longest_gap_s: float | None = None,
    prior: Skeleton | None = None,
    noise_draws: int | None = None,
    progress: Progress | None = None,
) -> BodyFit:
    """Fit the combinations of masses, first moments and inertias that motion can show.

    For a body on force plates only the six equations of the root are fitted, so no joint torque is
    needed (Venture, poster). For a robot the torques of all joints are fitted.

    Parameters
    ----------
    recording : MotionRecording, MarkerRecording or path
        Joint motion or markers with force plates, or joint motion with the torques of a robot.
    {options}
    prior : Skeleton, optional
        Expected masses and inertias, for the methods ``consistent`` and ``prior``; by default the
        recording's own skeleton.
    noise_draws : int, optional
        Draws of added noise, to remove the bias from the angles' noise (default: 6; 0: none).
    progress : function, optional
        Called with the number of steps done and their total: frames, trials, draws of noise.

    Returns
    -------
    BodyFit
        The combinations that motion can show, their standard errors and the predicted motions.

    Raises
    ------
    InputError
        The recording cannot be read or used, something is in another unit or frame, or an option
        has no effect on it.
    NotIdentifiableError
        The motions do not show all parameters; the error names them.
    EstimationError
        The physically consistent fit does not converge, or the skeleton cannot follow the markers.

    Examples
    --------
    >>> from armimpedance.joint.body.show import body
    >>> from manipulandum_sim.body import simulate_body
    >>> recording, truth = simulate_body(("walk", "all_joints"))
    >>> person = body(recording, motions=("all_joints",), method="ls")
    >>> person.base.rank
    128
    >>> person.parameters["m_pelvis"].unit
    'kg'
    """
    from armimpedance.joint.body.show.fitting import AskedEquations, MassPrior, fit_body

    return fit_body(
        recording,
        AskedEquations(rows, cutoff_hz, terms, passive_joints, longest_gap_s),
        MassPrior(prior, prior_sd_percent),
        method=method,
        motions=motions,
        noise_draws=noise_draws,
        what_shows=what_shows,
        progress=progress,
    )
