"""Base parameters of a body and of a robot: ours and FIGAROH's, the same data, in one run.

Both sides get the same motion with noise and solve the same plain least squares, once for the
root's wrench of a 15-segment body (FIGAROH: a free-flyer root, mode "external wrench") and once for
the joint torques of a seven-joint robot with friction, motors' inertia and offsets (mode "joint
torques"). Each side runs in a process of its own, in turn, one thread; the seconds are the best of
the repeats, from arrays to predictions. FIGAROH is handed velocities and accelerations; our side
makes its own from the coordinates and moves the plates' wrenches to the root in the time shown.
Memory is the process' peak above what it held before it began.

The two predictions must agree to 1e-9 of the largest measured value, or the exit status is 1.

    (see figaroh_environment.txt)
    PYTHONPATH=. figaroh-env/bin/python benchmarks/body_against_figaroh.py
"""

from __future__ import annotations

import os

for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_threads] = "1"

import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd

from armimpedance.core.motion import MotionRecording
from armimpedance.core.skeleton import Hinge, Segment, Skeleton

SAMPLES, TRIALS, RATE = 12_000, 6, 100.0
REPEATS = 3
AGREE = 1e-9


def body() -> Skeleton:
    """Fifteen segments with the joints of the poster's body, one size for all."""
    tree = [("pelvis", None, 0), ("thorax", "pelvis", 3), ("head", "thorax", 3)]
    for side in ("right", "left"):
        tree += [(f"{side}_upper_arm", "thorax", 3), (f"{side}_forearm", f"{side}_upper_arm", 1)]
        tree += [(f"{side}_hand", f"{side}_forearm", 2), (f"{side}_thigh", "pelvis", 3)]
        tree += [(f"{side}_shank", f"{side}_thigh", 1), (f"{side}_foot", f"{side}_shank", 2)]
    return skeleton(tree, floating=True)


def robot() -> Skeleton:
    """Seven hinges in a row on a stand."""
    names = ["stand", *(f"link{i}" for i in range(1, 8))]
    tree = [("stand", None, 0)] + [(b, a, 1) for a, b in zip(names[:-1], names[1:], strict=True)]
    return skeleton(tree, floating=False)


def skeleton(tree: list[tuple[str, str | None, int]], *, floating: bool) -> Skeleton:
    """Random bones; every segment 4 kg within some 0.1 m."""
    rng = np.random.default_rng(0)
    segments = []
    for i, (name, parent, count) in enumerate(tree):
        axes = np.eye(3)[:count] if count > 1 else np.eye(3)[[i % 3]][:count]
        hinges = tuple(Hinge(f"{name}_{k}", axis) for k, axis in enumerate(axes))
        place = np.zeros(3) if parent is None else rng.normal(0, 0.2, 3)
        inertia = np.diag([0.03, 0.04, 0.05])
        segments.append(Segment(name, parent, place, hinges, 4.0, rng.normal(0, 0.05, 3), inertia))
    return Skeleton(tuple(segments), floating=floating)


def recorded(kind: str) -> MotionRecording:
    """A noisy recording of that skeleton; written down once, read by both sides."""
    from armimpedance.numerics.signals import smoothed_derivatives
    from manipulandum_sim.tree_dynamics import contact_wrench, inverse_dynamics

    of, rng = (body if kind == "body" else robot)(), np.random.default_rng(1)
    n, per = len(of.coordinates), SAMPLES // TRIALS
    t = np.arange(per) / RATE
    parts, left = [], []
    for _ in range(TRIALS):
        f, phase = rng.uniform(0.1, 1.0, (2, 4, n))
        waves = np.sin(2 * np.pi * (f[:, None] * t[:, None] + phase[:, None]))
        q = 0.25 * waves.sum(axis=0)
        motion = smoothed_derivatives(q, RATE, None)
        if kind == "body":
            force = contact_wrench(of, *motion)
        else:
            force = inverse_dynamics(of, *motion) + 0.5 * motion[1] + np.sign(motion[1])
        parts.append(q)
        left.append(force + rng.normal(0, 1.0, force.shape))
    table = pd.DataFrame({"trial": range(TRIALS), "condition": [f"{i}" for i in range(TRIALS)]})
    plates = {"wrenches": np.concatenate(left)[:, None], "plate_origins_m": np.zeros((1, 3))}
    return MotionRecording(
        sample_rate_hz=RATE,
        trials=table,
        offsets=np.arange(TRIALS + 1) * per,
        time_s=np.tile(t, TRIALS),
        coordinates=np.concatenate(parts),
        skeleton=of,
        **(plates if kind == "body" else {"torque": np.concatenate(left)}),
    )


