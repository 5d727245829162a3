"""De Leva's table of a man's segments, and the sizes that it does not give.

Masses, lengths, centres of mass and radii of gyration: P. de Leva, Adjustments to
Zatsiorsky-Seluyanov's segment inertia parameters, J Biomech 29 (1996) 1223-1230, Table 4, men.
Widths, the ankle's height and where the foot's length lies about the ankle are rounded fractions of
the height after Winter (Biomechanics and Motor Control of Human Movement, Fig. 4.1), moved inwards
from the skin to the joint centres.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

#: Mean height of the table's sample; its lengths below are in mm.
TABLE_HEIGHT_MM: Final = 1741.0

#: Sizes that the table does not give, fractions of the height.
HIP_HALF_WIDTH: Final = 0.050
SHOULDER_HALF_WIDTH: Final = 0.110
ANKLE_HEIGHT: Final = 0.039
HEEL_BEHIND_ANKLE: Final = 0.034
BALL_BEFORE_ANKLE: Final = 0.075


@dataclass(frozen=True)
class TableRow:
    """One row of de Leva's table.

    Attributes
    ----------
    mass : float
        Fraction of the body's mass.
    length_mm : float
        Length in the sample's mean man.
    com : float
        From the upper or proximal end, fraction of the length (foot: from the heel).
    gyration : (3,)
        About the sagittal, transverse and longitudinal axes, fractions of the length.
    """

    mass: float
    length_mm: float
    com: float
    gyration: tuple[float, float, float]


DE_LEVA: Final = {
    "head": TableRow(0.0694, 242.9, 0.5002, (0.303, 0.315, 0.261)),
    "upper_trunk": TableRow(0.1596, 242.1, 0.5066, (0.505, 0.320, 0.465)),
    "middle_trunk": TableRow(0.1633, 215.5, 0.4502, (0.482, 0.383, 0.468)),
    "lower_trunk": TableRow(0.1117, 145.7, 0.6115, (0.615, 0.551, 0.587)),
    "upper_arm": TableRow(0.0271, 281.7, 0.5772, (0.285, 0.269, 0.158)),
    "forearm": TableRow(0.0162, 268.9, 0.4574, (0.276, 0.265, 0.121)),
    "hand": TableRow(0.0061, 86.2, 0.7900, (0.628, 0.513, 0.401)),
    "thigh": TableRow(0.1416, 422.2, 0.4095, (0.329, 0.329, 0.149)),
    "shank": TableRow(0.0433, 434.0, 0.4459, (0.255, 0.249, 0.103)),
    "foot": TableRow(0.0137, 258.1, 0.4415, (0.257, 0.245, 0.124)),
}
#: Mid-shoulder to mid-hip, the table's.
SHOULDER_ABOVE_HIP_MM: Final = 515.5

#: Which of the table's axes (sagittal 0, transverse 1, longitudinal 2) lies along x, y, z. The hand
#: hangs with its palm to the thigh, the foot's length lies along x.
AXES_OF: Final = {"hand": (1, 0, 2), "foot": (2, 1, 0)}
