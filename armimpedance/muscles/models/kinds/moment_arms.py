"""Joint impedance over posture at one activation, by moment arms that are polynomials."""

from __future__ import annotations

from armimpedance.muscles.models.kinds import ModelKind
from armimpedance.muscles.models.posture.fit import fit_posture_model
from armimpedance.muscles.models.posture.model import PostureModel

MODEL = ModelKind(
    name="moment-arms",
    type=PostureModel,
    fit=fit_posture_model,
    options={"order": "order", "model": "model", "box": "box"},
    needs=("postures",),
)
