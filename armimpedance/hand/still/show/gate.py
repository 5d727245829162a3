"""Checks before analyses that fit a limb pushed and brought back, or driven at random."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Final

from armimpedance.core.records import Recording
from armimpedance.hand.still.checks import check_driven, check_response
from armimpedance.show.verbs.checks import (
    TopicChecks,
    disturbed_checks,
    in_groups,
    marks_of,
    spread,
)

#: Checks of this topic only.
CHECKS: Final = TopicChecks(response=check_response)


def checked_response(
    recording: Recording,
    despite: str | Collection[str] = (),
    *,
    by: Sequence[str] = ("condition",),
) -> tuple[str, ...]:
    """Check a recording before force is fitted on motion; refuse it if nothing was disturbed.

    Parameters
    ----------
    recording : Recording
        Of more than 4000 trials, 4000 spread over all are checked.
    despite : str or collection of str
        Names of checks whose STOP is overruled.
    by : sequence of str
        Columns whose groups are fitted: each must show all directions, not each condition.

    Returns
    -------
    tuple of str
        Marks for each result: the checks that were overruled, and assumptions of the fit that the
        data contradict.

    Raises
    ------
    InputError
        A check says STOP and is not named in `despite`; or `despite` names no check.

    Examples
    --------
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> from armimpedance.hand.still.show import checked_response
    >>> checked_response(recording)
    ()
    """
    recording = spread(in_groups(recording, by))
    findings = [
        *recording.findings,
        *disturbed_checks(recording, CHECKS),
        *check_driven(recording),
    ]
    return marks_of(findings, despite)
