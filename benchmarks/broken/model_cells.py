"""`fit activation` and `fit moment-arms`: joint stiffness over muscles and over posture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from broken.cell import Answer, Cell, Made, Rig, damaged, on_record, said, seeds_of
from scipy.stats import t as student

from armimpedance.limb.arm import arm_named
from armimpedance.muscles.models import JointRows, matrix
from armimpedance.muscles.show import fit_activation, fit_posture

POSTURE = np.array([1.04, 1.57])
ELEMENTS = ("ss", "se", "ee")
#: N m/rad: of every element of K.
SD_K, SD_B = 0.5, 0.03
#: N/m at rest, and per unit of activation.
REST, SLOPE = 2000.0, 40_000.0
UNITS = ("units", "plausible")
LACK = ("lack of fit", "curvature", "moment arms", "law", "amplitude")


@lru_cache(maxsize=1)
def moment_arms() -> np.ndarray:
    """G (m, 2) of the arm that the analysis takes."""
    return np.asarray(arm_named("planar6").paths.moment_arms(POSTURE))


@dataclass(frozen=True)
class Muscles:
    """Muscles of our own over 24 conditions; no tension is told.

    Attributes
    ----------
    arms_off : float
        Sd of the factors between the person's moment arms and the analysis's, joint by joint.
    bent : float
        Stiffness saturates: ``alpha / (1 + bent alpha)``.
    crosstalk : float
        Part of the next muscle's EMG in each activation.
    alpha_off : float
        Sd of the error of an activation, as a part of it; not told.
    outlier : float
        One condition's K is so much too large.
    """

    arms_off: float = 0.0
    bent: float = 0.0
    crosstalk: float = 0.0
    alpha_off: float = 0.0
    outlier: float = 1.0

    def record(self, index: int) -> Made:
        """Rows, and K at two activations that were not measured."""
        rng = seeds_of("muscles", index)
        m = len(moment_arms())
        G = moment_arms() * (1 + self.arms_off * rng.standard_normal((m, 2)))
        alpha = rng.uniform(0.02, 0.3, (24, m))
        held_out = np.stack([np.full(m, 0.1), np.linspace(0.06, 0.2, m)])

        def stiffness(a: np.ndarray) -> np.ndarray:
            k = REST + SLOPE * a / (1 + self.bent * a)
            return np.asarray(np.einsum("pm,mi,mj->pij", k, G, G))

        K, B = stiffness(alpha), 0.05 * stiffness(alpha)
        K[5] *= self.outlier
        K = K + matrix(SD_K * rng.standard_normal((24, 3)))
        B = B + matrix(SD_B * rng.standard_normal((24, 3)))
        seen = alpha + self.crosstalk * np.roll(alpha, 1, axis=1)
        seen = np.clip(seen * (1 + self.alpha_off * rng.standard_normal(alpha.shape)), 0, 1)
        rows = JointRows(
            joint_angles=np.tile(POSTURE, (24, 1)),
            stiffness=K,
            viscosity=B,
            stiffness_sd=np.full(K.shape, SD_K),
            viscosity_sd=np.full(B.shape, SD_B),
            activation=seen,
        )
        truth = _elements(stiffness(held_out))
        # what a muscle adds to the trace of K: of its own stiffness no K tells anything
        truth |= {f"muscle {i + 1}": float(SLOPE * G[i] @ G[i]) for i in range(m)}
        # the same electrodes see what is predicted from
        return Made(rows, truth, held_out + self.crosstalk * np.roll(held_out, 1, axis=1))


def _elements(K: np.ndarray) -> dict[str, float]:
    places = ((0, 0), (0, 1), (1, 1))
    return {
        f"K_{name} at {p + 1}": float(K[p][place])
        for p in range(len(K))
        for name, place in zip(ELEMENTS, places, strict=True)
    }


def _predicted(found: Any) -> dict[str, tuple[float, float, float]]:
    half = student.ppf(0.975, found.dof) * np.sqrt(
        np.diagonal(found.stiffness_covariance, axis1=1, axis2=2)
    )
    numbers = {}
    for p, (values, halves) in enumerate(zip(found.stiffness, half, strict=True)):
        for name, v, h in zip(ELEMENTS, values, halves, strict=True):
            numbers[f"K_{name} at {p + 1}"] = (float(v), float(v - h), float(v + h))
    return numbers


def muscles(how: Muscles | None = None) -> Callable[[Sequence[int]], list[Made]]:
    """Rows of these muscles."""
    whose = how or Muscles()
    return lambda indices: [whose.record(i) for i in indices]


def ask_activation(made: Made) -> Answer:
    """K predicted at activations that were not measured, and each muscle's own."""
    model = fit_activation(made.record, curvature=False)
    summary, numbers = model.summary, _predicted(model.predict(made.beside))
    # as FIT.json prints them: single muscles have a covariance of their own
    half = student.ppf(0.975, model.dof) * np.sqrt(np.diag(model.muscle_covariance))
    for i, arms in enumerate(moment_arms()):
        value, h = (float(x * arms @ arms) for x in (model.stiffness[3 + i], half[i]))
        numbers[f"muscle {i + 1}"] = (value, value - h, value + h)
    return Answer(numbers, **said(summary.checks, summary.warnings))


POSTURES = np.stack(
    np.meshgrid(np.linspace(0.5, 1.6, 6), np.linspace(0.9, 2.1, 5), indexing="ij"), axis=-1
).reshape(-1, 2)
ELSEWHERE = np.array([[0.9, 1.3], [1.2, 1.7]])


