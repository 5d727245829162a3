"""The table of the kinds of models that can be fitted; the entries lie in the folder `kinds`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from armimpedance.core.method_table import MethodTable

if TYPE_CHECKING:
    from armimpedance.muscles.models.fitted_model import FittedModel


@dataclass(frozen=True)
class ModelKind:
    """A kind of model: how it is fitted, written and asked.

    `name`: name of the model in ``armimpedance fit`` and MODEL.json.
    `type`: the class of its models, a `FittedModel`.
    `fit`: it takes `JointRows` and keywords.
    `options`: the options of ``armimpedance fit`` that it takes, without dashes, and the keyword of
    `fit` that each of them sets.
    `needs`: arguments that the method `predict` of its models takes, in this order.
    """

    name: str
    type: type[FittedModel]
    fit: Callable[..., FittedModel]
    options: Mapping[str, str]
    needs: tuple[str, ...]


MODEL_KINDS: Final[MethodTable[ModelKind]] = MethodTable(
    "armimpedance.muscles.models.kinds", "MODEL", "kind of model", "moment-arms", joint="-"
)


def kind_of(model: FittedModel) -> ModelKind:
    """The kind of a model.

    Parameters
    ----------
    model : FittedModel

    Returns
    -------
    ModelKind

    Raises
    ------
    TypeError
        The model is of none of the kinds.
    """
    for kind in MODEL_KINDS.values():
        if type(model) is kind.type:
            return kind
    raise TypeError(f"{type(model).__name__} is no kind of model")
