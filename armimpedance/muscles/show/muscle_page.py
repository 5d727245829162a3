"""A fitted model over posture, over muscle activation, or over both."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.program import software
from armimpedance.muscles.models import FittedModel, kind_of, read_model
from armimpedance.muscles.show.predictions_plot import plot_predictions
from armimpedance.show.pages import (
    TSUJI,
    Asked,
    Page,
    Picture,
    Section,
    Table,
    Topic,
    fit_page,
    picture,
)

#: Places along each range at which the model is drawn.
PLACES: Final = 3


def page_of(asked: Asked) -> Page:
    """The page of a MODEL.json that `fit` wrote."""
    model = read_model(asked.source)
    method = model.summary.method
    return fit_page(
        asked,
        model.summary,
        title="Model of the muscles",
        lead=f"{method.replace('_', ' ')}, fitted to {model.summary.n} numbers.",
        pictures=[_drawn(model)],
        sections=[Section("Elements", (_quality(model),))],
        methods=[
            f"The model {method.replace('_', ' ')} of joint stiffness and viscosity was fitted "
            f"with {software()} to {model.summary.n} elements of estimated matrices, weighted by "
            "their covariances",
            "Each row was left out in turn and predicted from the others",
        ],
        references=[TSUJI],
    )


def _drawn(model: FittedModel) -> Picture:
    """Picture of the model's predictions over its range; squares are extrapolated."""
    kind = kind_of(model)
    given, where = [], []
    if "postures" in kind.needs:
        box = model.scaling.box if hasattr(model, "scaling") else model.box  # type: ignore[attr-defined]
        shoulder, elbow = (np.linspace(low, high, PLACES) for low, high in np.asarray(box))
        given.append(np.array([(s, e) for s in shoulder for e in elbow]))
        where.append(f"{PLACES} by {PLACES} postures of its workspace")
    if "activations" in kind.needs:
        own = getattr(model, "activation_range", None)
        high = model.highest if own is None else own[:, 1]  # type: ignore[attr-defined]
        parts = np.linspace(0, 1, PLACES) if own is not None else np.zeros(1)
        given.append(parts[:, None] * high)
        where.append(
            "activations from rest to the measured range" if own is not None else "at rest"
        )
    predicted = model.predict(*given)  # type: ignore[attr-defined]
    caption = f"K and B that the model gives at {', '.join(where)}; squares are extrapolated."
    return picture(plot_predictions(predicted), "predicted", caption)


def _quality(model: FittedModel) -> Table:
    rows = tuple(
        (q.element, f"{q.r:.3f}", f"{q.leave_one_out_r:.3f}", f"{q.null_r:.3f}")
        for q in model.quality
    )
    caption = (
        "Correlation of each element: of the fit, of rows that were left out, and what noise alone "
        "would give."
    )
    return Table(caption, ("element", "fit", "left out", "noise alone"), rows)


TOPIC = Topic("a model over posture or muscle activation", page_of)
