"""A posture model as plain lists and numbers for a JSON file, and back, every field checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any

import numpy as np

from armimpedance.errors import ArmImpedanceError, InputError
from armimpedance.muscles.angle_scaling import AngleScaling
from armimpedance.muscles.posture_certificate import Certificate, Gram, proves
from armimpedance.muscles.posture_fit import POSTURE_MODELS
from armimpedance.muscles.posture_model import PostureModel, PosturePolynomial
from armimpedance.muscles.posture_terms import checked_order, exponents, term_names
from armimpedance.muscles.quality import ElementQuality
from armimpedance.muscles.region import Region
from armimpedance.regression.summary import FitSummary, NamedParameter

FORMAT, VERSION = "armimpedance-posture-model", 1


def model_as_plain(model: PostureModel) -> dict[str, Any]:
    """Everything that the model holds; not-finite numbers as text, which JSON has no sign for."""
    return {
        "format": FORMAT,
        "version": VERSION,
        "model": model.name,
        "order": model.order,
        "terms": list(term_names(exponents(2 * model.order))),
        "box_rad": model.scaling.box.tolist(),
        "measured_scaled": model.region.vertices.tolist(),
        "tolerance_scaled": model.region.tolerance,
        "dof": _plain_number(model.dof),
        "stiffness": _plain_polynomial(model.stiffness),
        "viscosity": _plain_polynomial(model.viscosity),
        "quality": [_plain_fields(q) for q in model.quality],
        "summary": {
            **_plain_fields(model.summary, without=("parameters",)),
            "parameters": [_plain_fields(p) for p in model.summary.parameters],
        },
    }


def model_from_plain(plain: Mapping[str, Any]) -> PostureModel:
    """The model of `model_as_plain`.

    Raises
    ------
    InputError
        Not a posture model, a field missing or of a wrong kind or shape.
    """
    if not isinstance(plain, Mapping) or plain.get("format") != FORMAT:
        raise InputError("not a posture model", expected=f'a mapping with "format": "{FORMAT}"')
    if plain.get("version") != VERSION:
        raise InputError(
            f"a posture model of version {plain.get('version')}", expected=str(VERSION)
        )
    try:
        return _model(plain)
    except KeyError as error:
        raise InputError(
            "a posture model with a field missing", column=str(error.args[0])
        ) from error
    except ArmImpedanceError as error:
        raise InputError(f"not a posture model: {error}") from error
    except (TypeError, ValueError, AttributeError) as error:
        raise InputError(f"not a posture model: {str(error).splitlines()[0]}") from error


def _model(plain: Mapping[str, Any]) -> PostureModel:
    order = checked_order(plain["order"])
    summary = dict(plain["summary"])
    parameters = tuple(NamedParameter(**_numbers(p)) for p in summary.pop("parameters"))
    warnings = tuple(str(w) for w in summary.pop("warnings"))
    name = _text(plain, "model")
    if name not in POSTURE_MODELS:
        raise InputError(f"posture model {name!r}", expected=" or ".join(POSTURE_MODELS))
    return PostureModel(
        name=name,
        order=order,
        scaling=AngleScaling(_array(plain, "box_rad")),
        stiffness=_polynomial(plain["stiffness"], order),
        viscosity=_polynomial(plain["viscosity"], order),
        dof=_number(plain["dof"]),
        region=Region(_array(plain, "measured_scaled"), float(plain["tolerance_scaled"])),
        quality=tuple(ElementQuality(**_numbers(q)) for q in plain["quality"]),
        summary=FitSummary(**_numbers(summary), parameters=parameters, warnings=warnings),
    )


def _plain_polynomial(made: PosturePolynomial) -> dict[str, Any]:
    found = made.certificate
    return {
        "coefficients": made.coefficients.tolist(),
        "covariance": made.covariance.tolist(),
        "structure": made.structure,
        "penalty": made.penalty,
        "certificate": {
            "promise": found.promise,
            "smallest_eigenvalue": found.smallest_eigenvalue,
            "at_rad": found.at.tolist(),
            "grams": [
                {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in asdict(g).items()}
                for g in found.grams
            ],
        },
    }


def _polynomial(plain: Mapping[str, Any], order: int) -> PosturePolynomial:
    found = plain["certificate"]
    made = PosturePolynomial(
        coefficients=_array(plain, "coefficients"),
        covariance=_array(plain, "covariance"),
        structure=_text(plain, "structure"),
        penalty=float(plain["penalty"]),
        certificate=Certificate(
            smallest_eigenvalue=float(found["smallest_eigenvalue"]),
            at=_array(found, "at_rad"),
            grams=tuple(Gram(**gram) for gram in found["grams"]),
        ),
    )
    complete = len(made.coefficients) == len(exponents(2 * order))
    if (
        complete
        and made.certificate.grams
        and not proves(made.certificate.grams, made.coefficients, order)
    ):
        raise InputError("Gram matrices that do not add up to the coefficients prove nothing")
    return made


def _plain_fields(record: Any, without: tuple[str, ...] = ()) -> dict[str, Any]:
    names = [f.name for f in fields(record) if f.name not in without]
    return {name: _plain_number(getattr(record, name)) for name in names}


def _plain_number(value: Any) -> Any:
    if isinstance(value, tuple):
        return list(value)
    return str(value) if isinstance(value, float) and not np.isfinite(value) else value


def _numbers(record: Mapping[str, Any]) -> dict[str, Any]:
    """Fields with "inf" and "nan" as numbers again."""
    return {k: _number(v) if v in ("inf", "-inf", "nan") else v for k, v in record.items()}


def _number(value: Any) -> float:
    if isinstance(value, bool):
        raise InputError(f"not a number: {value}")
    return float(value)


def _text(plain: Mapping[str, Any], name: str) -> str:
    if not isinstance(plain[name], str):
        raise InputError(f"{name} is {plain[name]!r}", expected="a text")
    return str(plain[name])


def _array(plain: Mapping[str, Any], name: str) -> np.ndarray:
    return np.array(plain[name], dtype=float)
