"""Plain least squares: forces and moments count alike, and noise of the angles is left in."""

from __future__ import annotations

from armimpedance.joint.body.methods import BodyMethod

METHOD = BodyMethod("least_squares", "all rows are equally noisy, and the motion is exact", "none")
