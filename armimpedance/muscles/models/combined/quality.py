"""Quality of the muscle model: its fit by element, and the data's share in each parameter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError
from armimpedance.core.findings import Finding, warnings_of
from armimpedance.core.progress import Steps
from armimpedance.muscles.models.combined.equations import EvaluatedEquations, MuscleEquations
from armimpedance.muscles.models.combined.solver import Measured, MusclePosterior, Prior, minimised
from armimpedance.muscles.models.fitted_model import (
    ElementQuality,
    correlation,
    element_quality,
    explained,
)
from armimpedance.muscles.models.packed import order_of
from armimpedance.muscles.models.rows import element_labels
from armimpedance.numerics.regression import FitSummary, Parameters

#: Each shuffle is a search of its own.
_SHUFFLES = 5
#: A parameter whose sd the data did not narrow below this part of the prior's is the prior's.
_PRIOR_ONLY = 0.9
#: So many of them are named.
_NAMED = 10


def shuffles(joints: int) -> int:
    """Searches behind the null R: some, or one where each of them takes long."""
    return _SHUFFLES if joints == 2 else 1


def muscle_quality(
    form: EvaluatedEquations,
    measured: Measured,
    prior: Prior,
    posterior: MusclePosterior,
    seed: int,
    steps: Steps,
) -> tuple[ElementQuality, ...]:
    """Quality of the packed elements of K and B, in the plane ss, se, ee.

    Left-out rows are predicted by one Newton step from the fit without them, bounds left out of
    account; the null R is the mean over a few searches with shuffled rows, weighted as scattered.
    """
    null = _null(form, measured, prior, posterior, seed, steps)
    held_out = _left_out(measured, posterior)
    quality: list[ElementQuality] = []
    elements = measured.stiffness.shape[1] + measured.viscosity.shape[1]
    for which, data, out in zip(
        "KB", (measured.stiffness, measured.viscosity), held_out, strict=True
    ):
        fit = measured.fitted(form, posterior.x, which)[0]
        symbol = "K_e" if which == "K" and measured.hand is not None else which
        labels = np.array(element_labels(form.equations.layout.joints))[measured.kept].tolist()
        if measured.hand is not None:
            labels = element_labels(order_of(data.shape[1]))
        for e, element in enumerate(labels if data.shape[1] else ()):
            quality.append(
                element_quality(
                    f"{symbol}_{element}",
                    data[:, e],
                    fit[:, e],
                    held_out=out[:, e],
                    null_r=float(null[len(quality)]),
                    coefficients=posterior.spent / elements,
                )
            )
    return tuple(quality)


def _left_out(measured: Measured, posterior: MusclePosterior) -> tuple[FloatArray, FloatArray]:
    """Predictions (P, E) of K and B without the own row."""
    C = posterior.covariance
    predicted = []
    P = len(measured.stiffness)
    own = np.concatenate(
        [
            np.arange(block.start, block.stop).reshape(P, -1)
            for block in posterior.blocks
            if block.stop > block.start
        ],
        axis=1,
    )
    J, error = posterior.jacobian[own], posterior.error[own]
    # errors without the own row: (1 - H_p)^-1 e_p with H_p = J_p C J_p^T
    H = J @ C @ J.transpose(0, 2, 1)
    without = np.linalg.solve(np.eye(H.shape[1]) - H, error[..., None])[..., 0]
    step = np.einsum("pij,pj->pi", H, without)
    start = 0
    for k, data in enumerate((measured.stiffness, measured.viscosity)):
        mine = slice(start, start + data.shape[1])
        start = mine.stop
        # weighted errors back to the element's unit
        plain = np.linalg.inv(posterior.weights[k])
        moved = np.einsum("pij,pj->pi", plain, error[:, mine] + step[:, mine])
        predicted.append(data + moved)
    return predicted[0], predicted[1]


def _null(
    form: EvaluatedEquations,
    measured: Measured,
    prior: Prior,
    posterior: MusclePosterior,
    seed: int,
    steps: Steps,
) -> FloatArray:
    rng = np.random.default_rng(seed)
    rs = []
    elements = measured.stiffness.shape[1] + measured.viscosity.shape[1]
    weights = _as_scattered(measured, posterior)
    for _ in range(shuffles(form.equations.layout.joints)):
        order = rng.permutation(len(measured.stiffness))
        shuffled = replace(
            measured,
            stiffness=measured.stiffness[order],
            viscosity=measured.viscosity[order],
            torque=None if measured.torque is None else measured.torque[order],
        )
        try:
            again = minimised(form, shuffled, prior, weights, posterior.x)
        except EstimationError:
            # a search among noise may wander; the fit itself has arrived
            steps.step()
            continue
        fits = np.hstack([measured.fitted(form, again, which)[0] for which in "KB"])
        data = np.hstack([shuffled.stiffness, shuffled.viscosity])
        rs.append([correlation(data[:, e], fits[:, e]) for e in range(data.shape[1])])
        steps.step()
    return np.asarray(np.mean(rs, axis=0) if rs else np.full(elements, np.nan))


def _as_scattered(measured: Measured, posterior: MusclePosterior) -> tuple[FloatArray, ...]:
    """Weights with which shuffled rows have errors of unit variance about their mean."""
    blocks = [measured.stiffness, measured.viscosity]
    if measured.torque is not None:
        blocks.append(measured.torque)
    weights = []
    for data, weight in zip(blocks, posterior.weights, strict=True):
        scatter = np.einsum("pij,pj->pi", weight, data - data.mean(axis=0))
        weights.append(weight / max(np.linalg.norm(scatter) / np.sqrt(max(scatter.size, 1)), 1.0))
    return tuple(weights)


def muscle_summary(
    form: EvaluatedEquations,
    measured: Measured,
    prior: Prior,
    posterior: MusclePosterior,
    checks: tuple[Finding, ...],
) -> FitSummary:
    """Parameters with their standard errors, and warnings of those that the data do not tell."""
    names, units = parameter_names(form.equations)
    n = len(posterior.x)
    layout = form.equations.layout
    torques = layout.tau_p.stop - layout.tau_p.start
    names = (*names, *_torque_names(form))[:n]
    units = (*units, *("N m",) * torques, *("1",) * layout.muscles)[:n]
    sd = np.sqrt(np.diag(posterior.covariance))
    dof = float(max(len(posterior.error) - posterior.spent, 1.0))
    parameters = tuple(Parameters(names, units, posterior.x, posterior.covariance, dof=dof))
    scaled = posterior.jacobian * prior.sd
    s = np.linalg.svd(scaled / np.maximum(np.linalg.norm(scaled, axis=0), 1e-300))[1]
    raw = np.linalg.svd(posterior.jacobian)[1]
    r2, vaf = explained(measured.stiffness, measured.fitted(form, posterior.x, "K")[0])
    return FitSummary(
        method=f"muscles over posture and activation, order {form.equations.order}",
        n=len(posterior.error),
        cond_raw=float(raw[0] / max(raw[-1], 1e-300)),
        cond_scaled=float(s[0] / max(s[-1], 1e-300)),
        rank=int((s > 1e-3 * s[0]).sum()),
        r2=r2,
        vaf=vaf,
        parameters=parameters,
        warnings=(*_warnings(names, sd / prior.sd, posterior), *warnings_of(checks)),
        checks=checks,
    )


def _warnings(
    names: tuple[str, ...], narrowed: FloatArray, posterior: MusclePosterior
) -> tuple[str, ...]:
    untold = [n for n, part in zip(names, narrowed, strict=True) if part > _PRIOR_ONLY]
    spent = f"the rows settle {posterior.spent:.0f}; the prior the rest"
    warnings = [f"{len(names)} parameters, of which {spent}"]
    if untold:
        more = len(untold) - _NAMED
        tail = [f"and {more} more"] if more > 0 else []
        warnings.append(f"not told by the rows: {', '.join(untold[:_NAMED] + tail)}")
    return tuple(warnings)


def parameter_names(equations: MuscleEquations) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names and units of the n parameters of K and B."""
    layout, muscles, z = equations.layout, equations.lengths.muscles, equations.lengths.labels
    f = [f"f_{muscle}_{k}" for muscle in muscles for k in range(layout.order + 1)]
    b = [f"b_{muscle}_{k}" for muscle in muscles for k in range(layout.order + 1)]
    joints = "se" if layout.joints == 2 else [str(j + 1) for j in range(layout.joints)]
    K, B = ([f"{symbol}_passive_{joint}" for joint in joints] for symbol in "KB")
    names = (*z, *f, *K, *b, *B)
    units = (
        *("1",) * len(z),
        *("N/m",) * len(f),
        *("N m/rad",) * len(K),
        *("N s/m",) * len(b),
        *("N m s/rad",) * len(B),
    )
    return names, units


def _torque_names(form: EvaluatedEquations) -> tuple[str, ...]:
    n = form.equations.layout.joints
    joints = "se" if n == 2 else [str(j + 1) for j in range(n)]
    passive = [
        f"tau_p_{joint}_{k}" for joint in joints for k in ("0" if n == 2 else "const", *joints)
    ]
    return (*passive, *(f"proportion_{muscle}" for muscle in form.equations.lengths.muscles))
