"""Whether a planned calibration of the live stiffness keeps its promise.

    python benchmarks/live/plan.py planar held [--persons 20] [--first 0] [--error 12 8 6]

Simulated persons: moment arms that differ from the anatomical arm's as the prior says (20 % a
correction), stiffness of each muscle half to double a typical one. Each is calibrated at the
planned conditions (standard errors of K and B 6 %, activations known to 10 %), `fit muscles` makes
the model, and `Live` is asked at 40 places anywhere in the workspace, activations again with
errors of 10 %. Foretold is the root of the mean squared relative error of K (Frobenius norm);
measured is the same over places and persons. One person calibrated many times gives the spread.
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import argparse
import tempfile
from pathlib import Path

import numpy as np

from armimpedance.core.errors import EstimationError
from armimpedance.core.records import Recording, Subject
from armimpedance.hand.levels import arm_of_whose
from armimpedance.limb.arm import MuscularArm, arm_named
from armimpedance.muscles.live import (
    CalibrationPlan,
    CalibrationWish,
    Live,
    Workspace,
    holdable,
    plan_calibration,
)
from armimpedance.muscles.models import (
    JointRows,
    TypicalMuscles,
    fit_muscle_model,
    kept_elements,
    matrix,
    typical_muscles,
)
from manipulandum_sim.space import simulate_space, write_moment_arms

NOISE, OF_ACTIVATION, PLACES = 0.06, 0.1, 40
MIDDLE, HALF = np.array([-0.8, 0.9, 0.75, 1.4]), np.array([0.35, 0.3, 0.3, 0.4])


def case(name: str) -> tuple[MuscularArm, Subject | Recording, Workspace, tuple[int, ...]]:
    """Muscles, whose arm, where, and which joints move."""
    if name == "planar":
        box = np.radians([[20.0, 80.0], [60.0, 120.0]])
        return arm_named("planar6"), Subject(height_m=1.7, mass_kg=65.0), Workspace(box), (0, 1)
    with tempfile.TemporaryDirectory() as folder:
        write_moment_arms(Path(folder) / "arms.csv", seed=1)
        muscles = arm_named(Path(folder) / "arms.csv")
    session, _ = simulate_space(seed=1, sets=1, directions=6)
    box = np.stack([MIDDLE - HALF, MIDDLE + HALF], axis=1)
    return muscles, session, Workspace(box, (0.03, 0.15), 4.0), (0, 1, 3)


def person_of(typical: TypicalMuscles, rng: np.random.Generator) -> np.ndarray:
    """Parameters of a person."""
    x, layout = typical.values.copy(), typical.equations.layout
    x[layout.z] = rng.normal(size=layout.corrections)
    m = layout.muscles
    for own in (layout.f, layout.b):
        x[own] *= np.repeat(np.exp(0.35 * rng.normal(size=m)), layout.order + 1)
    return x


def rows_of(
    typical: TypicalMuscles,
    plan: CalibrationPlan,
    x: np.ndarray,
    moving: tuple[int, ...],
    rng: np.random.Generator,
) -> JointRows:
    """What the calibration measures."""
    at = plan.conditions
    form, kept = typical.equations.at(at.joint_angles, at.activation), None
    kept = kept_elements(form.equations.layout.joints, moving)
    known = {}
    for name, value in (("stiffness", form.stiffness(x)[0]), ("viscosity", form.viscosity(x)[0])):
        A = matrix(value[:, kept])
        size = np.sqrt(np.abs(np.einsum("pii->pi", A)))
        sd = NOISE * size[:, :, None] * size[:, None, :]
        e = np.triu(rng.normal(size=A.shape))
        known |= {name: A + sd * (e + np.triu(e, 1).swapaxes(1, 2)), f"{name}_sd": sd}
    seen = np.clip(at.activation * (1 + OF_ACTIVATION * rng.normal(size=at.activation.shape)), 0, 1)
    return JointRows(
        at.joint_angles,
        **known,
        activation=seen,
        activation_sd=OF_ACTIVATION * at.activation,
        muscles=typical.equations.lengths.muscles,
        moving=moving,
    )


def study(name: str, error: float, persons: range, repeats: int) -> None:
    """Print foretold and measured error of one plan."""
    muscles, whose, space, moving = case(name)
    wish = CalibrationWish(error_percent=error)
    elbow = None if name == "planar" else "held"
    plan = plan_calibration(muscles, whose, wish, space, elbow=elbow)
    at = plan.conditions
    typical = typical_muscles(muscles, *_candidates(muscles, whose, space), moment_arm_order=1)
    off, inside, spread = [], [], []
    for seed in persons:
        rng = np.random.default_rng([seed, 77])
        x = person_of(typical, rng)
        for again in range(repeats if seed == persons.start else 1):
            rows = rows_of(typical, plan, x, moving, np.random.default_rng([seed, again]))
            try:
                model = fit_muscle_model(rows, muscles, moment_arm_order=1)
            except EstimationError as wrong:
                print("   not fitted:", seed, wrong)
                continue
            one, held = _asked(model, typical, x, whose, space, elbow, seed)
            (spread if again else off).append(one)
            inside.append(held)
    measured = 100 * np.sqrt(np.mean(np.square(off)))
    each = 100 * np.sqrt(np.mean(np.square(off), axis=1))
    repeated = 100 * np.sqrt(np.mean(np.square(spread))) if spread else np.nan
    print(
        f"{name}, wanted {error:g} %: {len(at)} conditions, {plan.minutes:.1f} min, foretold "
        f"{plan.expected_percent[-1]:.1f} %, measured {measured:.1f} % (median person "
        f"{np.median(each):.1f}, worst {each.max():.1f}; {len(off)} persons), bands hold "
        f"{100 * np.mean(inside):.1f} %; first person {len(spread)} times again {repeated:.1f} %",
        flush=True,
    )


def _candidates(
    muscles: MuscularArm, whose: Subject | Recording, space: Workspace
) -> tuple[np.ndarray, ...]:
    arm = arm_of_whose(whose, muscles.paths.joints)
    q, level, force = space.candidates(arm.axes)
    some = np.random.default_rng(0).permutation(len(q))[:700]
    offered = holdable(arm, muscles, q[some], level[some], force[some])
    return offered.joint_angles, offered.activation


def _asked(model, typical, x, whose, space, elbow, seed):  # type: ignore[no-untyped-def]
    """Relative errors (P,), and which elements the bands hold (P, E)."""
    rng = np.random.default_rng([seed, 5])
    live = Live(model, whose, elbow=elbow)
    at = holdable(live.arm, anatomy(typical), *space.places(live.arm.axes, rng, PLACES))
    form = typical.equations.at(at.joint_angles, at.activation)
    K_j = form.stiffness(x)[0]
    off, held = [], []
    r = list(live.moving)
    for p in range(len(at)):
        q, F, alpha = at.joint_angles[p], at.force[p], at.activation[p]
        bend = np.tensordot(F, live.arm.jacobian_derivative(q), 1) + live.arm.gravity_gradient(q)
        K = (matrix(K_j[p]) + bend)[np.ix_(r, r)]
        V = np.linalg.inv(live.arm.jacobian(q)[:, r])
        true = V.T @ K @ V
        seen = np.clip(alpha * (1 + OF_ACTIVATION * rng.normal(size=alpha.shape)), 0, 1)
        now = live.update(seen, q=q, force=F, signal_sd=OF_ACTIVATION * seen)
        off.append(np.linalg.norm(now.stiffness - true) / np.linalg.norm(true))
        i, j = np.triu_indices(len(true))
        held.append(np.abs(now.stiffness - true)[i, j] <= now.half_width())
    return off, np.mean(held)


def anatomy(typical: TypicalMuscles) -> MuscularArm:
    """The anatomical arm, for what activations a person holds a force with."""
    lengths = typical.equations.lengths
    m = len(lengths.muscles)
    paths = lengths.paths(np.zeros(len(lengths.muscle)))
    return MuscularArm("anatomy", paths, np.full(m, 800.0), 75.0, lengths.box, "anatomy")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("case", nargs="+", choices=("planar", "held"))
    parser.add_argument("--persons", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--repeats", type=int, default=11)
    parser.add_argument("--error", type=float, nargs="+", default=[12.0, 8.0, 6.0])
    asked = parser.parse_args()
    for one in asked.case:
        for error in asked.error:
            every = range(asked.first, asked.first + asked.persons)
            study(one, error, every, asked.repeats)
