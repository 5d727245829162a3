"""Joint impedance over the activation of the muscles at one posture."""

from __future__ import annotations

from armimpedance.muscles.models.activation.fit import fit_activation_model
from armimpedance.muscles.models.activation.model import ActivationModel
from armimpedance.muscles.models.kinds import ModelKind

MODEL = ModelKind(
    name="activation",
    type=ActivationModel,
    fit=fit_activation_model,
    options={
        "order": "order",
        "model": "model",
        "arm": "arm",
        "torque": "torque",
        "increasing": "increasing",
        "no_curvature": "curvature",
    },
    needs=("activations",),
)
