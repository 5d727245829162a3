"""What Table 2 and Figs 12 to 14 of Tsuji (1997) share: models over activation, N = 1, 2, 3."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from armimpedance.core.errors import ArmImpedanceError
from armimpedance.limb.arm import TwoLinkArm, arm_named, arm_of
from armimpedance.muscles.models import (
    ActivationModel,
    ElementQuality,
    JointRows,
    element_fits,
    fit_activation_model,
)
from armimpedance_figures.tsuji1997.rows import rows_of, without_errors
from armimpedance_figures.tsuji1997.study import StudiedExperiment

#: Experiments 2 and 3.
EXPERIMENTS = ("cocontraction", "force")
ORDERS = (1, 2, 3)
MOMENT_ARMS = "planar6"


@dataclass(frozen=True)
class OverActivation:
    """Fits to experiments 2 and 3 together.

    Attributes
    ----------
    studied : tuple of StudiedExperiment
    arm : TwoLinkArm
    rows : JointRows
        With the force term, weighted.
    source : mapping of int to tuple of ElementQuality
        As the source fits (`muscles.activation_elements`): each element by itself, no force term,
        all rows alike, activations exact.
    ours : mapping of int to ActivationModel
        With both terms, standard errors and errors of the activation.
    left_out : tuple of str
        Orders that these conditions cannot tell, and why.
    """

    studied: tuple[StudiedExperiment, ...]
    arm: TwoLinkArm
    rows: JointRows
    source: Mapping[int, tuple[ElementQuality, ...]]
    ours: Mapping[int, ActivationModel]
    left_out: tuple[str, ...]

    @property
    def drawn_order(self) -> int:
        """The source's N = 2, or the highest order below that could be fitted."""
        return max(order for order in self.ours if order <= 2)


def fit(*studied: StudiedExperiment) -> OverActivation:
    """Fit every order that the conditions allow.

    Raises
    ------
    ArmImpedanceError
        Not even the first.
    """
    muscles = arm_named(MOMENT_ARMS)
    rows = rows_of(*studied)
    plain = without_errors(rows_of(*studied, force_term=False))
    source: dict[int, tuple[ElementQuality, ...]] = {}
    ours, left_out = {}, []
    for order in ORDERS:
        try:
            as_source = element_fits(plain, muscles, order=order)
            ours[order] = fit_activation_model(rows, muscles, order=order)
            source[order] = as_source
        except ArmImpedanceError as error:
            if order == 1:
                raise
            left_out.append(f"N = {order} left out: {error}.")
    arm = arm_of(studied[0].subject)
    return OverActivation(studied, arm, rows, source, ours, tuple(left_out))