def our_choice(recording: MotionRecording):
    """Rows and columns of either kind."""
    from armimpedance.joint.body import RowChoice

    if recording.skeleton.floating:
        return RowChoice()
    kinds = ("viscosity", "friction", "inertia", "offset")
    return RowChoice.of(recording.skeleton, cutoff_hz=None, terms=kinds)


def ours(recording: MotionRecording) -> dict[str, object]:
    """Equations, base parameters, fit; predictions (N, R) from a second pass over the samples."""
    from armimpedance.joint.body import base_parameters, body_equations, each_trial, fit_base

    choice, start = our_choice(recording), time.perf_counter()
    equations = body_equations(recording, choice)
    p = len(equations.columns)
    base = base_parameters(equations.stacked()[:p, :p], equations.columns, equations.column_units)
    found = fit_base(equations, base, "none")
    phi = base.lift(found.values)
    fitted = time.perf_counter() - start
    predicted = [trial.W @ phi for trial in each_trial(recording, choice)]
    return {
        "rank": base.rank,
        "fit_s": fitted,
        "seconds": time.perf_counter() - start,
        "predicted": np.concatenate(predicted),
    }


def figaroh_inputs(recording: MotionRecording) -> SimpleNamespace:
    """Model, motion and left side as FIGAROH wants them, made outside of its time."""
    import pinocchio as pin

    from armimpedance.joint.body import each_trial
    from armimpedance.limb.arm import skeleton_model
    from armimpedance.numerics.signals import smoothed_derivatives

    ends = zip(recording.offsets[:-1], recording.offsets[1:], strict=True)
    parts = [smoothed_derivatives(recording.coordinates[a:b], RATE, None) for a, b in ends]
    q, v, a = (np.concatenate([part[i] for part in parts]) for i in range(3))
    # rows of the same left side, in its order: all samples of row 1, then of row 2, ...
    tau = np.concatenate([t.w for t in each_trial(recording, our_choice(recording))])
    model = skeleton_model(recording.skeleton)
    if recording.skeleton.floating:
        free = pin.Model()
        free.gravity = model.gravity
        free.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root")
        for i in range(2, model.njoints):
            free.addJoint(
                model.parents[i], model.joints[i], model.jointPlacements[i], model.names[i]
            )
        for i in range(1, model.njoints):
            free.appendBodyToJoint(i, model.inertias[i], pin.SE3.Identity())
        data, n = model.createData(), len(q)
        Q, V, A = np.empty((n, free.nq)), np.empty((n, free.nv)), np.empty((n, free.nv))
        for i in range(n):
            pin.forwardKinematics(model, data, q[i], v[i], a[i])
            Q[i] = np.concatenate([pin.SE3ToXYZQUAT(data.oMi[1]), q[i, 6:]])
            V[i] = np.concatenate([data.v[1].vector, v[i, 6:]])
            A[i] = np.concatenate([data.a[1].vector, a[i, 6:]])
        model, q, v, a = free, Q, V, A
    machine = SimpleNamespace(model=model, data=model.createData())
    return SimpleNamespace(robot=machine, q=q, v=v, a=a, tau=tau.T.ravel(), rows=tau.shape[1])


