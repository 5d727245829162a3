"""Constant B and K in windows that overlap by half, as in the source (see `in_windows`)."""

from __future__ import annotations

from functools import partial

from armimpedance.joint.elbow.varying.in_windows import in_windows
from armimpedance.joint.elbow.varying.method import VaryingMethod

METHOD = VaryingMethod(
    "windows",
    "constant inside windows of 0.5 s that overlap by half",
    "window",
    "Ruiz (2011), section 6",
    partial(in_windows, length_s=0.5, per_window=2, degree=0),
)
