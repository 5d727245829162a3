"""Print the tables of the docs that follow from what a source prints, as they stand on the page.

python docs/printed_tables.py
"""

from __future__ import annotations

from scipy.stats import f as f_distribution

from armimpedance_figures.tsuji1997.printed import TABLE_1_E, TABLE_1_ELEMENTS, TABLE_1_POSTURES

#: Order L of the moment arms -> coefficients of an element.
COEFFICIENTS = {0: 1, 1: 6, 2: 15}
#: Elements that were fitted alone.
ALONE = ("K_ss", "K_ee", "B_ss", "B_ee")


def gain(element: str, low: int, high: int) -> float:
    """Probability of an F as large as E's fall from one order to another, by chance alone."""
    fewer, more = COEFFICIENTS[low], COEFFICIENTS[high]
    left = TABLE_1_POSTURES - more
    e_low, e_high = error(element, low), error(element, high)
    return float(
        f_distribution.sf((e_low - e_high) / (more - fewer) / (e_high / left), more - fewer, left)
    )


def adjusted(element: str, order: int) -> float:
    """Adjusted R^2."""
    left = TABLE_1_POSTURES - COEFFICIENTS[order]
    mean_square = error(element, 0) / (TABLE_1_POSTURES - 1)
    return 1 - error(element, order) / left / mean_square


def error(element: str, order: int) -> float:
    """E as it is printed."""
    return TABLE_1_E[order][TABLE_1_ELEMENTS.index(element)]


def main() -> None:
    """Print the table."""
    print("| | L = 1 against 0, p | L = 2 against 1, p | adjusted R^2 at L = 1, 2 |")
    print("| --- | --- | --- | --- |")
    for element in ALONE:
        first, second = gain(element, 0, 1), gain(element, 1, 2)
        parts = ", ".join(f"{adjusted(element, order):.2f}" for order in (1, 2))
        print(f"| {element} | {first:.2g} | {second:.2g} | {parts} |")


if __name__ == "__main__":
    main()
