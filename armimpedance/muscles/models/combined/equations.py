"""Joint stiffness, viscosity and torque of the muscles of an arm, with derivatives.

``K_j = K_p + sum_i [f_i(alpha_i) g_i(theta) g_i(theta)^T + t_i d2L_i(theta)]``, f_i in
Bernstein form with coefficients that start at no less than zero and never fall; B_j likewise with
b_i(alpha_i) and without curvature; ``tau = tau_p(theta) - sum_i (1 + e_i) g_i t_i``. The tension is
``t_i = (f_i(alpha_i) - f_i(0)) / kappa``: a muscle at rest is stiff without pulling as hard as that
stiffness would mean for an active one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.muscles.models.activation.fit import bernstein_basis, bernstein_slopes, increments
from armimpedance.muscles.models.combined.lengths import CorrectedLengths
from armimpedance.muscles.models.packed import elements


@dataclass(frozen=True)
class ParameterLayout:
    """Where in the parameter vector x (n,) what stands.

    `corrections`: C, of the lengths: x[z].
    `muscles`, `order`: m and N: m (N + 1) increments of f, in N/m, then of b, in N s/m.
    """

    corrections: int
    muscles: int
    order: int
    joints: int

    @property
    def z(self) -> slice:
        """Corrections of the lengths."""
        return slice(0, self.corrections)

    @property
    def f(self) -> slice:
        """Increments of f, muscle by muscle."""
        return slice(self.corrections, self.corrections + self.muscles * (self.order + 1))

    @property
    def passive_K(self) -> slice:
        """Stiffness of the passive joints."""
        return slice(self.f.stop, self.f.stop + self.joints)

    @property
    def b(self) -> slice:
        """Increments of b."""
        start = self.passive_K.stop
        return slice(start, start + self.muscles * (self.order + 1))

    @property
    def passive_B(self) -> slice:
        """Viscosity of the passive joints."""
        return slice(self.b.stop, self.b.stop + self.joints)

    @property
    def n(self) -> int:
        """Parameters of K and B."""
        return self.passive_B.stop

    @property
    def tau_p(self) -> slice:
        """Passive torque: constant, and per scaled angle of each joint, of each joint."""
        return slice(self.n, self.n + self.joints * (self.joints + 1))

    @property
    def e(self) -> slice:
        """Deviations of the tensions from proportionality to stiffness."""
        return slice(self.tau_p.stop, self.tau_p.stop + self.muscles)


@dataclass(frozen=True)
class MuscleEquations(FrozenRecord):
    """The model's form: everything but its parameters.

    `order`: N.
    `highest` (m,): activation at which s = 1 in the Bernstein form.
    """

    lengths: CorrectedLengths
    order: int
    highest: Annotated[FloatArray, "m"]
    stiffness_per_tension: float
    curvature: bool

    @property
    def layout(self) -> ParameterLayout:
        """Where each parameter stands."""
        own = self.lengths
        return ParameterLayout(len(own.muscle), len(own.muscles), self.order, len(own.box))

    def at(self, q: FloatArray, activation: FloatArray) -> EvaluatedEquations:
        """The form at postures (P, n) and activations (P, m)."""
        gradient, second = self.lengths.derivatives(q)
        rising = increments(self.order, increasing=True)
        s = activation / self.highest
        return EvaluatedEquations(
            equations=self,
            gradient=gradient,
            second=second * (self.curvature / self.stiffness_per_tension),
            basis=bernstein_basis(s, self.order) @ rising,
            slopes=bernstein_slopes(s, self.order) @ rising / self.highest[:, None],
            scaled=self.lengths.scaling.scaled(q),
        )


@dataclass(frozen=True)
class EvaluatedEquations:
    """The model at P postures and activations, for any parameters.

    `gradient`, `second` (P, n, T), (P, E, T): derivatives of the length terms, E = n (n + 1) / 2
    packed elements; `second` is over kappa, and zero without curvature.
    `basis`, `slopes` (P, m, N + 1): what the increments multiply in f, and its derivative by alpha;
    the first is f(0).
    `scaled` (P, n): angles.
    """

    equations: MuscleEquations
    gradient: FloatArray
    second: FloatArray
    basis: FloatArray
    slopes: FloatArray
    scaled: FloatArray

    def stiffness(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Packed, in the plane ``ss, se, ee``, (P, E) and derivatives (P, E, parameters)."""
        return self._matrix(x, "K")

    def viscosity(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Packed, in the plane ``ss, se, ee``, (P, E) and derivatives (P, E, parameters)."""
        return self._matrix(x, "B")

    def by_activation(self, x: FloatArray, which: str) -> FloatArray:
        """Derivatives (P, E, m) of "K" or "B" by the activations."""
        layout = self.equations.layout
        coefficients = x[layout.f if which == "K" else layout.b]
        rate = np.einsum("pmk,mk->pm", self.slopes, coefficients.reshape(self._per_muscle))
        patterns = self.squares(x)[0]
        if which == "K":
            patterns = patterns + self.curvatures(x)[0]
        return np.asarray((rate[..., None] * patterns).transpose(0, 2, 1))

    @property
    def _per_muscle(self) -> tuple[int, int]:
        return self.equations.layout.muscles, self.equations.order + 1

    def _arms(self, x: FloatArray) -> FloatArray:
        """Moment arms (P, m, n)."""
        lengths = self.equations.lengths.coefficients(x[self.equations.layout.z])
        return np.asarray((self.gradient @ lengths.T).swapaxes(1, 2))

    @cached_property
    def _arm_changes(self) -> FloatArray:
        """Change of a muscle's moment arms per unit of each correction, (P, C, n)."""
        return np.asarray((self.gradient @ self.equations.lengths.change.T).swapaxes(1, 2))

    @cached_property
    def _curvature_changes(self) -> FloatArray:
        """Change of the curvatures over kappa per unit of each correction, (P, C, E)."""
        return np.asarray((self.second @ self.equations.lengths.change.T).swapaxes(1, 2))

    def squares(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """``g g^T`` of each muscle (P, m, E), and its change (P, C, E) by the muscle's own z."""
        g = self._arms(x)
        i, j = elements(g.shape[-1])
        # of the correction's own muscle: g (P, C, n) and what the correction adds to it
        mine, dg = g[:, self.equations.lengths.muscle], self._arm_changes
        return g[..., i] * g[..., j], mine[..., i] * dg[..., j] + mine[..., j] * dg[..., i]

    def scattered(self, x: FloatArray, which: str) -> FloatArray:
        """``f_i g_i g_i^T`` (P, E, m) of "K", or with b_i of "B": what scatter is a part of."""
        coefficients = x[self.equations.layout.f if which == "K" else self.equations.layout.b]
        f = np.einsum("pmk,mk->pm", self.basis, coefficients.reshape(self._per_muscle))
        return np.asarray((f[..., None] * self.squares(x)[0]).transpose(0, 2, 1))

    def curvatures(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """``d2L / kappa`` of each muscle (P, m, E), and its change (P, C, E) by its z."""
        lengths = self.equations.lengths.coefficients(x[self.equations.layout.z])
        return np.asarray((self.second @ lengths.T).swapaxes(1, 2)), self._curvature_changes

    def _matrix(self, x: FloatArray, which: str) -> tuple[FloatArray, FloatArray]:
        layout, own = self.equations.layout, self.equations.lengths
        stiff = which == "K"
        active = layout.f if stiff else layout.b
        passive = layout.passive_K if stiff else layout.passive_B
        coefficients = x[active].reshape(self._per_muscle)
        (P, E), diagonal = self.second.shape[:2], np.flatnonzero(np.equal(*elements(layout.joints)))
        value, slope = np.zeros((P, E)), np.zeros((P, E, layout.n))
        value[:, diagonal] = x[passive]
        slope[:, diagonal, np.arange(passive.start, passive.stop)] = 1.0
        parts = [(self.basis, self.squares(x))]
        if stiff:
            parts.append((self._rising, self.curvatures(x)))
        for basis, (patterns, change) in parts:
            f = np.einsum("pmk,mk->pm", basis, coefficients)
            value += np.einsum("pm,pme->pe", f, patterns)
            slope[:, :, layout.z] += (f[:, own.muscle, None] * change).transpose(0, 2, 1)
            by_f = basis[:, :, :, None] * patterns[:, :, None, :]
            slope[:, :, active] += by_f.reshape(P, -1, E).transpose(0, 2, 1)
        return value, slope

    @property
    def _rising(self) -> FloatArray:
        """`basis` without f(0)."""
        rising = self.basis.copy()
        rising[..., 0] = 0.0
        return rising

    def torque(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Joint torque (P, n) and its derivatives by all parameters, those of torque too."""
        layout, own = self.equations.layout, self.equations.lengths
        kappa = self.equations.stiffness_per_tension
        g = self._arms(x)
        rising = self._rising
        t = np.einsum("pmk,mk->pm", rising, x[layout.f].reshape(self._per_muscle)) / kappa
        e = 1 + x[layout.e]
        P, n = self.scaled.shape
        ones = np.concatenate([np.ones((P, 1)), self.scaled], axis=1)
        passive = x[layout.tau_p].reshape(n, n + 1)
        value = ones @ passive.T - np.einsum("pmj,pm->pj", g, e * t)
        slope = np.zeros((P, n, layout.e.stop))
        pull = (e * t)[:, own.muscle, None]
        slope[:, :, layout.z] = -(pull * self._arm_changes).transpose(0, 2, 1)
        by_f = -rising[..., None] * (g * e[:, None])[:, :, None, :] / kappa
        slope[:, :, layout.f] = by_f.reshape(P, -1, n).transpose(0, 2, 1)
        for joint in range(n):
            start = layout.tau_p.start + (n + 1) * joint
            slope[:, joint, start : start + n + 1] = ones
        slope[:, :, layout.e] = -(g * t[..., None]).transpose(0, 2, 1)
        return value, slope
