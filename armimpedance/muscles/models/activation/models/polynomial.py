"""Polynomials of the activations without bounds, as in the source."""

from __future__ import annotations

from armimpedance.muscles.models.activation.models import ActivationMethod

MODEL = ActivationMethod(
    "polynomial",
    "the source's least squares; a muscle's stiffness may fall below zero",
    bounded=False,
)
