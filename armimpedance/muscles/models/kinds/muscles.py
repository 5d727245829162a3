"""Joint impedance over posture and activation together."""

from __future__ import annotations

from armimpedance.muscles.models.combined.fit import fit_muscle_model
from armimpedance.muscles.models.combined.model import MuscleModel
from armimpedance.muscles.models.kinds import ModelKind

MODEL = ModelKind(
    name="muscles",
    type=MuscleModel,
    fit=fit_muscle_model,
    options={
        "order": "moment_arm_order",
        "activation_order": "activation_order",
        "prior_percent": "prior_percent",
        "arm": "arm",
        "torque": "torque",
        "no_curvature": "curvature",
    },
    needs=("postures", "activations"),
)
