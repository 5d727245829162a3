"""A model of each kind, fitted to rows of a made-up subject, and measured rows of the same hand."""

from __future__ import annotations

import numpy as np

from armimpedance.core.records import ImpedanceEstimate, Quality, Subject
from armimpedance.hand.levels import kinematic_arm
from armimpedance.limb.arm import arm_named
from armimpedance.muscles.models import (
    JointRows,
    fit_activation_model,
    fit_muscle_model,
    fit_posture_model,
    matrix,
)

ARM = arm_named("planar6")
SUBJECT = Subject(id="X", mass_kg=70.0, upper_arm_m=0.31, forearm_hand_m=0.33)
REST_N_M = np.array([1300.0, 1300.0, 5200.0, 5200.0, 2100.0, 2100.0])
ACTIVE_N_M = np.array([52000.0, 52000.0, 52000.0, 52000.0, 26000.0, 30000.0])
POSTURE = (1.04, 1.57)


def rows(q, alpha, rng):
    """Joint rows of muscles with constant arms, with noise."""
    G = ARM.paths.moment_arms(q)
    K = np.einsum("pmi,pm,pmj->pij", G, REST_N_M + alpha * ACTIVE_N_M, G)
    K = K + matrix(rng.normal(scale=0.5, size=(len(q), 3)))
    sd = np.full_like(K, 0.5)
    return JointRows(
        q, K, K / 15, sd, sd / 15, alpha, np.full_like(alpha, 1e-3), muscles=ARM.paths.muscles
    )


def fitted():
    """Models by the name of their kind."""
    rng = np.random.default_rng(17)
    q = rng.uniform([0.3, 0.7], [1.4, 2.1], (24, 2))
    alpha = rng.uniform(0, 0.3, (40, 6))
    still = np.broadcast_to(POSTURE, (40, 2))
    relaxed = rows(q, np.zeros((24, 6)), rng)
    active = rows(still, alpha, rng)
    # few rows and constant arms: this model is fitted in a second
    few = np.concatenate([np.zeros((12, 6)), alpha[:20]])
    both = rows(np.concatenate([q[:12], still[:20]]), few, rng)
    return {
        "moment-arms": fit_posture_model(relaxed, order=2),
        "activation": fit_activation_model(active, ARM, order=2),
        "muscles": fit_muscle_model(both, ARM, moment_arm_order=0, activation_order=2),
    }


def measured_hand(name):
    """Two estimates at the hand of that arm, one of this name."""
    rng = np.random.default_rng(3)
    arm = kinematic_arm(SUBJECT)
    quality = Quality(40, 1000, 0.99, 0.99, 3.0, 500.0, 6, 0.1)
    made = []
    for condition, q in ((name, POSTURE), ("far", (0.6, 1.2))):
        J = arm.jacobian(q)
        A = np.linalg.inv(J).T @ [[15.0, 6.0], [6.0, 16.0]] @ np.linalg.inv(J)
        half = rng.normal(size=(12, 12))
        made.append(
            ImpedanceEstimate(
                "hand",
                "weighted",
                np.array([[2.0, 0.1], [0.1, 0.8]]),
                A / 15,
                A,
                half @ half.T / 10,
                39.0,
                quality,
                keys={"condition": condition},
                position=arm.hand_position(q),
                shoulder_m=np.zeros(2),
                force=np.array([3.0, -4.0]),
                joint_angles=np.array(q),
                activation=rng.uniform(0, 0.3, 6),
                activation_sd=np.full(6, 1e-3),
                muscles=ARM.paths.muscles,
            )
        )
    return made
