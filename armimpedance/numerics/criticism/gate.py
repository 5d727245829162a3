"""The gate before an analysis: a finding of "unusable" ends it, unless the user overrules it."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding


def refuse_stops(findings: Sequence[Finding], despite: Collection[str] = ()) -> tuple[Finding, ...]:
    """Refuse data that a check calls unusable; go on if the check is named in `despite`.

    Parameters
    ----------
    findings : sequence of Finding
        Findings of the checks before the analysis.
    despite : collection of str
        Names of checks whose verdict "unusable" is overruled.

    Returns
    -------
    tuple of Finding
        The overruled findings; each result is marked with them.

    Raises
    ------
    InputError
        A check says "unusable" and is not overruled, or `despite` holds a name of no check.

    Examples
    --------
    >>> from armimpedance.numerics.criticism import refuse_stops
    >>> from armimpedance.core.findings import Finding
    >>> found = [Finding("force sign", "unusable", "a limb cannot give energy")]
    >>> [one.name for one in refuse_stops(found, despite=["force sign"])]
    ['force sign']
    """
    names = {finding.name for finding in findings}
    for name in despite:
        if name not in names:
            raise InputError(
                f"no check {name!r} here",
                expected=f"one of {', '.join(sorted(n for n in names if n))}",
            )
    stops = [finding for finding in findings if finding.verdict == "unusable"]
    for finding in stops:
        if finding.name not in despite:
            raise InputError(
                finding.sentence,
                expected=f"a recording without this, or --despite '{finding.name}' to go on",
            )
    return tuple(stops)
