"""Twelve motions on two force plates, as a person does them, and two for checks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from manipulandum_sim.body.draft import Draft, step
from manipulandum_sim.body.plan import FreeLeg
from manipulandum_sim.body.restless import (
    ARM_WAVES,
    LEG_WAVES,
    NECK_WAVES,
    PELVIS_WAVES,
    restless,
    restless_above,
)
from manipulandum_sim.body.segments import SIDES


def walk(d: Draft) -> None:
    """Four steps forwards over the plates and as many backwards."""
    wide = d.place["left"][0, 1]
    for side, y in SIDES.items():
        d.place[side][:, 0] = -0.55
        d.place[side][:, 1] = y * wide
    stride, period = d.vary(0.28), 0.70
    places = [-0.55 + stride * (i + 1) for i in range(4)]
    stops = [*places, places[-1]]
    back = [*places[-2::-1], -0.55, -0.55]
    _walk_through(d, 1.2, period, stops, 0.45)
    _walk_through(d, 1.8 + len(stops) * period + 0.9, period * 1.1, back, 0.25)
    apart = d.place["left"][:, 0] - d.place["right"][:, 0]
    d.add("pelvis_rz", -0.25 * apart)
    d.add("trunk_twist_left", 0.45 * apart)
    d.add("neck_twist_left", -0.20 * apart)
    d.add("pelvis_ry", 0.04 * d.during())
    d.add("pelvis_z", -0.02 * d.during())
    for side, y in SIDES.items():
        ahead = -y * d.vary(1.0) * apart
        d.add(f"{side}_shoulder_flexion", 1.0 * ahead)
        d.add(f"{side}_elbow_flexion", 0.55 * ahead + 0.15 * d.during())
    d.add("pelvis_rx", 0.06 * (d.left_share - 0.5) * d.during())
    d.add("trunk_bend_right", -0.05 * (d.left_share - 0.5) * d.during())


def side_walk(d: Draft) -> None:
    """Steps to the left and to the right; each foot keeps to its plate."""
    near, far, wide = 0.07, d.vary(0.28), d.place["left"][0, 1]
    steps = [
        ("left", far),
        ("right", -near),
        ("right", -far),
        ("left", near),
        ("left", far),
        ("right", -near),
        ("right", -wide),
        ("left", wide),
    ]
    start, swing, pause = 1.3, 0.66, 0.42
    knots = []
    for side, y in steps:
        d.footstep(side, start, start + swing, (0.0, y), height=0.08)
        knots.append((start - pause, start, 0.0 if side == "left" else 1.0))
        start += swing + pause
    d.carry([*knots, (start - pause, start + 0.3, 0.5)])
    middle = 0.5 * (d.place["left"][:, 1] + d.place["right"][:, 1])
    d.add("trunk_bend_right", 0.5 * middle)
    d.add("pelvis_z", -0.035 * d.during())
    for side, y in SIDES.items():
        d.add(f"{side}_shoulder_abduction", 0.25 * d.during() + 0.8 * y * middle)
        d.add(f"{side}_elbow_flexion", 0.3 * d.during())


def bending(d: Draft) -> None:
    """Three bows with hanging arms: straight, to the left, to the right."""
    for start, turn in ((0.8, 0.0), (5.0, 0.45), (9.2, -0.45)):
        bow = d.during(start, start + 4.0, 1.5)
        hips, back = d.vary(0.50), d.vary(0.65)
        d.add("pelvis_ry", hips * bow)
        d.add("trunk_flexion", back * bow)
        d.add("trunk_twist_left", turn * bow)
        d.add("pelvis_rz", 0.25 * turn * bow)
        d.add("neck_flexion", 0.25 * bow)
        d.add("pelvis_z", -d.vary(0.03) * bow)
        d.both("shoulder_flexion", 0.95 * (hips + back) * bow)


def squat(d: Draft) -> None:
    """Three knee bends with the arms forward, each a little deeper."""
    for start, depth in ((0.8, 0.20), (4.4, 0.27), (8.0, 0.33)):
        down = d.during(start, start + 3.4, 1.5)
        d.add("pelvis_z", -d.vary(depth) * down)
        d.add("pelvis_ry", 1.1 * depth * down)
        d.add("trunk_flexion", 0.9 * depth * down)
        d.add("neck_flexion", -0.8 * depth * down)
        d.both("shoulder_flexion", 4.0 * depth * down)


def front_squat(d: Draft) -> None:
    """The poster's left-fronted squat: lunges with the left foot in front."""
    wide = d.place["left"][0, 1]
    ahead = d.vary(0.55)
    d.footstep("left", 1.4, 2.3, (ahead, wide), height=0.08)
    d.footstep("left", 11.4, 12.3, (0.0, wide), height=0.08)
    d.carry([(0.5, 1.4, 0.0), (2.3, 3.2, 0.5), (10.4, 11.4, 0.0), (12.3, 13.2, 0.5)])
    stride = step(d.t, 1.7, 2.7) - step(d.t, 10.9, 11.9)
    d.heel["right"] += 0.5 * stride
    for start, depth in ((3.4, 0.18), (7.0, 0.26)):
        down = d.during(start, start + 3.4, 1.4)
        d.add("pelvis_z", -d.vary(depth) * down)
        d.heel["right"] += 0.8 * depth * down
        d.add("trunk_flexion", 0.5 * depth * down)
        d.both("shoulder_abduction", 1.2 * depth * down)
        d.both("elbow_flexion", 2.0 * depth * down)
    d.add("pelvis_z", -0.08 * stride)
    d.left_share = d.left_share + 0.12 * d.during(3.3, 10.3, 1.0)
    d.both("shoulder_abduction", 0.2 * stride)


