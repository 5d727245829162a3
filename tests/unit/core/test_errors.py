"""A message is one printable line of bounded length that names the file, whatever a file held."""

from __future__ import annotations

from math import inf

import pytest
from hypothesis import given, strategies as st

from armimpedance.core.errors import (
    LONGEST_MESSAGE,
    InputError,
    RecordError,
    beginning,
    check_number,
    shortened,
)

anything = st.text(max_size=2000)


@given(problem=anything, column=anything, expected=anything)
def test_a_message_is_one_printable_line_that_names_the_file(problem, column, expected):
    error = InputError(problem, file="some/where.csv", row=3, column=column, expected=expected)
    text = str(error)
    assert text.isprintable()
    assert len(text) <= LONGEST_MESSAGE
    assert text.startswith("some/where.csv, row 3, column ")


@given(text=anything, length=st.integers(3, 100))
def test_a_shortened_text_keeps_both_ends(text, length):
    short = shortened(text, length)
    assert len(short) <= length
    assert short[0:1] == text[0:1]
    assert short == text or short[-1:] == text[-1:] or length < 4


def test_the_end_of_a_long_path_is_what_names_the_file():
    text = str(InputError("is empty", file="/deep" * 400 + "/trials.csv"))
    assert "/trials.csv: is empty" in text
    assert len(text) <= LONGEST_MESSAGE


def test_an_escape_sequence_does_not_reach_the_terminal():
    text = str(InputError("not a number: \x1b[31mred\ud800", file="a.csv"))
    assert "\x1b" not in text
    assert text.isprintable()
    assert "red" in text


@given(st.text("ab,;. ", max_size=80), st.integers(10, 60))
def test_a_beginning_is_no_longer_than_asked_and_says_that_something_follows(text, length):
    made = beginning(text, length)
    assert len(made) <= length
    if len(text) <= length:
        assert made == text
    else:
        assert made.endswith(" …")
        assert text.startswith(made.removesuffix(" …"))


def test_a_beginning_ends_with_a_clause():
    assert beginning("force: half its gain, so K is wrong", 28) == "force: half its gain …"


@given(value=st.floats(allow_nan=True, allow_infinity=True))
def test_a_number_passes_within_its_bounds_only(value):
    bounds = (
        ({"above": 0.0}, 0 < value < inf),
        ({"above": 0.0, "high": inf}, value > 0),
        ({"low": -1.0, "high": 2.0}, -1 <= value <= 2),
        ({"above": 0.0, "below": 1.0}, 0 < value < 1),
        ({}, -inf < value < inf),
    )
    for allowed, inside in bounds:
        if inside:
            check_number(value, "it", **allowed)
        else:
            with pytest.raises(InputError):
                check_number(value, "it", **allowed)


def test_a_whole_number_beyond_any_float_has_bounds_too():
    check_number(10**400, "it", low=0)
    with pytest.raises(RecordError, match=r"0\.5 or more, less than 1"):
        check_number(10**400, "it", low=0.5, below=1, error=RecordError)
