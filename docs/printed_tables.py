"""Print the tables of the docs that follow from what a source prints, as they stand on the page.

python docs/printed_tables.py postures | activations
"""

from __future__ import annotations

import sys

from scipy.stats import f as f_distribution

from armimpedance_figures.tsuji1997.printed import (
    TABLE_1_E,
    TABLE_1_ELEMENTS,
    TABLE_1_POSTURES,
    TABLE_2_E,
    TABLE_2_ELEMENTS,
    TABLE_2_R,
)

#: Order L of the moment arms -> coefficients of an element.
COEFFICIENTS = {0: 1, 1: 6, 2: 15}
#: Elements that were fitted alone.
ALONE = ("K_ss", "K_ee", "B_ss", "B_ee")
#: Conditions of experiments 2 and 3, if they are the rows of Table 2.
CONDITIONS = 33


def by_chance(E_few: float, E_more: float, few: int, more: int, rows: int) -> float:
    """Probability of a fall of the squared errors as large as this by chance alone: an F test."""
    left = rows - more
    F = (E_few - E_more) / (more - few) / (E_more / left)
    return float(f_distribution.sf(F, more - few, left))


def postures() -> None:
    """Table 1: orders of the moment arms, from E."""
    print("| | L = 1 against 0, p | L = 2 against 1, p | adjusted R^2 at L = 1, 2 |")
    print("| --- | --- | --- | --- |")
    for element in ALONE:
        E = {order: TABLE_1_E[order][TABLE_1_ELEMENTS.index(element)] for order in COEFFICIENTS}
        first, second = (
            by_chance(E[n], E[n + 1], COEFFICIENTS[n], COEFFICIENTS[n + 1], TABLE_1_POSTURES)
            for n in (0, 1)
        )
        mean_square = E[0] / (TABLE_1_POSTURES - 1)
        adjusted = (1 - E[n] / (TABLE_1_POSTURES - COEFFICIENTS[n]) / mean_square for n in (1, 2))
        parts = ", ".join(f"{one:.2f}" for one in adjusted)
        print(f"| {element} | {first:.2g} | {second:.2g} | {parts} |")


def activations() -> None:
    """Table 2: orders of stiffness over activation, from E and R."""
    print(
        "| | adjusted R^2, N = 1/2/3 | N = 2 against 1, p | N = 3 against 2, p "
        "| R of noise, N = 1/2/3 |"
    )
    print("| --- | --- | --- | --- | --- |")
    for at, element in enumerate(TABLE_2_ELEMENTS):
        p = {N: (2 if element.endswith("se") else 4) * N + 1 for N in TABLE_2_E}
        adjusted = "/".join(
            f"{1 - (1 - TABLE_2_R[N][at] ** 2) * (CONDITIONS - 1) / (CONDITIONS - p[N]):.2f}"
            for N in p
        )
        second, third = (
            by_chance(TABLE_2_E[N - 1][at], TABLE_2_E[N][at], p[N - 1], p[N], CONDITIONS)
            for N in (2, 3)
        )
        noise = "/".join(f"{((p[N] - 1) / (CONDITIONS - 1)) ** 0.5:.2f}" for N in p)
        print(f"| {element} | {adjusted} | {second:.2g} | {third:.2g} | {noise} |")


if __name__ == "__main__":
    {"postures": postures, "activations": activations}[sys.argv[1]]()
