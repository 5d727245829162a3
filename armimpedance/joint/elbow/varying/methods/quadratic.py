"""Quadratic B and K inside windows, read at their centres (see `in_windows`)."""

from __future__ import annotations

from functools import partial

from armimpedance.joint.elbow.varying.in_windows import in_windows
from armimpedance.joint.elbow.varying.method import VaryingMethod

METHOD = VaryingMethod(
    "quadratic",
    "quadratic in time inside windows of 1 s, read at their centres",
    "window",
    "W. S. Cleveland, J. Am. Stat. Assoc. 74 (1979) 829-836",
    partial(in_windows, length_s=1.0, per_window=10, degree=2),
)
