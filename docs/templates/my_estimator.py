"""Method `my_estimator`: say here what it does to the samples, and when it is right.

Copy this file to ``armimpedance/hand/still/methods/<name>.py``. It holds the simplest estimator
that is right: least squares of the force on the motion, each counted from where it was at the
onset.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from armimpedance.core.conventions import Kind
from armimpedance.core.errors import InputError
from armimpedance.core.records import Window
from armimpedance.hand.still.prepared import Method, Prepared, impedance_factors
from armimpedance.numerics.signals import choose_span, respond


def prepare(window: Window, kind: Kind) -> Prepared:
    """Hand the equations of one group of trials over; the core solves them.

    Parameters
    ----------
    window : Window
        Raw samples of the group, in equal windows around each onset.
    kind : {"hand", "joint"}
        Of what the impedance is.

    Returns
    -------
    Prepared
        The triangular factors of ``[W y]`` of every trial, and what a reader must know.

    Raises
    ------
    InputError
        What the method cannot run on, with the reason.
    """
    span = choose_span(window)
    response = respond(window, span, keep_drift=True)
    if not np.ptp(response.displacement, axis=1).any():
        raise InputError("the hand never moves", expected="a disturbance after the onset")
    # whatever is done to one column is done to all columns and to the force, in the same way
    counted = replace(
        response,
        displacement=response.displacement - response.displacement[:, :1],
        force=response.force - response.force[:, :1],
    )
    return Prepared(impedance_factors(counted, kind), notes=span.notes)


METHOD = Method(
    assumes="the hand's virtual position stands still from the onset to the end",
    reference="author (year), equation; or a page of docs/",
    prepare=prepare,
)
