"""Draw docs/project/data_flow.svg: the lanes of the topics, from a lab's files to results.

Standard library only; run ``python docs/draw_data_flow.py`` after a lane has changed.
"""

from __future__ import annotations

from html import escape
from pathlib import Path

#: Topic -> its stages, each (type, made by).
LANES = {
    "hand": (
        ("Window", "numerics.signals"),
        ("Response", "numerics.signals"),
        ("TrialFactors", "hand.still"),
        ("ImpedanceEstimate", "hand: hand.still"),
        ("ImpedanceEstimate", "joints: hand.levels"),
        ("PostureModel, ...", "muscles.models"),
    ),
    "hand, random perturbation": (
        ("Lines", "hand.random"),
        ("RandomEquations", "hand.random"),
        ("RandomFit", "hand.random"),
        ("ImpedanceEstimate", "hand: hand.random"),
        ("ImpedanceEstimate", "joints: hand.levels"),
    ),
    "moving hand": (
        ("Courses, Pushes", "hand.reaching"),
        ("PhaseWindows", "hand.reaching"),
        ("ReachEquations", "hand.reaching"),
        ("ImpedanceEstimate", "phases: hand.reaching"),
    ),
    "live": (
        ("EmgLevels", "live: rest, maximum"),
        ("Activity", "live: each sample"),
        ("StiffnessForm", "live: a MuscleModel"),
        ("LiveStiffness", "live: each sample"),
    ),
    "elbow": (
        ("JointSamples", "joint.elbow"),
        ("PreparedSamples", "joint.elbow"),
        ("Band", "joint.elbow"),
        ("ElbowFit", "elbow.stationary"),
        ("EmgLaw", "elbow.emg"),
    ),
    "elbow over time": (
        ("JointSamples", "joint.elbow"),
        ("VaryingData", "elbow.varying"),
        ("VaryingImpedance", "elbow.varying"),
    ),
    "passive": (
        ("MotionRecording", "limb.mocap"),
        ("PassiveSamples", "joint.relaxed"),
        ("Equations", "joint.relaxed"),
        ("PassiveFit", "relaxed: k, h, f"),
    ),
    "body": (
        ("MotionRecording", "limb.mocap"),
        ("BodyEquations", "joint.body"),
        ("BaseParameters", "joint.body"),
        ("BodyFit", "body: masses, inertias"),
    ),
    "therapy": (
        ("SmoothTrial", "joint.therapy"),
        ("TherapyRobot", "therapy.robot"),
        ("PassiveArm", "therapy.arm"),
        ("MovementTorques", "joint.therapy"),
        ("Contribution", "therapy.share, live"),
    ),
}
SOURCES = (("A lab's files", "recordings"), ("Simulated subjects", "manipulandum_sim"))
LEFT, TOP, WIDTH, HEIGHT, GAP_X, GAP_Y = 362, 40, 158, 44, 22, 28
BLUE, ORANGE, GREEN = ("#e8f1fa", "#0072B2"), ("#fdf1e1", "#D55E00"), ("#e6f5ef", "#009E73")


def box(
    x: float, y: float, title: str, below: str, look: tuple[str, str], width: int = WIDTH
) -> str:
    """A box with a bold line and a plain one."""
    middle = x + width / 2
    return (
        f'<rect x="{x}" y="{y}" width="{width}" height="{HEIGHT}" rx="6" fill="{look[0]}" '
        f'stroke="{look[1]}" stroke-width="1.5"/>'
        f'<text x="{middle}" y="{y + 20}" font-size="12.5" font-weight="bold" '
        f'text-anchor="middle" fill="#222">{escape(title)}</text>'
        f'<text x="{middle}" y="{y + 36}" font-size="11" text-anchor="middle" fill="#444">'
        f"{escape(below)}</text>"
    )


def arrow(x1: float, y1: float, x2: float, y2: float) -> str:
    """A line with a head."""
    return (
        f'<path d="M{x1} {y1} L{x2} {y2}" stroke="#444" stroke-width="1.3" fill="none" '
        'marker-end="url(#a)"/>'
    )


def lane(row: int, topic: str, stages: tuple[tuple[str, str], ...]) -> list[str]:
    """One topic: its name, its stages, and arrows between them."""
    y = TOP + row * (HEIGHT + GAP_Y)
    middle = y + HEIGHT / 2
    drawn = [
        f'<text x="{LEFT - 12}" y="{y - 6}" font-size="12" font-style="italic" '
        f'text-anchor="start" fill="#0072B2">{topic}</text>'
    ]
    for i, (title, below) in enumerate(stages):
        x = LEFT + i * (WIDTH + GAP_X)
        drawn += [arrow(x - GAP_X + 1, middle, x - 2, middle)]
        drawn += [box(x, y, title, below, BLUE)]
    return drawn


def picture() -> str:
    """The whole drawing as SVG."""
    rows = len(LANES)
    height = TOP + rows * (HEIGHT + GAP_Y) + 130
    width = LEFT + 6 * (WIDTH + GAP_X)
    foot = TOP + rows * (HEIGHT + GAP_Y) + 20
    spine, centre = LEFT - GAP_X, TOP + (rows * (HEIGHT + GAP_Y) - GAP_Y) / 2
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        'font-family="Helvetica, Arial, sans-serif" role="img" '
        'aria-label="Data flow of armimpedance, a lane for each topic">',
        '<defs><marker id="a" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="7" '
        'markerHeight="7" orient="auto"><path d="M0 0 L10 5 L0 10 z" fill="#444"/></marker></defs>',
        f'<rect width="{width}" height="{height}" fill="#fff"/>',
    ]
    for i, (title, below) in enumerate(SOURCES):
        y = centre - HEIGHT - 15 + i * (HEIGHT + 30)
        parts.append(box(10, y, title, below, ORANGE))
        parts.append(arrow(10 + WIDTH, y + HEIGHT / 2, 198, centre))
    parts.append(box(200, centre - HEIGHT / 2, "Recording", "samples, trials", BLUE, 110))
    parts.append(
        f'<path d="M310 {centre} H{spine} M{spine} {TOP + HEIGHT / 2} '
        f'V{TOP + (rows - 1) * (HEIGHT + GAP_Y) + HEIGHT / 2}" stroke="#444" stroke-width="1.3" '
        'fill="none"/>'
    )
    for row, (topic, stages) in enumerate(LANES.items()):
        parts += lane(row, topic, stages)
    ends = (
        ("analyses", "one verb a topic: estimate, elbow, ..."),
        ("armimpedance", "the face, for notebooks"),
        ("files, plots, report", "what is written, drawn, read"),
        ("cli", "one command a verb"),
    )
    for i, (title, below) in enumerate(ends):
        parts.append(box(LEFT + i * 250, foot + 30, title, below, GREEN, 228))
    parts.append(
        f'<text x="{LEFT}" y="{foot + 18}" font-size="12" fill="#444">Results of every lane hold '
        "their parameters with covariance; these rooms call the lanes and take the results on:"
        "</text>"
    )
    return "\n".join([*parts, "</svg>"]) + "\n"


if __name__ == "__main__":
    Path(__file__).with_name("project").joinpath("data_flow.svg").write_text(
        picture(), encoding="utf-8"
    )
