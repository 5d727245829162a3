"""Polynomials of the activations that stay nonnegative."""

from __future__ import annotations

from armimpedance.muscles.models.activation.models import ActivationMethod

MODEL = ActivationMethod(
    "bernstein",
    "nonnegative stiffness of every muscle over its measured range of activation",
    bounded=True,
)
