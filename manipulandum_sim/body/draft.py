"""Words to compose a motion with: smooth steps, bumps, sways, footsteps, a leg that swings."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from manipulandum_sim.body.legs import LEG_ANGLES, FootPath
from manipulandum_sim.body.plan import BodyPlan, FreeLeg
from manipulandum_sim.body.segments import SIDES
from manipulandum_sim.body.subject import BodySubject
from manipulandum_sim.body.table import HIP_HALF_WIDTH

PELVIS: Final = ("x", "y", "z", "rz", "ry", "rx")
#: Relative sd of an individual's amplitudes, and of the tempo.
VARIATION: Final = 0.06


def step(t: FloatArray, start: float, end: float) -> FloatArray:
    """A step from 0 before `start` to 1 after `end`, continuous up to the fourth derivative."""
    u = np.clip((t - start) / (end - start), 0, 1)
    return u**5 * (126 + u * (-420 + u * (540 + u * (-315 + 70 * u))))


def bump(t: FloatArray, start: float, top: float, leave: float, end: float) -> FloatArray:
    """Up to 1 from `start` to `top`, down to 0 from `leave` to `end`."""
    return step(t, start, top) - step(t, leave, end)


class Draft:
    """A motion in the making; `plan` ends it.

    Parameters
    ----------
    subject : BodySubject
    seconds : float
        Duration at the usual tempo; the individual's tempo differs.
    rate_hz : float
    rng : Generator
        Generator of the individual's variation.

    Attributes
    ----------
    t : (N,)
        The usual tempo's clock, s: motions are written in it.
    """

    def __init__(
        self, subject: BodySubject, seconds: float, rate_hz: float, rng: np.random.Generator
    ) -> None:
        self.rng, self.seconds, self.height_m = rng, seconds, subject.height_m
        tempo = np.exp(0.5 * VARIATION * rng.standard_normal())
        count = int(round(seconds / tempo * rate_hz)) + 1
        self.time_s = np.arange(count) / rate_hz
        self.t = self.time_s * (seconds / self.time_s[-1])
        none = np.zeros(count)
        self.pelvis = {name: none.copy() for name in PELVIS}
        self.angles = {
            f"{side}_{name}": np.full(count, value)
            for side in SIDES
            for name, value in (
                ("shoulder_abduction", 0.14),
                ("shoulder_flexion", 0.04),
                ("elbow_flexion", 0.22),
            )
        }
        wide = 1.25 * HIP_HALF_WIDTH * self.height_m
        self.place = {s: np.column_stack([none, none + y * wide]) for s, y in SIDES.items()}
        self.lift = {side: none.copy() for side in SIDES}
        self.heel = {side: none.copy() for side in SIDES}
        self.yaw = {side: none + 0.12 * y for side, y in SIDES.items()}
        self.left_share = none + 0.5
        self.sway_m = np.zeros((count, 2))
        self.free: dict[str, FreeLeg] = {}

    def vary(self, value: float) -> float:
        """An individual's version of an amplitude."""
        return float(value * np.exp(VARIATION * self.rng.standard_normal()))

    def add(self, name: str, values: FloatArray) -> None:
        """Add to a coordinate: an upper body's angle, or ``pelvis_<x|y|z|rz|ry|rx>``."""
        if name.startswith("pelvis_"):
            self.pelvis[name.removeprefix("pelvis_")] += values
        else:
            self.angles[name] = self.angles.get(name, 0.0) + values

    def both(self, name: str, values: FloatArray) -> None:
        """Add the same to the right and the left side's angle."""
        for side in SIDES:
            self.add(f"{side}_{name}", self.vary(1.0) * values)

    def during(self, start: float = 0.5, end: float | None = None, fade: float = 1.2) -> FloatArray:
        """1 from `start` to `end` with smooth flanks, 0 outside."""
        end = self.seconds - 0.5 if end is None else end
        return bump(self.t, start, start + fade, end - fade, end)

    def waves(self, amplitude: float, low_hz: float, high_hz: float, count: int = 3) -> FloatArray:
        """A restless swing (N,) of about `amplitude`: `count` sines within a band."""
        edges = np.linspace(low_hz, high_hz, count + 1)
        hz = self.rng.uniform(edges[:-1], edges[1:])
        phase = 2 * np.pi * (self.t[:, None] * hz + self.rng.random(count))
        # Slower waves are wider, as limbs move: amplitudes fall with frequency.
        size = (hz[0] / hz) ** 0.7
        return self.vary(amplitude) * (np.sin(phase) @ size) / np.sqrt((size**2).sum())

    def footstep(
        self,
        side: str,
        start: float,
        end: float,
        to: tuple[float, float],
        *,
        height: float = 0.07,
        heel: float = 0.0,
    ) -> None:
        """One step of a foot to a place (x, y), m, between lifting at `start` and landing at `end`.

        The weight goes over to the other foot before and comes back half after; `carry` overrides.

        Parameters
        ----------
        side : {"right", "left"}
        start, end : float
        to : (float, float)
        height : float
            Height of the lifted foot, m.
        heel : float
            How far (rad) the heel leaves the floor before the foot does.
        """
        t, place = self.t, self.place[side]
        place += step(t, start, end)[:, None] * (np.array(to) - place[-1])
        middle, early = 0.5 * (start + end), 0.15 * (end - start)
        self.lift[side] += self.vary(height) * bump(t, start, middle, middle, end)
        if heel:
            up = bump(t, start - 2 * early, start + 2 * early, start + 2 * early, end - early)
            self.heel[side] += heel * up

    def carry(self, knots: list[tuple[float, float, float]]) -> None:
        """The weight goes to the left foot's share ``to`` from ``start`` to ``end``, in turn."""
        share = self.left_share[0]
        for start, end, to in knots:
            passing = step(self.t, start, end)
            # Exact at both ends: a lifted foot carries nothing at all.
            self.left_share = np.where(passing >= 1, to, self.left_share + passing * (to - share))
            share = to

    def swing(self, side: str, start: float, end: float, angles: dict[str, FloatArray]) -> None:
        """A leg leaves its foothold at `start`, follows angles (N,) and is back at `end`."""
        part = bump(self.t, start, start + 1.0, end - 1.0, end)
        # The foothold rises beneath the leg, so that it stays in reach until nothing is left of it.
        self.lift[side] += 0.15 * part
        zero = np.zeros_like(self.t)
        values = [angles.get(name, zero) for name in LEG_ANGLES]
        self.free[side] = FreeLeg(part, np.column_stack(values))

    def plan(self, *, standing: bool = True) -> BodyPlan:
        """The finished plan; without standing the pelvis is held and all legs' angles are free."""
        feet = {
            side: FootPath(self.place[side], self.lift[side], self.yaw[side], self.heel[side])
            for side in SIDES
        }
        return BodyPlan(
            self.time_s,
            np.column_stack([self.pelvis[name] for name in PELVIS]),
            self.angles,
            feet if standing else {},
            self.left_share,
            self.sway_m,
            self.free,
        )