def over_posture(q: np.ndarray, ripple: float = 0.0) -> np.ndarray:
    """K over posture: moment arms linear in the angles; a ripple no polynomial follows."""
    s, e = (q - [1.05, 1.5]).T
    one, two = 1 + 0.3 * s, 1 - 0.4 * e + ripple * np.sin(6 * e)
    arms = np.stack(
        [np.stack([one, 0 * s], 1), np.stack([0 * s, two], 1), np.stack([one, two], 1)], axis=1
    )
    return np.asarray(np.einsum("m,pmi,pmj->pij", [14.0, 12.0, 6.0], arms, arms))


@dataclass(frozen=True)
class Postures:
    """Thirty postures of our own arm.

    Attributes
    ----------
    ripple : float
    cocontraction : float
        Sd of the factor of K from posture to posture: the person is not equally relaxed.
    outlier : float
    sd_told : float
        Factor of the standard errors that are told.
    """

    ripple: float = 0.0
    cocontraction: float = 0.0
    outlier: float = 1.0
    sd_told: float = 1.0

    def record(self, index: int) -> Made:
        """Rows, and K at two postures between the measured ones."""
        rng = seeds_of("postures", index)
        K = over_posture(POSTURES, self.ripple)
        factor = 1 + self.cocontraction * rng.standard_normal(len(K))
        K = K * factor[:, None, None]
        K[7] *= self.outlier
        B = 0.08 * K
        K = K + matrix(SD_K * rng.standard_normal((len(K), 3)))
        B = B + matrix(SD_B * rng.standard_normal((len(B), 3)))
        rows = JointRows(
            joint_angles=POSTURES,
            stiffness=K,
            viscosity=B,
            stiffness_sd=np.full(K.shape, SD_K * self.sd_told),
            viscosity_sd=np.full(B.shape, SD_B * self.sd_told),
        )
        return Made(rows, _elements(over_posture(ELSEWHERE, self.ripple)))


def postures(how: Postures | None = None) -> Callable[[Sequence[int]], list[Made]]:
    """Rows of these postures."""
    whose = how or Postures()
    return lambda indices: [whose.record(i) for i in indices]


def ask_posture(made: Made) -> Answer:
    """K predicted between the measured postures."""
    model = fit_posture(made.record, order=1)
    summary = model.summary
    return Answer(_predicted(model.predict(ELSEWHERE)), **said(summary.checks, summary.warnings))


def scaled(factor: float) -> Callable[[Any, Any], Any]:
    """Rows in another unit."""
    return lambda rows, _rng: replace(
        rows,
        stiffness=factor * rows.stiffness,
        viscosity=factor * rows.viscosity,
        stiffness_sd=factor * rows.stiffness_sd,
        viscosity_sd=factor * rows.viscosity_sd,
    )


def weaker_electrode(rows: JointRows, _rng: np.random.Generator) -> JointRows:
    """The first muscle's activation halves in the second half of the conditions."""
    alpha = np.array(rows.activation)
    alpha[len(alpha) // 2 :, 0] *= 0.5
    return replace(rows, activation=alpha)


ACTIVATION = Rig("fit activation", "own muscles", muscles(), ask_activation)
OVER_POSTURE = Rig("fit moment-arms", "own arm", postures(), ask_posture)


def cells() -> list[Cell]:
    """All of these commands'."""
    of_muscles: list[tuple[str, str, tuple[str, ...], Any]] = [
        *(
            ("moment arms of another person", f"{100 * p:g} % (sd)", LACK,
             muscles(Muscles(arms_off=p)))
            for p in (0.1, 0.3)
        ),
        ("stiffness saturates", "half at 30 %", LACK, muscles(Muscles(bent=3.3))),
        *(
            ("crosstalk between muscles", f"{100 * p:g} %", ("crosstalk", *LACK),
             muscles(Muscles(crosstalk=p)))
            for p in (0.1, 0.3)
        ),
        ("errors of the activations, not told", "20 %", ("activations", *LACK),
         muscles(Muscles(alpha_off=0.2))),
        ("one condition is wrong", "K three times", ("outlier", *LACK),
         muscles(Muscles(outlier=3.0))),
        ("one electrode from the middle on", "half its gain", ("session",),
         damaged(ACTIVATION, on_record(weaker_electrode))),
        ("K in mNm", "x 1000", UNITS, damaged(ACTIVATION, on_record(scaled(1000.0)))),
    ]  # fmt: skip
    of_postures: list[tuple[str, str, tuple[str, ...], Any]] = [
        ("moment arms are no polynomial", "ripple 30 %", ("lack of fit",),
         postures(Postures(ripple=0.3))),
        ("not equally relaxed everywhere", "20 % (sd)", ("scatter",),
         postures(Postures(cocontraction=0.2))),
        ("one posture is wrong", "K three times", ("scatter",),
         postures(Postures(outlier=3.0))),
        ("standard errors told", "a fifth", ("scatter",),
         postures(Postures(sd_told=0.2))),
        ("K in mNm", "x 1000", UNITS, damaged(OVER_POSTURE, on_record(scaled(1000.0)))),
    ]  # fmt: skip
    return [
        *(Cell(ACTIVATION, *one) for one in of_muscles),
        *(Cell(OVER_POSTURE, *one) for one in of_postures),
    ]


CLEAN = (ACTIVATION, OVER_POSTURE)
