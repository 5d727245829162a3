"""Method `instruments`: the intended motion as an instrument for the noisy measured one.

Noise of the position makes the regressors larger than the motion, and the least-squares estimate
smaller than the truth: with narrow kernels the acceleration is mostly encoder steps. Instruments Z
follow the motion but not its noise, so that

    theta = (sum_t Z_t^T W_t)^-1 sum_t Z_t^T y_t                                          (3 d, d)

is right in the limit of many trials, whatever the noise of W. They come from the commanded motion
if it was recorded, otherwise from the mean of the other trials with the same disturbance. W, y and
Z pass through the smoothing and the drift removal of method `exact`.

See T. Soederstroem and P. Stoica, *Instrumental Variable Methods for System Identification*
(Springer, 1983).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import UNITS, Kind, parameter_names
from armimpedance.core.errors import InputError
from armimpedance.core.records import Response, Window
from armimpedance.hand.still.modal import mean_of_others
from armimpedance.hand.still.prepared import (
    NO_LINEAR_LIMB,
    Method,
    Prepared,
    impedance_factors,
    in_blocks,
    stack_columns,
)
from armimpedance.numerics.regression import TrialEquations
from armimpedance.numerics.signals import choose_span, respond


def prepare(window: Window, kind: Kind) -> Prepared:
    """Equations of one group of trials, from the best instruments that it has.

    Raises InputError: without commanded motion and without two trials of the same disturbance.
    """
    # narrower kernels would not bias this method, but gain nothing either
    return instrumented(window, kind)


def instrumented(window: Window, kind: Kind, **kernel: float) -> Prepared:
    """Equations of one group with given options of the kernel (`numerics.signals.choose_span`).

    Raises InputError: the same cases as in `prepare`.
    """
    span = choose_span(window, **kernel)  # type: ignore[arg-type]
    smooth = partial(respond, span=span)
    response = smooth(window)
    used = window.usable
    Z, note = _instruments(window, response, smooth)
    W, y = stack_columns(response)[used], -response.force[used]
    if len(W) == 1:
        Z, W, y = (in_blocks(rows) for rows in (Z, W, y))
    return Prepared(
        impedance_factors(response, kind),
        instrument_equations(Z, W, y, kind),
        notes=(*span.notes, note),
    )


def instrument_equations(Z: FloatArray, W: FloatArray, y: FloatArray, kind: Kind) -> TrialEquations:
    """``A_t = Z_t^T W_t``, ``b_t = Z_t^T y_t`` of every cluster for M, B, K row by row.

    `y` (T, S, d).
    `Z`, `W` (T, S, 3 d): columns acceleration, velocity, displacement of each axis.
    """
    T, d = len(W), y.shape[2]
    # (3 d, S) (S, 3 d), the same for every row of M, B and K
    product = (Z.transpose(0, 2, 1) @ W).reshape(T, 3, d, 3, d)
    right = (Z.transpose(0, 2, 1) @ y).reshape(T, 3, d, d)
    A = np.zeros((T, 3, d, d, 3, d, d))
    for row in range(d):
        A[:, :, row, :, :, row, :] = product
    size, names = 3 * d * d, parameter_names(d)
    units = tuple(UNITS[kind][name[0]] for name in names)
    b = right.transpose(0, 1, 3, 2).reshape(T, size)
    return TrialEquations(A.reshape(T, size, size), b, names, units)


def _instruments(
    window: Window, response: Response, smooth: Callable[[Window], Response]
) -> tuple[FloatArray, str]:
    """Z (T, S, 3 d) of the usable trials, and a note on their source."""
    used = window.usable
    if window.commanded is not None and _moves(window.commanded[used]):
        commanded = smooth(replace(window, position=window.commanded))
        return stack_columns(commanded)[used], "instruments: the commanded motion"
    if window.disturbance is None:
        reason = "nor the direction of every trial"
    else:
        labels = window.disturbance[used]
        alone = np.bincount(labels)[labels] == 1
        if not alone.all():
            note = "instruments: the mean motion of the other trials of the same direction"
            if alone.any():
                note += f"; without one, and so of no weight: {alone.sum()} of {len(alone)} trials"
            return mean_of_others(stack_columns(response)[used], labels), note
        reason = "and no direction has two trials"
    raise InputError(
        f"no instruments: the commanded motion is not recorded {reason}",
        expected="columns x_command_m, … in the samples, or two trials of a direction_deg",
    )


def _moves(commanded: FloatArray) -> bool:
    """True if the commanded motion is not constant: a constant column is no instrument."""
    return bool((np.ptp(commanded, axis=1) > 0).any())


METHOD = Method(
    assumes="the commanded motion, or the other trials of a direction, tell how the hand moves; "
    "the position's noise may be of any size",
    reference="instrumental variables, T. Soederstroem and P. Stoica (Springer, 1983)",
    prepare=prepare,
    differs=f"{NO_LINEAR_LIMB}, or noise of the position is large",
)
