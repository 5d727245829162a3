"""What of a muscle model a live update needs, for any number of joints and muscles.

``K_j = K_p + sum_i [f_i(alpha_i) g_i g_i^T + (f_i(alpha_i) - f_i(0)) d2L_i / kappa]``, as in
`muscles.models.combined.equations`, but with every array laid out for one sample at a time.
Symmetric matrices are packed: the elements on and above the diagonal, row by row.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.muscles.models import AngleScaling, MuscleModel, Region


@dataclass(frozen=True)
class StiffnessForm(FrozenRecord):
    """A model of joint stiffness over posture and activation: m muscles, n joints.

    Attributes
    ----------
    muscles : (m,) tuple of str
    exponents : (T, n) int
        Powers of the scaled angles in each term of a muscle's length.
    lengths : (m, T)
        Coefficients of the lengths, m.
    muscle : (C,) int
        Number of the muscle that each correction of the lengths belongs to.
    change : (C, T)
        Change of that muscle's coefficients with the correction, m.
    box : (n, 2)
        Joint angles (rad) that become -1 and 1.
    rising : (N + 1, N + 1)
        ``basis = (1, s, ..., s^N) @ rising`` with ``s = alpha / highest``: what the coefficients of
        f multiply; the first of them is f at rest.
    highest : (m,)
        Highest activation of each muscle that the model was fitted to.
    stiffness : (m, N + 1)
        Coefficients of f, N/m.
    per_tension : float
        1 / kappa in m, or 0 without curvature.
    passive : (n,)
        N m/rad.
    covariance : (p, p)
        Of corrections, coefficients of f (muscle by muscle) and passive stiffness, in this order.
    dof : float
        Degrees of freedom of the t distribution for intervals.
    measured : (V, n) or None
        Hull of the measured postures, scaled angles; None: the whole box was measured.
    scatter : float
        Standard deviation of each muscle's ``f_i g_i g_i^T`` at one place, as a part of it.
    """

    muscles: Annotated[tuple[str, ...], "m"]
    exponents: Annotated[IntArray, "t n"]
    lengths: Annotated[FloatArray, "m t"]
    muscle: Annotated[IntArray, "c"]
    change: Annotated[FloatArray, "c t"]
    box: Annotated[FloatArray, "n 2"]
    rising: Annotated[FloatArray, "k k"]
    highest: Annotated[FloatArray, "m"]
    stiffness: Annotated[FloatArray, "m k"]
    per_tension: float
    passive: Annotated[FloatArray, "n"]
    covariance: Annotated[FloatArray, "p p covariance"]
    dof: float
    measured: Annotated[FloatArray, "v n"] | None = None
    scatter: float = 0.0

    @property
    def joints(self) -> int:
        """Number of joints n."""
        return len(self.box)

    def was_measured(self, q: FloatArray) -> bool:
        """Whether a posture (n,) lies among the measured ones."""
        if self.measured is None:
            return bool(((q >= self.box[:, 0]) & (q <= self.box[:, 1])).all())
        return bool(self._region.contains(self._scaling.scaled(q)))

    @cached_property
    def _region(self) -> Region:
        return Region(np.asarray(self.measured))

    @cached_property
    def _scaling(self) -> AngleScaling:
        return AngleScaling(self.box)


def form_of(model: MuscleModel) -> StiffnessForm:
    """The form of a model that `fit muscles` made.

    Parameters
    ----------
    model : MuscleModel

    Returns
    -------
    StiffnessForm
    """
    equations, x = model.equations, model.values
    layout, lengths = equations.layout, equations.lengths
    kept = np.r_[layout.z, layout.f, layout.passive_K]
    return StiffnessForm(
        muscles=model.muscles,
        exponents=model.exponents,
        lengths=lengths.coefficients(x[layout.z]),
        muscle=model.muscle,
        change=model.change,
        box=model.box,
        rising=_powers_to_basis(model),
        highest=model.highest,
        stiffness=x[layout.f].reshape(len(model.muscles), -1),
        per_tension=model.curvature / model.stiffness_per_tension,
        passive=x[layout.passive_K],
        covariance=model.covariance[np.ix_(kept, kept)],
        dof=model.dof,
        measured=model.measured,
        scatter=model.scatter[0],
    )


def _powers_to_basis(model: MuscleModel) -> FloatArray:
    """The model's own basis at N + 1 activations, as a matrix on the powers of s."""
    s = np.linspace(0.0, 1.0, model.order + 1)
    at = model.equations.at(
        np.tile(model.box.mean(axis=1), (len(s), 1)), s[:, None] * model.highest
    )
    return np.asarray(np.linalg.solve(np.vander(s, increasing=True), at.basis[:, 0]))
