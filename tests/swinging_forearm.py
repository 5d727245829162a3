"""A forearm that swings below an elbow: its mass, centre of mass and inertia, and its skeleton."""

from __future__ import annotations

import numpy as np

from armimpedance.core.skeleton import Hinge, Segment, Skeleton

ELBOW = "right_elbow_flexion"
MASS, CENTRE, INERTIA = 1.5, 0.18, 0.016
SKELETON = Skeleton(
    (
        Segment("trunk", None, np.zeros(3)),
        Segment(
            "right_forearm",
            "trunk",
            np.zeros(3),
            (Hinge(ELBOW, np.array([0.0, -1.0, 0.0])),),
            MASS,
            np.array([0.0, 0.0, -CENTRE]),
            np.diag([INERTIA, INERTIA, 0.001]),
        ),
    )
)
