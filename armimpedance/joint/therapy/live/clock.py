"""Time stamps of a stream of samples: they follow each other at the sample rate."""

from __future__ import annotations

import numpy as np

from armimpedance.core.errors import InputError


def next_time(last_s: float | None, stamp_s: float | None, step_s: float) -> float:
    """The time of the next sample, from the last one's and what the sample itself says.

    Parameters
    ----------
    last_s : float or None
        None before the first sample.
    stamp_s : float or None
        None where the samples bear no time: they are then `step_s` apart from 0 on.
    step_s : float
        The time between samples.

    Raises
    ------
    InputError
        A time stamp that is not finite, is repeated, or does not follow: samples are missing.
    """
    if stamp_s is None:
        return 0.0 if last_s is None else last_s + step_s
    if not np.isfinite(stamp_s):
        raise InputError(f"a time stamp of {stamp_s}", expected="seconds")
    ahead = step_s if last_s is None else stamp_s - last_s
    if not ahead > 0.5 * step_s:
        raise InputError(
            f"the sample at {stamp_s:.6g} s comes after that at {last_s:.6g} s",
            expected=f"a time stamp {step_s:g} s later",
        )
    if not ahead < 1.5 * step_s:
        raise InputError(
            f"a gap of {ahead:.4g} s before the sample at {stamp_s:.6g} s",
            expected=f"samples every {step_s:g} s; reset() begins anew",
        )
    return float(stamp_s)
