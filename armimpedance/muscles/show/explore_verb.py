"""The verb of the page to play with: from models and results to one file."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from armimpedance.core.errors import InputError
from armimpedance.core.json_text import read_json
from armimpedance.core.records import ImpedanceEstimate, Subject
from armimpedance.hand.show import Estimates, read_results
from armimpedance.muscles.models import FittedModel, read_model
from armimpedance.muscles.show.explore_data import Owner, measured_data, model_data, owner_of
from armimpedance.show.pages import write_html

PathLike = str | os.PathLike[str]
#: Pure numbers first, then the picture, the tables, and what is chosen.
_SCRIPTS = (
    "shared.js",
    "arm.js",
    "models.js",
    "explore_view.js",
    "explore_tables.js",
    "explore.js",
)
#: A model, estimates, or the path of a MODEL.json or a RESULTS.csv.
Source = FittedModel | Sequence[ImpedanceEstimate] | PathLike


def write_explore(
    sources: Source | Sequence[Source],
    path: PathLike,
    *,
    recording: PathLike | Subject | None = None,
    upper_arm_m: float | None = None,
    forearm_hand_m: float | None = None,
) -> list[str]:
    """Write a page with an arm whose hand is dragged while K and B follow.

    The numbers are computed in the page, from the models' coefficients, as `predict` and `at_hand`
    do; measured estimates are shown at their places.

    Parameters
    ----------
    sources : model, estimates, path, or a sequence of these
        MODEL.json of ``armimpedance fit`` and RESULTS.csv of ``estimate`` or ``map``.
    path : path
        The file; its name ends in .html.
    recording : path or Subject, optional
        Whose arm it is: lengths or height, and how gravity acts.
    upper_arm_m, forearm_hand_m : float, optional
        Lengths in place of those of the recording. Without any, they are found from the measured
        hand positions and joint angles of the results.

    Returns
    -------
    list of str
        What the page says of its sources, such as rows that are left out.

    Raises
    ------
    InputError
        A source cannot be read, or the arm's lengths are not known.
    """
    models, rows, names = _read(sources)
    whose: PathLike | Subject | Owner | None = recording
    if whose is None and isinstance(sources, Estimates) and sources.subject is not None:
        whose = Owner(sources.subject, "those of the subject", None, sources.gravity_m_s2)
    owner = owner_of(rows, whose, upper_arm_m, forearm_hand_m)
    arm = asdict(owner.arm) | {"mass_known": owner.subject.mass_kg is not None}
    measured, notes = measured_data(rows, owner) if rows else ([], [])
    title = ", ".join(names) or "an arm"
    more = {
        "title": title,
        "arm": arm,
        "lengths_from": owner.said,
        "models": models,
        "measured": measured,
        "notes": notes,
    }
    write_html(Path(path), "explore.html.jinja", _SCRIPTS, data={}, more=more, title=title)
    return notes


def _read(sources: Any) -> tuple[list[dict[str, Any]], list[ImpedanceEstimate], list[str]]:
    """The models, all estimates, and the names of the files."""
    single = isinstance(sources, FittedModel | str | os.PathLike)
    estimates = not single and all(isinstance(one, ImpedanceEstimate) for one in sources)
    models: list[dict[str, Any]] = []
    rows: list[ImpedanceEstimate] = []
    names: list[str] = []
    for source in [sources] if single or estimates else sources:
        file = Path(source) if isinstance(source, str | os.PathLike) else None
        if file is not None:
            names.append(file.name)
        if isinstance(source, FittedModel):
            models.append(model_data(source, f"model {len(models) + 1}"))
        elif file is not None and _is_model(file):
            models.append(model_data(read_model(file), file.stem))
        else:
            rows += read_results(file) if file is not None else source
    return models, rows, names


def _is_model(file: Path) -> bool:
    if file.is_dir():
        raise InputError(
            "a folder",
            file=file,
            expected="a MODEL.json, or a RESULTS.csv, which `armimpedance estimate` makes",
        )
    if file.suffix == ".json" and "model" not in read_json(file, "a model"):
        raise InputError("holds no model", file=file, expected="what `armimpedance fit` wrote")
    return file.suffix == ".json"