def arm_raise(d: Draft) -> None:
    """Both arms up in front, then obliquely, then one after the other."""
    for start, flexion, abduction in ((0.7, 2.5, 0.1), (4.5, 1.5, 0.75)):
        up = d.during(start, start + 3.6, 1.5)
        d.both("shoulder_flexion", d.vary(flexion) * up)
        d.both("shoulder_abduction", d.vary(abduction) * up)
        d.both("elbow_flexion", 0.25 * up)
        d.add("trunk_flexion", -0.06 * up)
    for start, side in ((8.3, "right"), (11.0, "left")):
        up = d.during(start, start + 3.4, 1.4)
        d.add(f"{side}_shoulder_flexion", d.vary(2.4) * up)
        d.add(f"{side}_elbow_flexion", d.vary(0.7) * up * np.sin(2 * np.pi * 0.9 * d.t))
        d.add("trunk_bend_right", (0.12 if side == "left" else -0.12) * up)


def arm_circles(d: Draft) -> None:
    """Circles with both arms, forwards together, then against each other."""
    for start, end, against in ((0.6, 7.2, 1.0), (7.0, 13.6, -1.0)):
        on = d.during(start, end, 1.3)
        for side, y in SIDES.items():
            hz = d.vary(0.62)
            phase = 2 * np.pi * hz * (d.t - start) * (against if y > 0 else 1.0)
            d.add(f"{side}_shoulder_flexion", on * (1.05 + d.vary(0.75) * np.sin(phase)))
            d.add(f"{side}_shoulder_abduction", on * (0.45 + d.vary(0.50) * np.cos(phase)))
            d.add(f"{side}_shoulder_rotation", on * d.vary(0.35) * np.sin(phase + 0.9))
            d.add(f"{side}_elbow_flexion", on * (0.35 + d.vary(0.30) * np.sin(2 * phase)))
            d.add(f"{side}_wrist_flexion", on * d.vary(0.30) * np.sin(phase - 0.8))
            d.add(f"{side}_wrist_radial", on * d.vary(0.15) * np.cos(2 * phase))


def trunk_twist(d: Draft) -> None:
    """Turns of the trunk from side to side with the forearms lifted."""
    on = d.during(0.5, None, 1.4)
    turn = on * np.sin(2 * np.pi * d.vary(0.42) * d.t)
    d.add("trunk_twist_left", d.vary(0.60) * turn)
    d.add("pelvis_rz", d.vary(0.22) * turn)
    d.add("neck_twist_left", -d.vary(0.30) * turn)
    d.both("shoulder_abduction", 0.65 * on)
    d.both("shoulder_flexion", 0.25 * on)
    d.both("elbow_flexion", 1.15 * on + 0.15 * turn)
    for side, y in SIDES.items():
        d.add(f"{side}_shoulder_rotation", on * (0.7 - 0.25 * y * turn))


