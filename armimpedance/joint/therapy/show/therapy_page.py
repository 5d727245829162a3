"""Page of a patient's contribution to movements with a therapy robot."""

from __future__ import annotations

from armimpedance.core.errors import InputError
from armimpedance.core.program import software
from armimpedance.core.shown import with_half_width
from armimpedance.joint.therapy.show.contributions import Contributions
from armimpedance.joint.therapy.show.plots import plot_feedback
from armimpedance.joint.therapy.show.text import contribution_text
from armimpedance.joint.therapy.show.verb import contribution
from armimpedance.show.pages import (
    GUIDALI,
    Asked,
    Page,
    Section,
    Table,
    Topic,
    methods_of,
    page_from,
    picture,
    reviewed,
    told_by,
)
from armimpedance.show.text import counted
from armimpedance.show.verbs.results import read_recording


def _sentences() -> list[str]:
    return [
        f"The contribution was computed with {software()} as the share c of "
        "tau_user = c tau_h + d (inertia torque of the robot) by least squares over the "
        "samples in which the axis moves",
        "0 % is a passive arm, 100 % an arm that needs no support",
        "Intervals are 95 % intervals that count robot, arm and noise",
    ]


def page_of(asked: Asked) -> Page:
    """Page of a session with an identified robot and a measured arm."""
    if asked.robot is None or asked.arm is None:
        raise InputError(
            "a therapy session without --robot and --arm",
            file=asked.source,
            expected="ROBOT.json and ARM.json, as `therapy robot` and `therapy arm` write them",
        )
    results = contribution(
        read_recording(asked.recording),
        robot=asked.robot,
        arm=asked.arm,
        despite=asked.despite,
        progress=asked.progress,
    )
    warnings = told_by((*results.notes, *results.left_out.values()), asked.checks)
    drawn = plot_feedback(results.movements, results.robot, results.arm)
    return page_from(
        asked,
        warnings,
        title="Contribution",
        lead=f"{counted(len(results), 'movement')} with the robot {results.robot.name}.",
        count=counted(len(results), "movement"),
        next_step=_next(results),
        reader=(
            Section("Contribution per movement", (_table(results),)),
            Section(
                "Pictures",
                (picture(drawn, "contribution", "Torques of the arm and of the person."),),
            ),
        ),
        reviewer=reviewed(warnings, contribution_text(results)),
        methods=methods_of(_sentences(), [GUIDALI]),
        options=[("despite", ", ".join(asked.despite))],
        data={"contributions": results.to_frame()},
    )


def _next(results: Contributions) -> str:
    valid = sum(result.share.valid for result in results)
    if valid < len(results):
        return (
            f"The share of {len(results) - valid} of {counted(len(results), 'movement')} cannot be "
            "told: the notes of these movements say why."
        )
    return "Read the share; compare conditions by their means over several movements."


def _table(results: Contributions) -> Table:
    rows = tuple(
        (
            result.trial,
            result.condition,
            result.movement,
            with_half_width(result.share.percent, (result.share.ci95[1] - result.share.ci95[0]) / 2)
            if result.share.valid
            else "cannot be told",
            f"{result.projection.percent:.0f}",
            "; ".join(result.notes),
        )
        for result in results
    )
    heads = ("trial", "condition", "movement", "share (%)", "projection (%)", "notes")
    caption = "Share of each movement, ± half the 95 % interval: 0 passive, 100 no support needed"
    return Table(caption, heads, rows, "contributions")


TOPIC = Topic("a patient's contribution to movements with a therapy robot", page_of)
