"""The three sentences that a reader wants first, from what the checks found."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from armimpedance.core.findings import Finding
from armimpedance.show.pages.page import Verdict

#: Name of a check -> what to do where it is violated or cannot tell; names that several topics
#: share mean the same in each.
ADVICE: Final = {
    "units": "Give SI units (N, N m, m, rad) and analyse again.",
    "clipping": "Use a sensor with more range, or leave the trials out that are clipped.",
    "force sign": "Say whose force the sensor holds (--force-by), or turn the sign of all axes.",
    "force scale": "Hang a known weight on the sensor and give the force in newtons.",
    "axes": "Push the handle by hand along each axis and see which column answers.",
    "force axes": "Push the handle by hand along each axis and see which column answers.",
    "delay": "Record force and motion on one clock, or say how much later one of them is.",
    "skew": "Record all channels on one clock, or say how much later one of them is.",
    "reflex": "Use shorter disturbances, or take the limb's own part that `reflex` gives.",
    "own motion": "Take --method instruments or frequency, repeat each direction more often, or a "
    "robot that imposes the motion.",
    "amplitude": "Use smaller motions, and say at which amplitude the numbers hold.",
    "lack of fit": "Look at the residuals, and at what the message names.",
    "copies": "Take the copies out: each trial counts once.",
    "imposed": "Say in recording.json what the rig imposes, and record its command.",
    "voluntary": "Ask for a steady contraction, record longer, or disturb more strongly.",
    "muscles": "Leave out the trials in which a muscle works.",
    "muscles silent": "Record EMG, or leave out the trials in which a muscle works.",
    "mass": "Weigh or scale the segments, and say how well the masses are known.",
    "lengths": "Measure both lengths from bony landmarks.",
    "reach": "Measure where the shoulder is in the robot's frame, in metres.",
    "directions": "Disturb in all directions in every condition, or group trials by another column "
    "(--by).",
    "disturbance": "Look at the trials that the message names; leave them out.",
    "returns to start": "Any method but `paper` allows for a hand that does not return.",
    "coherence": "Look whether something disturbed the limb at all, and at its units.",
    "crosstalk": "Move the electrodes apart, or record the raw EMG.",
    "curvature": "Fit the law over a smaller range.",
    "rest angle": "Leave the rest angle free unless it was measured.",
    "trials": "Record more trials.",
}
_OTHERWISE: Final = "Read the check below and decide whether it matters for your question."
_UNCHECKED: Final = (
    "No result carries a warning; a file of results holds no trials that could be checked again."
)
#: What weighs most comes first.
_ORDER: Final = ("unusable", "warning", "cannot tell")


def verdict_of(findings: Sequence[Finding], next_step: str, count: str) -> Verdict:
    """Whether the numbers can be trusted, what is wrong, and what to do next.

    Parameters
    ----------
    findings : sequence of Finding
        All checks, of the data and of the fits.
    next_step : str
        What to do where nothing is wrong.
    count : str
        What is judged, such as "7 conditions".

    Returns
    -------
    Verdict
    """
    bad = sorted(
        (f for f in findings if f.verdict in _ORDER), key=lambda f: _ORDER.index(f.verdict)
    )
    held = sum(f.verdict == "ok" for f in findings)
    if not bad:
        looked = f"{held} checks looked for violations and found none." if held else _UNCHECKED
        return Verdict("ok", f"The numbers can be used: {count}.", looked, next_step)
    first = bad[0]
    advice = ADVICE.get(first.name, _OTHERWISE)
    names = list(dict.fromkeys(f.name or "a check" for f in bad))
    more = f" (also: {', '.join(names[1:])})" if len(names) > 1 else ""
    wrong = f"{first.sentence.rstrip('.')}{more}."
    if first.verdict == "unusable":
        return Verdict("unusable", f"These numbers cannot be used: {count}.", wrong, advice)
    trust = f"Use the numbers with care: {_why(first)}; {count}."
    return Verdict("warning", trust, wrong, advice)


def _why(first: Finding) -> str:
    if not first.name:
        return "there is a warning"
    if first.verdict == "cannot tell":
        return f"{first.name} could not be told from these data"
    return f"the check of {first.name} failed"
