"""What Tsuji (1997) prints in its Tables 1 and 2, digit by digit.

T. Tsuji (1997), "Human arm impedance in multi-joint movements", section 5. R is the correlation of
measured and predicted values, E the sum of squared errors; units are not printed.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

#: Postures of subject A, from which Table 1 was fitted.
TABLE_1_POSTURES: Final = 20
TABLE_1_ELEMENTS: Final = ("K_ss", "K_se", "K_es", "K_ee", "B_ss", "B_se", "B_es", "B_ee")
TABLE_2_ELEMENTS: Final = ("K_ss", "K_se", "K_ee", "B_ss", "B_se", "B_ee")

#: Order L of the moment arms -> R and E of `TABLE_1_ELEMENTS`.
TABLE_1_R: Final = MappingProxyType(
    {
        0: (0.000,) * 8,
        1: (0.778, 0.732, 0.740, 0.776, 0.785, 0.742, 0.806, 0.486),
        2: (0.978, 0.915, 0.890, 0.976, 0.967, 0.947, 0.962, 0.916),
    }
)
TABLE_1_E: Final = MappingProxyType(
    {
        0: (109.205, 27.796, 26.657, 50.011, 1.013, 0.181, 0.193, 0.263),
        1: (43.077, 16.329, 15.551, 19.915, 0.389, 0.090, 0.077, 0.201),
        2: (4.848, 9.877, 10.560, 2.345, 0.064, 0.032, 0.028, 0.042),
    }
)

#: Order N of stiffness over activation -> R and E of `TABLE_2_ELEMENTS`.
TABLE_2_R: Final = MappingProxyType(
    {
        1: (0.595, 0.645, 0.917, 0.796, 0.609, 0.891),
        2: (0.739, 0.649, 0.944, 0.855, 0.616, 0.914),
        3: (0.841, 0.661, 0.948, 0.874, 0.629, 0.918),
    }
)
TABLE_2_E: Final = MappingProxyType(
    {
        1: (7218.09, 4194.83, 3056.50, 15.58, 7.94, 5.59),
        2: (5064.28, 4157.62, 2077.05, 11.43, 7.83, 4.47),
        3: (3261.07, 4042.04, 1931.65, 10.06, 7.64, 4.25),
    }
)
