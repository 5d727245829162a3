"""A made-up arm with a known stiffness."""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.records import Subject
from armimpedance.limb.arm import arm_named

SUBJECT = Subject(height_m=1.75, mass_kg=70.0)
REST = np.array([1300.0, 1500.0, 5000.0, 4500.0, 2100.0, 2000.0])
RISE = np.array([12e3, 14e3, 15e3, 13e3, 8e3, 9e3])


def made_stiffness(q: FloatArray, alpha: FloatArray) -> FloatArray:
    """K_j (P, 2, 2) of muscles on the arms of planar6, which bend by nothing."""
    G = arm_named("planar6").paths.moment_arms(q)
    f = REST + RISE * alpha / 0.3
    return np.eye(2) + np.einsum("pm,pmi,pmj->pij", f, G, G)
