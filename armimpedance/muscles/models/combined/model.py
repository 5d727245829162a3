"""Joint stiffness and viscosity of an arm's muscles at any posture and activation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import InputError
from armimpedance.limb.arm import PolynomialPaths
from armimpedance.muscles.models.activation.model import checked_activation
from armimpedance.muscles.models.combined.equations import EvaluatedEquations, MuscleEquations
from armimpedance.muscles.models.combined.lengths import CorrectedLengths
from armimpedance.muscles.models.fitted_model import ElementQuality, FittedModel
from armimpedance.muscles.models.packed import matrix
from armimpedance.muscles.models.prediction import JointPrediction
from armimpedance.muscles.models.workspace import AngleScaling, Region
from armimpedance.numerics.regression import FitSummary, Parameters

#: An activation this far beyond the measured range is still inside (rounding in a file).
_EDGE = 1e-6
#: Postures per joint at which the smallest eigenvalue is looked for.
_GRID = 25
#: ... of an arm of more than two joints.
_COARSE = 5
#: Turns of eigenvector and activations.
_TURNS = 5
#: What MODEL.json calls a field that has another name here.
_IN_FILES = {"values": "parameters"}


@dataclass(frozen=True, repr=False)
class MuscleModel(FittedModel):
    """The equations of `combined.equations` with fitted parameters.

    Attributes
    ----------
    arm : str
        The anatomical arm that was corrected.
    muscles : (m,) tuple of str
    order : int
        N of stiffness over activation.
    stiffness_per_tension : float
        kappa, 1/m.
    curvature : bool
    exponents, base, muscle, change, box
        The same as in `combined.lengths.CorrectedLengths`.
    highest : (m,)
        Measured range of each activation, from 0.
    values : (n,)
        The parameters: corrections z, increments of f (N/m), passive stiffness (joints),
        increments of b (N s/m), passive viscosity (joints); their places are those of
        `combined.equations.ParameterLayout`.
    covariance : (n, n)
        Covariance of `values`.
    dof : float
        Degrees of freedom of the t distribution for intervals.
    measured : (V, joints)
        Hull of the measured postures, scaled angles.
    quality : tuple of ElementQuality
        K_ss, K_se, K_ee, B_ss, B_se, B_ee; of more joints K_11, K_12 and so on.
    summary : FitSummary
    scatter : (float, float)
        Of K and B: standard deviation of what a muscle gives at one place about what the equations
        say, as a part of it. It is what the form is wrong by, and part of every prediction's error.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> levels, _ = simulate("cocontraction", seed=1, sets=1)
    >>> model = ai.fit_muscles(ai.to_joint(ai.estimate(levels)), order=0)
    >>> model.muscles[0]
    'pectoralis_major'
    """

    arm: str
    muscles: Annotated[tuple[str, ...], "m"]
    order: int
    stiffness_per_tension: float
    curvature: bool
    exponents: Annotated[IntArray, "t j"]
    base: Annotated[FloatArray, "m t"]
    muscle: Annotated[IntArray, "c"]
    change: Annotated[FloatArray, "c t"]
    box: Annotated[FloatArray, "j 2"]
    highest: Annotated[FloatArray, "m"]
    values: Annotated[FloatArray, "n"]
    covariance: Annotated[FloatArray, "n n covariance"]
    dof: float
    measured: Annotated[FloatArray, "v j"]
    quality: tuple[ElementQuality, ...]
    summary: FitSummary
    scatter: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        m, n = len(self.muscles), self.equations.layout.n
        if len(self.values) != n:
            raise InputError(f"{len(self.values)} parameters", expected=f"{n}")
        if not ((self.muscle >= 0) & (self.muscle < m)).all():
            raise InputError("a correction of no muscle", expected=f"numbers 0 to {m - 1}")
        if not (self.highest > 0).all():
            raise InputError("a muscle without a range of activation", expected="more than 0")

    @property
    def equations(self) -> MuscleEquations:
        """The form without the parameters."""
        lengths = CorrectedLengths(
            self.muscles, self.exponents, self.base, self.muscle, self.change, self.box, 0.0
        )
        return MuscleEquations(
            lengths, self.order, self.highest, self.stiffness_per_tension, self.curvature
        )

    @property
    def parameters(self) -> Parameters:
        """The parameters of K and B with their covariance."""
        named = self.summary.parameters[: len(self.values)]
        return Parameters(
            tuple(p.name for p in named),
            tuple(p.unit for p in named),
            self.values,
            self.covariance,
            dof=self.dof,
        )

    @property
    def paths(self) -> PolynomialPaths:
        """The muscles' paths as corrected."""
        equations = self.equations
        return equations.lengths.paths(self.values[equations.layout.z])

    def predict(self, joint_angles: ArrayLike, activation: ArrayLike) -> JointPrediction:
        """K_j and B_j at postures (P, n) rad and activations (P, m), each 0..1; one may be (1, .).

        Raises
        ------
        InputError
            Shapes that do not belong together, or activations outside of 0..1.
        """
        n = len(self.box)
        alpha, q = checked_activation(activation, self.muscles), _checked_angles(joint_angles, n)
        if len(alpha) != len(q) and 1 not in (len(alpha), len(q)):
            raise InputError(f"{len(q)} postures, {len(alpha)} activations", expected="as many")
        P = max(len(alpha), len(q))
        alpha, q = np.broadcast_to(alpha, (P, len(self.muscles))), np.broadcast_to(q, (P, n))
        form = self.equations.at(q, alpha)
        K, dK = form.stiffness(self.values)
        B, dB = form.viscosity(self.values)
        reasons = self._reasons(q, alpha)
        return JointPrediction(
            joint_angles=q,
            stiffness=K,
            viscosity=B,
            stiffness_covariance=self._covariance(form, dK, "K"),
            viscosity_covariance=self._covariance(form, dB, "B"),
            dof=self.dof,
            extrapolated=np.array([bool(reason) for reason in reasons]),
            reasons=reasons,
            activation=alpha,
        )

    def _covariance(self, form: EvaluatedEquations, slope: FloatArray, which: str) -> FloatArray:
        """Covariance (P, E, E) from the parameters' and from the scatter."""
        parts = self.scatter["KB".index(which)] * form.scattered(self.values, which)
        by_parameters = slope @ self.covariance @ slope.transpose(0, 2, 1)
        return np.asarray(by_parameters + parts @ parts.transpose(0, 2, 1))

    def muscle_stiffness(self, activation: ArrayLike) -> FloatArray:
        """Stiffness (P, m) of each muscle, N/m; what rows do not tell apart the prior has split."""
        alpha = checked_activation(activation, self.muscles)
        equations = self.equations
        form = equations.at(np.zeros((len(alpha), len(self.box))), alpha)
        f = self.values[equations.layout.f].reshape(len(self.muscles), -1)
        return np.asarray(np.einsum("pmk,mk->pm", form.basis, f))

    def smallest_eigenvalue(self, box: ArrayLike | None = None) -> float:
        """Smallest eigenvalue of K_j over a box of postures (n, 2), rad, and all activations.

        Over posture it is the least of a grid. Over activation the eigenvalue is concave in the
        muscles' stiffnesses, hence smallest where each muscle is at rest or at its highest. Such a
        corner is looked for by turns: ``v^T K v`` is least where muscles that lower it are on, and
        over v at the eigenvector there.
        """
        limits = AngleScaling(np.asarray(self.box if box is None else box, dtype=float))
        q = limits.grid(_GRID if len(self.box) == 2 else _COARSE)
        layout = self.equations.layout
        rest, full = self.muscle_stiffness(np.stack([np.zeros_like(self.highest), self.highest]))
        form = self.equations.at(q, np.zeros((len(q), len(self.muscles))))
        squares, curvatures = form.squares(self.values)[0], form.curvatures(self.values)[0]
        # K (P, n, n) = K_p + f(0) gg^T, and what each muscle adds (P, m, n, n)
        at_rest = matrix(np.einsum("m,pme->pe", rest, squares))
        at_rest = at_rest + np.diag(self.values[layout.passive_K])
        added = matrix((full - rest)[:, None] * (squares + curvatures))
        lowest = np.inf
        for start in range(len(self.box)):
            v = np.linalg.eigh(at_rest)[1][..., start]
            for _ in range(_TURNS):
                on = np.einsum("pi,pmij,pj->pm", v, added, v) < 0
                values, vectors = np.linalg.eigh(at_rest + np.einsum("pm,pmij->pij", on, added))
                v = vectors[..., 0]
            lowest = min(lowest, float(values[:, 0].min()))
        return lowest

    def _reasons(self, q: FloatArray, alpha: FloatArray) -> tuple[str, ...]:
        inside = Region(self.measured).contains(AngleScaling(self.box).scaled(q))
        above = alpha > self.highest + _EDGE
        reasons = []
        for p in range(len(q)):
            words = [] if inside[p] else ["posture outside of the measured ones"]
            if above[p].any():
                names = ", ".join(np.array(self.muscles)[above[p]])
                words.append(f"activation outside of the measured range: {names}")
            reasons.append("; ".join(words))
        return tuple(reasons)

    def as_plain(self) -> dict[str, Any]:
        """Lists, numbers and texts from which `from_plain` makes the same model again."""
        return {_IN_FILES.get(name, name): value for name, value in super().as_plain().items()}

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any]) -> MuscleModel:
        """The model that `as_plain` wrote.

        Raises
        ------
        InputError
            A field is missing, unknown or not what it should be.
        """
        fields = {theirs: own for own, theirs in _IN_FILES.items()}
        return super().from_plain({fields.get(name, name): v for name, v in plain.items()})


def _checked_angles(joint_angles: ArrayLike, n: int) -> FloatArray:
    q = np.atleast_2d(np.asarray(joint_angles, dtype=float))
    if q.ndim != 2 or q.shape[1] != n or not np.isfinite(q).all():
        raise InputError(
            f"joint angles of shape {np.shape(joint_angles)}", expected=f"(P, {n}), finite, rad"
        )
    return q
