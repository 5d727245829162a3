"""Ellipses of positive definite 2 x 2 matrices, with intervals by two roads."""

from armimpedance.ellipses.ellipse import (
    Ellipse,
    NotPositiveDefiniteError,
    Which,
    ellipse,
    ellipse_of,
    locus,
)
from armimpedance.ellipses.resampled import ResampledEllipse, resampled_ellipse

__all__ = [
    "Ellipse",
    "NotPositiveDefiniteError",
    "ResampledEllipse",
    "Which",
    "ellipse",
    "ellipse_of",
    "locus",
    "resampled_ellipse",
]
