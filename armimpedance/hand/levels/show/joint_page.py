"""Page of the impedance at the joints, mapped from the hand."""

from __future__ import annotations

from dataclasses import replace

from armimpedance.hand.levels.show.verb import to_joint
from armimpedance.hand.show.estimates import Estimates
from armimpedance.hand.still.show import estimate, of_estimates
from armimpedance.show.pages import Asked, Page, Topic
from armimpedance.show.verbs.results import read_recording


def page_of(asked: Asked) -> Page:
    """Build the page of a session of the hand, mapped to the joints of its subject."""
    recording = read_recording(asked.recording)
    hand = estimate(
        recording,
        by=asked.by,
        method=asked.method,
        covariance=asked.covariance,  # type: ignore[arg-type]
        seed=asked.seed,
        despite=asked.despite,
        progress=asked.progress,
    )
    joint: Estimates = to_joint(hand, recording=recording)
    page = of_estimates(asked, joint, recording)
    mapped = (
        " They were mapped to the joints by K_j = J^T K_e J - Gamma(F) - dg/dq, B_j = J^T B_e J "
        "and M_j = J^T M_e J, the covariance carried along."
    )
    methods = replace(page.methods, paragraph=page.methods.paragraph + mapped)
    return replace(page, methods=methods)


TOPIC = Topic("inertia, viscosity and stiffness of the joints, mapped from the hand", page_of)
