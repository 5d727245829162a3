"""What Guidali (2013) prints in its Tables 2, 3 and 4 and in the text of its Results.

M. Guidali et al. (2013), "Estimating the patient's contribution during robot-assisted therapy",
Journal of Rehabilitation Research and Development. Angles in degrees where the source has them so.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray

#: Table 2, axes 1 to 5: (17) and (16), N m.
TABLE_2_R2: Final = (0.870, 0.962, 0.912, 0.874, 0.815)
TABLE_2_RMS: Final = (3.38, 0.62, 0.67, 1.25, 0.81)
#: Axis (from 1) whose R^2 and RMS in Table 2 contradict its friction in Table 3.
TABLE_2_IMPOSSIBLE: Final = 3

#: Table 3, axes 1 to 5: N m/deg, deg, N m, N m s/deg. It has no v_s.
TABLE_3: Final = MappingProxyType(
    {
        "k_c": (0.0, 0.016, 0.015, 0.014, 0.0078),
        "q_c": (0.0, 41.0, 10.05, 0.0, 54.5),
        "tau_c": (8.22, 1.17, 5.90, 1.07, 0.28),
        "k_v": (0.132, 0.027, 0.0065, 0.013, 0.0),
    }
)

#: Table 4: k_s1, q_01, k_s2, q_02; N m/rad and rad. None: not identified.
TABLE_4: Final = MappingProxyType(
    {
        "S1": (6.60, 1.33, 1.68, 0.44),
        "S2": (5.00, 1.00, 1.17, 0.11),
        "S3": (5.53, 0.72, 0.93, -0.82),
        "S4": (3.99, 1.00, None, None),
        "S5": (1.47, 1.05, 0.44, -2.50),
        "S6": (3.06, 1.42, 0.76, 0.026),
        "S7": (4.46, 1.41, 1.10, 0.15),
        "S8": (4.02, 0.87, 2.08, 0.09),
        "S9": (6.80, 0.96, 1.03, 0.24),
        "S10": (3.75, 1.31, 0.80, -0.21),
        "S11": (4.40, 1.14, 1.04, 0.29),
        "S12": (8.43, 1.19, 0.45, -0.78),
        "P1": (12.50, 0.81, None, None),
        "P2": (12.85, 0.50, 9.97, -0.15),
        "P3": (10.37, 0.65, 1.75, -1.77),
        "P4": (9.43, 1.06, 2.05, -0.10),
        "P5": (11.84, 0.68, 0.88, -1.43),
        "P6": (9.70, 1.42, 7.70, 0.10),
        "P7": (5.85, 0.79, 0.003, 0.64),
    }
)
#: Its rows "Mean +- SD", mean and sd of each column.
TABLE_4_MEANS: Final = MappingProxyType(
    {
        "S": ((4.79, 1.85), (1.12, 0.22), (0.97, 0.53), (-0.32, 0.83)),
        "P": ((10.36, 2.40), (0.84, 0.31), (3.76, 4.05), (-0.59, 0.78)),
    }
)

#: The mock-up: torque at 90 deg of elevation, N m, and inertia about the vertical axis, kg m^2,
#: that follow from its printed masses and lengths (1.8 kg, .32 m; 1.7 kg, .30 m) as thin rods; as
#: tubes of the printed diameters they have .454.
MOCKUP_GRAVITY_NM: Final = 10.66
MOCKUP_INERTIA_KGM2: Final = 0.450


@dataclass(frozen=True)
class PrintedContribution:
    """Mean and sd over trials of one condition, per cent, from the text of the Results.

    Attributes
    ----------
    mean, sd : float
        Of (4).
    difference, difference_sd : float
        Of (19) less (4).
    doubt : str
        What is wrong with the print; empty where nothing is.
    """

    mean: float
    sd: float
    difference: float
    difference_sd: float
    doubt: str = ""


#: (movement, group, condition) -> what is printed.
CONTRIBUTIONS: Final = MappingProxyType(
    {
        ("elevation", "S", "passive"): PrintedContribution(1.94, 1.72, -1.43, 1.26),
        ("elevation", "S", "half_active"): PrintedContribution(57.40, 17.15, -4.16, 3.60),
        ("elevation", "S", "active"): PrintedContribution(102.90, 7.38, -2.92, 8.10),
        ("elevation", "S", "resistive"): PrintedContribution(
            -102.90, 189.83, 10.06, 21.25, "repeats the digits of the active condition"
        ),
        ("elevation", "P", "passive"): PrintedContribution(1.53, 0.45, -1.54, 0.53),
        ("elevation", "P", "active"): PrintedContribution(51.74, 44.20, 1.43, 4.72),
        ("elevation", "P", "resistive"): PrintedContribution(-119.5, 204.8, 2.43, 16.01),
        ("horizontal", "S", "passive"): PrintedContribution(-0.02, 2.03, 0.02, 2.17),
        ("horizontal", "S", "half_active"): PrintedContribution(21.49, 48.28, 3.18, 14.16),
        ("horizontal", "S", "active"): PrintedContribution(102.53, 8.27, -2.53, 9.14),
        ("horizontal", "S", "resistive"): PrintedContribution(
            -1487.25, 1367.80, 28.15, 24.52, "printed as 1,487.25, its minus lost"
        ),
        ("horizontal", "P", "passive"): PrintedContribution(-1.3, 3.6, 1.30, 6.58),
        ("horizontal", "P", "active"): PrintedContribution(41.9, 49.6, -1.60, 10.34),
        ("horizontal", "P", "resistive"): PrintedContribution(-614.8, 688.1, 7.69, 130.20),
    }
)


def recomputed_means(group: str) -> FloatArray:
    """Mean and sd (4, 2) of Table 4's columns from its own rows, of the group "S" or "P"."""
    rows = [TABLE_4[name] for name in TABLE_4 if name.startswith(group)]
    columns = [[v for v in column if v is not None] for column in zip(*rows, strict=True)]
    return np.array([[np.mean(c), np.std(c, ddof=1)] for c in columns])
