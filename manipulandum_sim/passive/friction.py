"""A passive arm through time: fourth-order Runge-Kutta, dry friction by events, without chatter.

Between reversals the sign of each hinge's velocity is a constant, so that the motion is smooth.
Where a velocity passes zero inside a step, the step ends at that moment (found to 1e-13 of it);
there the hinge sticks if its friction can hold it, and moves on otherwise. The motion is
therefore that of the exact sign function, of order four in the step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.core.errors import EstimationError
from manipulandum_sim.passive.chain import Chain

#: Pieces that reversals may cut one step into.
MOST_PIECES: Final = 40


@dataclass(frozen=True)
class JointLaw:
    """Passive torque ``-(k e + K e^2 + h qd + f sign(qd))``, ``e = q - q_r``; every entry (K,)."""

    k: FloatArray
    h: FloatArray
    f: FloatArray
    q_r: FloatArray
    K: FloatArray

    def torque(self, q: FloatArray, qd: FloatArray, sign: FloatArray) -> FloatArray:
        """Torque (T, K) at angles, velocities and signs (T, K)."""
        e = q - self.q_r
        return -((self.k + self.K * e) * e + self.h * qd + self.f * sign)


class State(NamedTuple):
    """State of T chains; every entry (T, K).

    sign : -1, 0, 1; 0 where a hinge is held or has no friction. held : by its dry friction.
    """

    q: FloatArray
    qd: FloatArray
    sign: FloatArray
    held: BoolArray

    def of(self, chain: int) -> State:
        """One chain's, as a batch of one; a copy."""
        only = slice(chain, chain + 1)
        return State(
            self.q[only].copy(),
            self.qd[only].copy(),
            self.sign[only].copy(),
            self.held[only].copy(),
        )


@dataclass(frozen=True)
class PassivePlant:
    """A chain with its joints' law."""

    chain: Chain
    law: JointLaw

    def acceleration(self, state: State, base: FloatArray) -> FloatArray:
        """qdd (T, K)."""
        held = state.held if state.held.any() else None
        tau = self.law.torque(state.q, state.qd, state.sign)
        return self.chain.acceleration(state.q, state.qd, base, tau, held)

    def joint_torque(self, state: State, base: FloatArray) -> tuple[FloatArray, FloatArray]:
        """qdd and what the passive joints exert, holding friction included, (T, K) each."""
        qdd = self.acceleration(state, base)
        M, bias = self.chain.mass_and_bias(state.q, state.qd, base)
        return qdd, (M @ qdd[..., None])[..., 0] + bias

    def start(self, q: FloatArray, base: FloatArray) -> State:
        """At rest at angles (T, K): held where friction can hold, else about to move."""
        still = np.zeros_like(q)
        state = State(q.copy(), still, still.copy(), np.zeros(q.shape, dtype=bool))
        state.held[:, self.law.f != 0] = True
        return self.release(state, base)

    def release(self, state: State, base: FloatArray) -> State:
        """Let go every held hinge that needs more than its friction."""
        if not state.held.any():
            return state
        _, exerted = self.joint_torque(state, base)
        needed = exerted - self.law.torque(state.q, state.qd, np.zeros_like(state.q))
        slips = state.held & (np.abs(needed) > self.law.f)
        if not slips.any():
            return state
        sign = np.where(slips, -np.sign(needed), state.sign)
        return state._replace(sign=sign, held=state.held & ~slips)

    def step(self, state: State, bases: FloatArray, dt: float) -> State:
        """One step on; `bases` (3, T, 3, 12) at its start, middle and end."""
        state = self.release(state, bases[0])
        after = self._runge_kutta(state, bases, dt)
        for chain in np.flatnonzero((state.sign * after.qd < 0).any(axis=1)):
            one = self._through_reversals(state.of(int(chain)), bases[:, chain : chain + 1], dt)
            for whole, part in zip(after, one, strict=True):
                whole[chain] = part[0]
        return after

    def _runge_kutta(self, state: State, bases: FloatArray, dt: float) -> State:
        """Signs and holds as they are at the start."""
        q, v1 = state.q, state.qd
        a1 = self.acceleration(state, bases[0])
        v2 = v1 + dt / 2 * a1
        a2 = self.acceleration(state._replace(q=q + dt / 2 * v1, qd=v2), bases[1])
        v3 = v1 + dt / 2 * a2
        a3 = self.acceleration(state._replace(q=q + dt / 2 * v2, qd=v3), bases[1])
        v4 = v1 + dt * a3
        a4 = self.acceleration(state._replace(q=q + dt * v3, qd=v4), bases[2])
        return State(
            q + dt / 6 * (v1 + 2 * v2 + 2 * v3 + v4),
            v1 + dt / 6 * (a1 + 2 * a2 + 2 * a3 + a4),
            state.sign.copy(),
            state.held.copy(),
        )

    def _piece(self, state: State, bases: FloatArray, dt: float, a: float, b: float) -> State:
        """Integrate from the fraction a of a step to b; the base moves along a parabola in it."""
        at = np.stack([_parabola(bases, x) for x in (a, (a + b) / 2, b)])
        return self._runge_kutta(state, at, (b - a) * dt)

    def _through_reversals(self, state: State, bases: FloatArray, dt: float) -> State:
        """A step of one chain, cut where a velocity passes zero."""
        here, turned = 0.0, set[int]()
        for _ in range(MOST_PIECES):
            after = self._piece(state, bases, dt, here, 1.0)
            crossing = np.flatnonzero((state.sign * after.qd < 0)[0])
            if len(crossing) == 0:
                return after
            moments = [self._reversal(state, bases, dt, here, int(j)) for j in crossing]
            first = int(np.argmin(moments))
            joint, there = int(crossing[first]), moments[first]
            state = self._piece(state, bases, dt, here, there)
            self._turn(state, _parabola(bases, there), joint, again=joint in turned)
            turned.add(joint)
            here = there
        raise EstimationError(f"a simulated joint reverses {MOST_PIECES} times in {dt:g} s")

    def _reversal(
        self, state: State, bases: FloatArray, dt: float, here: float, joint: int
    ) -> float:
        """The fraction of the step at which a hinge's velocity passes zero."""
        from scipy.optimize import brentq

        def velocity(there: float) -> float:
            return float(self._piece(state, bases, dt, here, there).qd[0, joint])

        return float(brentq(velocity, here, 1.0, xtol=1e-13, rtol=1e-13))

    def _turn(self, state: State, base: FloatArray, joint: int, *, again: bool) -> None:
        """At rest for a moment: hold the hinge, or send it the other way; changes `state`."""
        before = state.sign[0, joint]
        state.qd[0, joint] = 0.0
        if self.law.f[joint] < 0:
            state.sign[0, joint] = -before
            return
        state.sign[0, joint], state.held[0, joint] = 0.0, True
        if not again:
            # a hinge that turns twice within a step stays until the next one begins
            let_go = self.release(state, base)
            state.sign[0, joint] = let_go.sign[0, joint]
            state.held[0, joint] = let_go.held[0, joint]


def _parabola(bases: FloatArray, x: float) -> FloatArray:
    """Through values at 0, 1/2 and 1 (the first axis)."""
    return (
        (2 * x - 1) * (x - 1) * bases[0] + 4 * x * (1 - x) * bases[1] + x * (2 * x - 1) * bases[2]
    )
