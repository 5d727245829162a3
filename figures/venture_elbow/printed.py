"""What Venture's paper on the elbow prints in its Tables II and III, digit by digit.

G. Venture et al., "In-vivo estimation of the human elbow joint dynamics during passive movements
using musculo-skeletal model computations", section V. The poster ("Dynamics identification of
human-like systems") prints one number that can be read: 128 parameters of the whole body.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import Final


@dataclass(frozen=True)
class PrintedElbow:
    """One test of one subject; texts, as printed.

    Attributes
    ----------
    values, relative_sd_percent : tuple of 3 str
        k (N m/rad), h (N m s/rad), f (N m).
    condition : str
        Of W.
    n : str
        Samples.
    """

    values: tuple[str, str, str]
    relative_sd_percent: tuple[str, str, str]
    condition: str
    n: str


#: (subject, test) -> what is printed; test "p5" and the "non medical" one, a release.
TABLES_II_III: Final = MappingProxyType(
    {
        ("1", "p5"): PrintedElbow(
            ("2.951", "0.031", "-0.015"), ("0.179", "21.7", "30.1"), "2.3", "700"
        ),
        ("1", "release"): PrintedElbow(
            ("2.609", "0.049", "-0.017"), ("0.29", "7.47", "25.38"), "2.91", "1100"
        ),
        ("2", "p5"): PrintedElbow(
            ("2.043", "0.025", "-0.01"), ("0.35", "25.39", "68.16"), "2.2", "450"
        ),
        ("2", "release"): PrintedElbow(
            ("2.238", "0.029", "-0.012"), ("0.25", "9.39", "20.9"), "3.11", "1100"
        ),
    }
)
#: Base parameters of the poster's whole body.
BASE_PARAMETERS: Final = 128
