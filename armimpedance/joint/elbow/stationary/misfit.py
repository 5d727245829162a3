"""How much of the motion I, B and K explain."""

from __future__ import annotations

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.stationary.band import Band, real_rows
from armimpedance.joint.elbow.stationary.rows import without


def explained(band: Band, values: FloatArray) -> float:
    """Part of the angle's power in the band that the torque explains by I, B and K (3,)."""
    left = whole = 0.0
    for bins in band.trials:
        Z = bins.impedance(values)
        ends, columns = bins.ends / Z[:, None], (bins.angle - bins.torque / Z, bins.angle)
        error, angle = without(real_rows(ends), *map(real_rows, columns))
        left, whole = left + float(error @ error), whole + float(angle @ angle)
    return 1 - left / whole
