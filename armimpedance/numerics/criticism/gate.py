"""The gate before an analysis: a check that says STOP ends it, unless it is named."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding


def refuse_stops(findings: Sequence[Finding], despite: Collection[str] = ()) -> tuple[Finding, ...]:
    """Refuse what a check calls unusable; go on despite the checks that are named.

    Parameters
    ----------
    findings : sequence of Finding
        What was found before the analysis.
    despite : collection of str
        Names of checks that the analysis goes on despite.

    Returns
    -------
    tuple of Finding
        The findings that were overruled: each result is marked with them.

    Raises
    ------
    InputError
        A check says that no number is meant, or `despite` names no check.

    Examples
    --------
    >>> from armimpedance.numerics.criticism import refuse_stops
    >>> from armimpedance.core.findings import Finding
    >>> found = [Finding("force sign", "unusable", "a limb cannot give energy")]
    >>> [one.name for one in refuse_stops(found, despite=["force sign"])]
    ['force sign']
    """
    names = {one.name for one in findings}
    for name in despite:
        if name not in names:
            raise InputError(
                f"no check {name!r} here",
                expected=f"one of {', '.join(sorted(n for n in names if n))}",
            )
    stops = [one for one in findings if one.verdict == "unusable"]
    for one in stops:
        if one.name not in despite:
            raise InputError(
                one.sentence,
                expected=f"a recording without this, or --despite '{one.name}' to go on",
            )
    return tuple(stops)
