"""From raw EMG to muscle activation, as the source does it (section 3.2)."""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import LARGEST, FloatArray
from armimpedance.core.errors import InputError
from armimpedance.numerics.signals.causal import causal_lowpass
from armimpedance.numerics.signals.filters import lowpass

ENVELOPE_HZ = 1.0
ENVELOPE_ORDER = 2


def envelope(
    emg: FloatArray,
    sample_rate_hz: float,
    *,
    cutoff_hz: float = ENVELOPE_HZ,
    order: int = ENVELOPE_ORDER,
    causal: bool = False,
    axis: int = 0,
) -> FloatArray:
    """Offset removed, rectified, Butterworth low-pass.

    Parameters
    ----------
    emg : array
        Raw EMG, time along `axis`; at least one period of the cut-off long.
    sample_rate_hz : float
        Sample rate of the EMG, Hz.
    cutoff_hz : float
        Cut-off of the low-pass, Hz.
    order : int
        Order of the low-pass, which runs forward and backward (zero phase) unless `causal`.
    causal : bool
        Run the low-pass forward only; the envelope is late by `numerics.signals.lowpass_delay_s`.
    axis : int
        Axis of time.

    Returns
    -------
    array of the same shape
        The envelope in the unit of `emg`; values below 0 from filter ripple are set to 0.

    Raises
    ------
    InputError
        If the record is shorter than one period of the cut-off.
    """
    samples = emg.shape[axis]
    if samples < sample_rate_hz / cutoff_hz:
        raise InputError(
            f"EMG record of {samples / sample_rate_hz:.2f} s",
            expected=f"at least {1 / cutoff_hz:.2f} s for a low-pass of {cutoff_hz:g} Hz",
        )
    rectified = np.abs(emg - emg.mean(axis=axis, keepdims=True))
    filtered = causal_lowpass if causal else lowpass
    smooth = filtered(rectified, cutoff_hz, sample_rate_hz, order=order, axis=axis)
    return np.clip(smooth, 0.0, None)


def activation(envelope_V: FloatArray, mvc_V: FloatArray) -> FloatArray:
    """Activation ``alpha = envelope / MVC`` of each muscle, expected in 0..1.

    Parameters
    ----------
    envelope_V : (..., m)
    mvc_V : (m,)
        Envelope in the maximum voluntary contraction.

    Raises
    ------
    InputError
        If an MVC value is not positive, or an activation is above 1.2: then the MVC was not one.
        Values in 1..1.2 are clipped to 1, as trial-to-trial scatter of the MVC allows.
    """
    mvc_V = np.asarray(mvc_V, dtype=float)
    if not (np.isfinite(mvc_V).all() and (mvc_V > 1 / LARGEST).all()):
        raise InputError(f"MVC values {mvc_V.tolist()} V", expected="positive numbers")
    alpha = envelope_V / mvc_V
    if alpha.size and alpha.max() > 1.2:
        muscle = int(np.unravel_index(int(alpha.argmax()), alpha.shape)[-1]) + 1
        raise InputError(
            f"activation {alpha.max():.2f} of muscle {muscle}",
            expected="0..1; is the MVC that of this muscle and in the same unit?",
        )
    return np.clip(alpha, 0.0, 1.0)
