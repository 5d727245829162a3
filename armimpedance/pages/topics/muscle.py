"""A fitted model over posture, over muscle activation, or over both."""

from __future__ import annotations

from armimpedance.files import read_model
from armimpedance.muscles import FittedModel
from armimpedance.pages.asked import Asked
from armimpedance.pages.methods_text import software
from armimpedance.pages.of_fit import fit_page
from armimpedance.pages.page import Page, Section, Table
from armimpedance.pages.references import TSUJI
from armimpedance.pages.topic import Topic


def page_of(asked: Asked) -> Page:
    """The page of a MODEL.json that `fit` wrote.

    Parameters
    ----------
    asked : Asked

    Returns
    -------
    Page

    Raises
    ------
    InputError
        Not such a file.
    """
    model = read_model(asked.source)
    method = model.summary.method
    return fit_page(
        asked,
        model.summary,
        title=f"Model of the muscles: {asked.source.stem}",
        lead=f"{method.replace('_', ' ')}, fitted to {model.summary.n} numbers.",
        sections=[Section("Elements", (_quality(model),))],
        methods=[
            f"The model {method.replace('_', ' ')} of joint stiffness and viscosity was fitted "
            f"with {software()} to {model.summary.n} elements of estimated matrices, weighted by "
            "their covariances",
            "Each row was left out in turn and predicted from the others",
        ],
        references=[TSUJI],
    )


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
