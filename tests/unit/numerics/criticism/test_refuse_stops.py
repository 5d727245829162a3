"""A STOP ends an analysis unless it is named; a name that is no check is a mistake."""

from __future__ import annotations

import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding
from armimpedance.numerics.criticism import refuse_stops

FOUND = (
    Finding("rate", "ok", "1000 Hz"),
    Finding("axes", "unusable", "axis y is mirrored"),
    Finding("units", "unusable", "mean inertia 0.1 kg"),
    Finding("delay", "warning", "1 ms late"),
)


def test_a_stop_is_refused_and_says_how_to_go_on():
    with pytest.raises(InputError, match=r"axes: axis y is mirrored.*--despite 'axes'"):
        refuse_stops(FOUND)


def test_each_stop_has_to_be_named():
    with pytest.raises(InputError, match="units"):
        refuse_stops(FOUND, ["axes"])
    assert [one.name for one in refuse_stops(FOUND, ["axes", "units"])] == ["axes", "units"]


def test_warnings_stop_nothing():
    assert refuse_stops([FOUND[0], FOUND[3]]) == ()


def test_a_name_that_is_no_check_lists_those_there_are():
    with pytest.raises(InputError, match=r"no check 'axis'.*axes, delay, rate, units"):
        refuse_stops(FOUND, ["axis"])
