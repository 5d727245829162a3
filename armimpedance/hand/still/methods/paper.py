"""Method `paper`: the estimate as Tsuji (1997) prints it, (27)-(29), kept as the reference.

The force alone is corrected for drift, from its single samples at t0 and tf; velocity and
acceleration are numerical differences; all columns and the force pass through the same zero-phase
low-pass (the source names no filter; without one, encoder steps decide the result). It is exact
only if displacement, velocity and acceleration vanish again at tf.
"""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import Kind
from armimpedance.core.errors import InputError
from armimpedance.core.records import Response, Window
from armimpedance.hand.still.prepared import Method, Prepared, impedance_factors
from armimpedance.numerics.signals import correct_force_only, derivatives, lowpass

CUTOFF_HZ = 15.0


def prepare(window: Window, kind: Kind) -> Prepared:
    """Factors of (28) for one group of trials."""
    note = f"drift correction (29) on the force alone; Butterworth {CUTOFF_HZ:g} Hz on both sides"
    # An offset per trial is fixed by the sample at t0, a ramp by the sample at tf.
    return Prepared(impedance_factors(source_response(window), kind), notes=(note,))


def source_response(window: Window) -> Response:
    """dX, its differences and dF_d between t0 and tf, referenced raw and filtered afterwards.

    Raises InputError: if the trials' disturbances differ in duration: (29) needs one tf.
    """
    durations = window.duration_s[window.usable]
    if np.ptp(durations) > 1.5 / window.sample_rate_hz:
        raise InputError(
            f"disturbances of {durations.min():.3f} to {durations.max():.3f} s in one group",
            expected="one duration for method 'paper'; use 'exact'",
        )
    start = int(np.argmin(abs(window.lag_s)))
    end = int(np.argmin(abs(window.lag_s - durations.max())))
    fitted = slice(start, end + 1)
    displacement = window.position - window.position[:, start : start + 1]
    velocity, acceleration = derivatives(displacement, window.sample_rate_hz)
    corrected = correct_force_only(window.force, window.lag_s, start, end)

    def smooth(signal: FloatArray) -> FloatArray:
        return lowpass(signal, CUTOFF_HZ, window.sample_rate_hz)[:, fitted]

    return Response(
        sample_rate_hz=window.sample_rate_hz,
        lag_s=window.lag_s[fitted],
        displacement=smooth(displacement),
        velocity=smooth(velocity),
        acceleration=smooth(acceleration),
        force=smooth(corrected),
        trial=window.trial,
        usable=window.usable,
    )


METHOD = Method(
    assumes="displacement, velocity and acceleration are all zero again at the end; a servo of "
    "finite stiffness breaks this and K with it",
    reference="Tsuji (1997), eqs. (27)-(29)",
    prepare=prepare,
    differs="the hand is not at rest where it started when the disturbance ends",
)