def trunk_side_bend(d: Draft) -> None:
    """Side bends, the upper arm passing over the head."""
    on = d.during(0.5, None, 1.4)
    lean = on * np.sin(2 * np.pi * d.vary(0.27) * d.t)
    d.add("trunk_bend_right", d.vary(0.45) * lean)
    d.add("pelvis_rx", d.vary(0.10) * lean)
    d.add("neck_bend_right", d.vary(0.22) * lean)
    for side, y in SIDES.items():
        up = 0.5 * on + 0.5 * y * lean
        d.add(f"{side}_shoulder_flexion", d.vary(1.9) * up**2)
        d.add(f"{side}_shoulder_abduction", d.vary(0.70) * up)
        d.add(f"{side}_elbow_flexion", d.vary(0.80) * up)


def head_and_arms(d: Draft) -> None:
    """The head looks everywhere while the arms gesture and the hands shake."""
    on = d.during()
    restless(d, on, "neck", NECK_WAVES)
    for side in SIDES:
        restless(d, on, side, ARM_WAVES)


def leg_swings(d: Draft) -> None:
    """On one foot the other leg swings, circles and bends; first the left leg, then the right."""
    _swing_both(d, (1.6, 8.6), (11.0, 18.0))
    on = d.during()
    d.both("shoulder_abduction", 0.55 * on)
    d.both("elbow_flexion", 0.35 * on)


def all_joints(d: Draft) -> None:
    """Everything at once: gestures, looks, sways of trunk and pelvis, a leg in the air."""
    _swing_both(d, (1.6, 10.6), (13.0, 22.0))
    on = d.during()
    restless_above(d, on)
    restless(d, on, "pelvis", PELVIS_WAVES)
    d.add("pelvis_z", on * (-0.05 + d.waves(0.03, 0.3, 1.1)))
    d.sway_m += on[:, None] * np.column_stack([d.waves(0.025, 0.2, 0.8), d.waves(0.008, 0.2, 0.8)])


def pelvis_still(d: Draft) -> None:
    """The pelvis rests on a stand; everything else moves."""
    on = d.during()
    restless_above(d, on)
    d.pelvis["z"] += 0.55 * d.height_m
    for side in SIDES:
        waves = [on * (w[0] + d.waves(*w[1:])) for w in LEG_WAVES.values()]
        d.free[side] = FreeLeg(np.ones_like(d.t), np.column_stack(waves))


def _walk_through(d: Draft, start: float, period: float, stops: list[float], heel: float) -> None:
    """Right, left, right ... to the places along x, the weight passing over between the steps."""
    double = 0.26 * period
    knots = []
    for i, x in enumerate(stops):
        side = ("right", "left")[i % 2]
        y = d.place[side][-1, 1]
        end = start + period - double
        d.footstep(side, start, end, (x, y), height=0.06, heel=heel if i else 0.0)
        before = 0.5 if i == 0 else double
        knots.append((start - before, start, 1.0 if side == "right" else 0.0))
        start += period
    d.carry([*knots, (start - double, start + 0.5, 0.5)])


def _swing_both(d: Draft, left: tuple[float, float], right: tuple[float, float]) -> None:
    """The left leg in the air during one time, the right during another."""
    for side, (start, end) in (("left", left), ("right", right)):
        d.swing(side, start, end, {n: w[0] + d.waves(*w[1:]) for n, w in LEG_WAVES.items()})
    d.carry(
        [
            (left[0] - 1.2, left[0], 0.0),
            (left[1], left[1] + 1.0, 0.5),
            (right[0] - 1.2, right[0], 1.0),
            (right[1], right[1] + 1.0, 0.5),
        ]
    )


#: Name -> how, seconds at the usual tempo.
MOTIONS: Final[dict[str, tuple[Callable[[Draft], None], float]]] = {
    "walk": (walk, 11.8),
    "side_walk": (side_walk, 11.5),
    "bending": (bending, 14.0),
    "squat": (squat, 12.2),
    "front_squat": (front_squat, 14.0),
    "arm_raise": (arm_raise, 15.2),
    "arm_circles": (arm_circles, 14.2),
    "trunk_twist": (trunk_twist, 12.0),
    "trunk_side_bend": (trunk_side_bend, 13.0),
    "head_and_arms": (head_and_arms, 14.0),
    "leg_swings": (leg_swings, 19.6),
    "all_joints": (all_joints, 24.0),
}
#: Held by the pelvis on a stand, for checks of what such motions cannot say.
ON_A_STAND: Final[dict[str, tuple[Callable[[Draft], None], float]]] = {
    "pelvis_still": (pelvis_still, 20.0),
}
