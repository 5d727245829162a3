"""Result of an impedance analysis: M, B and K at one level with their covariance.

Sizes: k axes of the level, n joints, m muscles.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from html import escape
from types import MappingProxyType
from typing import Annotated, Any, Final

import numpy as np

from armimpedance.core.arrays import LEAST_DOF, FloatArray, FrozenRecord, frozen_array
from armimpedance.core.conventions import MATRICES, UNITS, Level, group_name, parameter_names
from armimpedance.core.errors import RecordError
from armimpedance.core.shown import html_table

#: Elements of K that a short text shows.
_MOST_SHOWN: Final = 9
#: Fields that are mappings.
_MAPPINGS: Final = ("keys", "shared_errors")


@dataclass(frozen=True)
class Quality:
    """Quality of the fit of the second-order model. None: does not apply.

    multiple_correlation: between the corrected force and its prediction, over all axes, as the
    source defines it; it cannot see a reflex or a wrong model. vaf: variance accounted for, 0..1.
    coherence: mean multiple coherence over the fitted band (stochastic perturbations).
    """

    n_trials: int
    n_rows: int
    multiple_correlation: float
    vaf: float
    cond_raw: float
    cond_scaled: float
    rank: int
    residual_sd: float
    coherence: float | None = None


@dataclass(frozen=True, repr=False)
class ImpedanceEstimate(FrozenRecord):
    """Inertia, viscosity and stiffness at one level, with their covariance.

    Attributes
    ----------
    level : {"hand", "joint", "muscle"}
    method : str
    inertia, viscosity, stiffness : (k, k)
        SI units of the level. `inertia` is the limb's own, the handle subtracted.
    inertia_with_handle : (k, k)
        As measured.
    covariance : (3 k^2, 3 k^2)
        Covariance of M, B, K, each row by row (the order of `core.conventions.parameter_names`).
    dof : float
        Degrees of freedom of the t distribution for intervals; inf = normal.
    bound : (3 k^2, 3 k^2) or None
        The Cramer-Rao bound: the least covariance of any unbiased estimator on this motion and
        noise, in the same order. It includes, as `covariance` does, systematic errors that the
        trials do not exclude. `efficiency` compares the two.
    keys : mapping
        The group's columns, for example ``{"condition": "relaxed"}``.
    position, force : (k_hand,) or None
        Mean hand position (m) and force (N) at the onset, or joint angle and torque for a
        recording of joints.
    joint_angles : (n,) or None
        Mean joint angles at the onset, rad.
    torque : (n,) or None
        Joint torque that the muscles bear at the onset, ``tau = J^T F``, N m; known once mapped.
    activation, activation_sd : (m,) or None
        Mean activation of each muscle before the onset, 0..1, and its standard error.
    muscles : tuple of str
        Names of those muscles, in their order; empty where they are not known.
    shoulder_m : (k_hand,) or None
        Place of the shoulder in the frame of `position`.
    shared_errors : mapping of str to (3 k^2,)
        Errors of M, B and K that all estimates of a recording share, by their cause such as a
        "reflex": the change by one standard deviation of the cause. Their squares are part of
        `covariance`; a fit of several estimates needs them separately, since they do not average
        out.
    warnings : tuple of str
    provenance : tuple of str

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> session, truth = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> estimate = ai.estimate(session)[0]
    >>> estimate.level, estimate.method
    ('hand', 'weighted')
    """

    level: Level
    method: str
    inertia: Annotated[FloatArray, "k k"]
    viscosity: Annotated[FloatArray, "k k"]
    stiffness: Annotated[FloatArray, "k k"]
    covariance: Annotated[FloatArray, "p p"]
    dof: float
    quality: Quality
    inertia_with_handle: Annotated[FloatArray, "k k"] | None = None
    bound: Annotated[FloatArray, "p p"] | None = None
    keys: Mapping[str, Any] = field(default_factory=dict)
    position: Annotated[FloatArray, "_"] | None = None
    force: Annotated[FloatArray, "_"] | None = None
    joint_angles: Annotated[FloatArray, "_"] | None = None
    torque: Annotated[FloatArray, "_"] | None = None
    activation: Annotated[FloatArray, "_"] | None = None
    activation_sd: Annotated[FloatArray, "_"] | None = None
    muscles: tuple[str, ...] = ()
    shoulder_m: Annotated[FloatArray, "_"] | None = None
    shared_errors: Mapping[str, FloatArray] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    provenance: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.inertia_with_handle is None:
            object.__setattr__(self, "inertia_with_handle", self.inertia)
        if len(self.covariance) != 3 * self.k**2:
            shape = f"shape ({3 * self.k**2}, {3 * self.k**2})"
            raise RecordError(f"covariance has shape {self.covariance.shape}", expected=shape)
        shared = {
            name: frozen_array(error, f"shared_errors of {name}", (3 * self.k**2,))
            for name, error in self.shared_errors.items()
        }
        object.__setattr__(self, "shared_errors", MappingProxyType(shared))
        if not self.dof >= LEAST_DOF:
            raise RecordError(f"{self.dof:g} degrees of freedom", expected=f"{LEAST_DOF:g} or more")

    def __getstate__(self) -> dict[str, Any]:
        # a read-only view of a mapping cannot go to another process
        return {**self.__dict__, **{name: dict(getattr(self, name)) for name in _MAPPINGS}}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.__dict__.update({name: MappingProxyType(state[name]) for name in _MAPPINGS})

    def marked(self, sentences: Sequence[str]) -> ImpedanceEstimate:
        """Return a copy with these sentences, from checks of the data, before its warnings."""
        return replace(self, warnings=(*sentences, *self.warnings)) if sentences else self

    @property
    def k(self) -> int:
        """Number of axes."""
        return len(self.inertia)

    @property
    def parameters(self) -> FloatArray:
        """M, B, K row by row, (3 k^2,)."""
        return np.concatenate([self.inertia, self.viscosity, self.stiffness], axis=None)

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of `parameters`: ``M_11 … K_kk``."""
        return parameter_names(self.k)

    @property
    def sd(self) -> FloatArray:
        """Standard errors of M, B, K, (3, k, k)."""
        return np.sqrt(np.diag(self.covariance)).reshape(3, self.k, self.k)

    @property
    def efficiency(self) -> FloatArray | None:
        """Ratio of the bound's variance to the estimate's, for each element, (3, k, k).

        Its relative standard error is that of the estimated variances: sqrt(2/n) with n degrees of
        freedom.
        """
        if self.bound is None:
            return None
        variances = np.diag(self.covariance)
        ratio = np.diag(self.bound) / np.where(variances > 0, variances, np.inf)
        return np.asarray(ratio.reshape(3, self.k, self.k))

    def shared_through(self, T: FloatArray) -> dict[str, FloatArray]:
        """`shared_errors` after a linear map T (q, 3 k^2) of M, B, K."""
        return {name: T @ error for name, error in self.shared_errors.items()}

    def with_warning(self, *sentences: str) -> ImpedanceEstimate:
        """Return a copy with these sentences after its warnings."""
        return replace(self, warnings=(*self.warnings, *sentences))

    def not_definite(self) -> tuple[str, ...]:
        """Return a warning for each of M, B and K that is not positive definite."""
        d, warnings = self.k, []
        named = {"inertia": self.inertia, "viscosity": self.viscosity, "stiffness": self.stiffness}
        for index, (name, matrix) in enumerate(named.items()):
            values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
            lowest, direction = float(values[0]), vectors[:, 0]
            if lowest > 1e-13 * abs(values[-1]):
                continue
            block = slice(index * d * d, (index + 1) * d * d)
            # v^T A v, (d,) (d, d) (d,), is linear in A: its variance is w^T C w, w = v (x) v
            w = np.kron(direction, direction)
            variance = float(w @ self.covariance[block, block] @ w)
            half = self._factor * float(np.sqrt(max(variance, 0.0)))
            text = f"{name} is not positive definite (smallest eigenvalue {lowest:.3g})"
            if lowest + half < 0:
                text = (
                    f"plausible: {name} is not positive definite, smallest eigenvalue {lowest:.3g} "
                    f"+- {half:.2g}: no passive limb; check sign, axes and units, and that nobody "
                    "moved along"
                )
            elif name == "viscosity":
                continue
            if name == "stiffness" and d > 2:
                text += "; a free elbow that swivels does that too: hold it, or stay out longer"
            warnings.append(text)
        return tuple(warnings)

    @property
    def _factor(self) -> float:
        """Half-width of a 95 % interval in standard errors."""
        # imported here: reading a recording needs no SciPy
        from scipy.special import ndtri, stdtrit

        return float(ndtri(0.975) if np.isinf(self.dof) else stdtrit(self.dof, 0.975))

    def interval(self) -> FloatArray:
        """95 % limits of M, B, K: the lower ones, then the upper ones, (2, 3, k, k)."""
        values = np.stack([self.inertia, self.viscosity, self.stiffness])
        half = self._factor * self.sd
        return np.stack([values - half, values + half])

    def to_dict(self) -> dict[str, Any]:
        """Plain texts, numbers and nested lists: group, matrices with limits, warnings."""
        low, high = self.interval()
        matrices: dict[str, Any] = {}
        for i, (name, (symbol, _)) in enumerate(MATRICES.items()):
            matrices[symbol] = getattr(self, name).tolist()
            matrices[f"sd_{symbol}"] = self.sd[i].tolist()
            matrices[f"ci_low_{symbol}"] = low[i].tolist()
            matrices[f"ci_high_{symbol}"] = high[i].tolist()
        return {
            "group": dict(self.keys),
            "level": self.level,
            "method": self.method,
            "n_trials": self.quality.n_trials,
            **matrices,
            "warnings": list(self.warnings),
        }

    def _stiffness_rows(self) -> list[tuple[str, str, str]]:
        """Name, value and limits of elements of K; with 4 or more axes, of the diagonal only."""
        low, high = self.interval()[:, 2]
        unit = UNITS[self.level]["K"]
        shown = [(i, j) for i in range(self.k) for j in range(self.k) if self.k < 4 or i == j]
        return [
            (
                f"K_{i + 1}{j + 1}",
                f"{self.stiffness[i, j]:.4g} {unit}",
                f"{low[i, j]:.4g} to {high[i, j]:.4g}",
            )
            for i, j in shown[:_MOST_SHOWN]
        ]

    def _head(self) -> str:
        trials = self.quality.n_trials
        return f"{group_name(self.keys)}: {self.level}, method {self.method}, {trials} trials"

    def __repr__(self) -> str:
        rows = [f"{name} = {value} (95 %: {ci})" for name, value, ci in self._stiffness_rows()]
        warned = [f"{len(self.warnings)} warnings"] if self.warnings else []
        return "\n".join([self._head(), *rows, *warned])

    def _repr_html_(self) -> str:
        table = html_table([("", "value", "95 %"), *self._stiffness_rows()])
        warned = "".join(f"<li>{escape(sentence)}</li>" for sentence in self.warnings)
        return f"<p>{escape(self._head())}</p>{table}<ul>{warned}</ul>"
