"""Rows of the joint level as the figures' models are fitted to them."""

from __future__ import annotations

from dataclasses import replace

from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.levels import arm_posture_for, to_joint
from armimpedance.muscles.models import ElementQuality, JointRows, joint_rows
from armimpedance_figures.tsuji1997.study import StudiedExperiment


def rows_of(
    *studied: StudiedExperiment, symmetric: bool = True, force_term: bool = True
) -> JointRows:
    """All conditions of some experiments on one subject, mapped from the hand.

    Parameters
    ----------
    symmetric : bool
        False keeps K_se and K_es apart, as measured.
    force_term : bool
        False leaves Gamma(F) out, as the source does.
    """
    return joint_rows([_mapped(e, one, symmetric, force_term) for one in studied for e in one.hand])


def without_errors(rows: JointRows) -> JointRows:
    """The same rows as the source knew them: every one counts alike, activations are exact."""
    return replace(rows, stiffness_sd=None, viscosity_sd=None, activation_sd=None)


def by_element(quality: tuple[ElementQuality, ...]) -> dict[str, ElementQuality]:
    """Quality by the element's name."""
    return {q.element: q for q in quality}


def _mapped(
    estimate: ImpedanceEstimate, one: StudiedExperiment, symmetric: bool, force_term: bool
) -> ImpedanceEstimate:
    posture, _ = arm_posture_for(estimate, one.subject)
    return to_joint(estimate, posture, symmetric=symmetric, force_dependent=force_term)