def figaroh(recording: MotionRecording) -> dict[str, object]:
    """Its regressor, its base parameters, its least squares, its prediction ``W_b phi_b``."""
    from figaroh.tools.qrdecomposition import QRDecomposer
    from figaroh.tools.regressor import (
        build_regressor_basic,
        build_regressor_reduced,
        get_index_eliminate,
    )

    given = figaroh_inputs(recording)
    before, start = peak_mb(), time.perf_counter()
    wrench = recording.skeleton.floating
    config = {
        "has_friction": not wrench,
        "has_actuator_inertia": not wrench,
        "has_joint_offset": not wrench,
        "is_joint_torques": not wrench,
        "is_external_wrench": wrench,
        "force_torque": ["Fx", "Fy", "Fz", "Mx", "My", "Mz"],
        "act_idxv": [] if wrench else list(range(given.robot.model.nv)),
    }
    W = build_regressor_basic(given.robot, given.q, given.v, given.a, config)
    names = {f"p{j:03d}": 0.0 for j in range(W.shape[1])}
    gone, left = get_index_eliminate(W, names)
    found = QRDecomposer().decompose(
        build_regressor_reduced(W, gone), left, tau=given.tau, method="pivoting"
    )
    fitted = time.perf_counter() - start
    predicted = found.W_b @ found.phi_b
    return {
        "rank": found.rank,
        "fit_s": fitted,
        "seconds": time.perf_counter() - start,
        "predicted": predicted.reshape(given.rows, -1).T,
        "before_mb": before,
    }


def peak_mb() -> float:
    """The process' largest memory so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def one_side(side: str, kind: str, folder: Path) -> None:
    """The child process: run one side, leave its prediction in a file and its figures on stdout."""
    recording = recorded(kind)
    if side == "ours":
        our_choice(recording)
        import armimpedance.joint.body.estimate  # noqa: F401
    before = peak_mb()
    result = (ours if side == "ours" else figaroh)(recording)
    before = float(result.pop("before_mb", before))  # type: ignore[arg-type]
    np.save(folder / f"{side}_{kind}.npy", result.pop("predicted"))
    print(json.dumps({**result, "peak_mb": peak_mb() - before}))


def run(side: str, kind: str, folder: Path) -> dict[str, float]:
    """One child, its figures."""
    command = [sys.executable, __file__, side, kind, str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def main() -> int:
    """Both kinds, both sides in turn."""
    failed = False
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for kind in ("body", "robot"):
            runs: dict[str, list[dict[str, float]]] = {"ours": [], "figaroh": []}
            for _ in range(REPEATS):
                for side, found in runs.items():
                    found.append(run(side, kind, folder))
            best = {s: {k: min(r[k] for r in found) for k in found[0]} for s, found in runs.items()}
            a, b = (np.load(folder / f"{side}_{kind}.npy") for side in runs)
            apart = float(np.abs(a - b).max() / np.abs(a).max())
            failed |= not apart <= AGREE
            print(f"{kind}: {SAMPLES} samples, predictions apart {apart:.1e} (asked {AGREE:g})")
            for side, figures in best.items():
                print(
                    f"  {side:8s} rank {figures['rank']:.0f}  fit {figures['fit_s']:.2f} s  "
                    f"with predictions {figures['seconds']:.2f} s  peak {figures['peak_mb']:.0f} MB"
                )
            ours_, theirs = best["ours"], best["figaroh"]
            ratios = {k: ours_[k] / theirs[k] for k in ("fit_s", "seconds", "peak_mb")}
            print("  ours / FIGAROH: " + ", ".join(f"{k} {v:.2f}" for k, v in ratios.items()))
    return int(failed)


if __name__ == "__main__":
    if len(sys.argv) == 4:
        one_side(sys.argv[1], sys.argv[2], Path(sys.argv[3]))
    else:
        sys.exit(main())
