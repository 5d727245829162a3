"""A number is shown with the digits that its uncertainty leaves it."""

import pytest
from hypothesis import given, strategies as st

from armimpedance.core.shown import with_half_width, with_interval
from armimpedance.show.text.numbers import aligned_table


@pytest.mark.parametrize(
    ("value", "half_width", "text"),
    [
        (104.83, 9.13, "104.8 ± 9.1"),
        (42123.0, 3105.0, "42100 ± 3100"),
        (0.0144, 0.00062, "0.01440 ± 0.00062"),
        (1.731, 0.0996, "1.73 ± 0.10"),
        (-0.004, 0.18, "0.00 ± 0.18"),
        (3.0, 400.0, "0 ± 400"),
        (104.83, 0.0, "104.8 ± 0.0"),
        (104.83, 1e-9, "104.830 ± 1e-09"),
        (104.83, float("inf"), "104.8 ± ?"),
        (float("nan"), 1.0, "-"),
    ],
)
def test_value_and_half_width(value, half_width, text):
    assert with_half_width(value, half_width) == text


@given(st.floats(-1e6, 1e6), st.floats(1e-4, 1e6))
def test_what_is_shown_is_within_a_twentieth_of_the_half_width(value, half_width):
    shown, half = with_half_width(value, half_width).split(" ± ")
    # Two digits of the half-width round by at most 1/20 of it, six digits of the value by 1e-5.
    tolerance = half_width / 20 + 1e-5 * abs(value)
    assert abs(float(shown) - value) <= tolerance
    assert abs(float(half) - half_width) <= tolerance
    if "e" not in half:
        assert len(shown.partition(".")[2]) == len(half.partition(".")[2])


def test_interval_s_numbers_share_their_decimals():
    assert with_interval(14.06, 9.86, 18.24) == "14.1 (9.9 to 18.2)"


def test_table_columns_line_up():
    text = aligned_table(["name", "x"], [["a", "1.0 ± 0.1"], ["longer", "10.0 ± 0.2"]])
    lines = text.splitlines()
    assert lines[1].index("±") == lines[2].index("±")
    assert lines[2] == "longer  10.0 ± 0.2"
