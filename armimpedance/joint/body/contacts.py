"""What force plates do to a skeleton: as a wrench on its root, and as torques at its joints.

Wrenches are by each plate on the body, in the world's frame, about the plate's origin. Moved to
the root they add up, whoever stands on which plate: ``sum_k K_k^T F_k``. A joint feels only the
plates beyond it, so that its row has to be told which segment stands on which plate.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import pinocchio as pin

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import InputError
from armimpedance.core.motion import MotionRecording
from armimpedance.core.skeleton import Skeleton
from armimpedance.joint.body.regressor import root_rotation

#: A plate that bears less than this is not stood upon, N.
LEAST_LOAD_N: Final = 20.0
#: The next segment must be this much farther from the centre of pressure.
_CLEARLY: Final = 1.5


def about_world_origin(wrenches: FloatArray, plate_origins_m: FloatArray) -> FloatArray:
    """Wrenches (S, K, 6) with the moments about the world's origin instead of the plates'."""
    moved = np.array(wrenches)
    moved[..., 3:] += np.cross(plate_origins_m, wrenches[..., :3])
    return moved


def wrench_on_root(world: FloatArray, q: FloatArray) -> FloatArray:
    """Wrench (S, 6) about the root's origin in the root's frame, from wrenches (S, K, 6).

    ``sum_k K_k^T F_k``: the transpose of the motion's transformation carries wrenches.
    """
    total = world.sum(axis=1)
    moment = total[:, 3:] - np.cross(q[:, :3], total[:, :3])
    pair = np.stack([total[:, :3], moment], axis=1)
    # [f; n] (2, 3) in the root's frame = [f; n] R (3, 3)
    return (pair @ root_rotation(q)).reshape(len(q), 6)


def contact_torques(
    model: Any, skeleton: Skeleton, world: FloatArray, q: FloatArray, standing: Sequence[str]
) -> FloatArray:
    """Generalised forces ``sum_k J_k^T F_k`` (S, n) of wrenches (S, K, 6) about the world's origin.

    Parameters
    ----------
    standing : K names
        The segment that stands on each plate.
    """
    data, result = model.createData(), np.zeros(q.shape)
    felt = np.array([_carriers(skeleton, name) for name in standing], dtype=float)
    for i in range(len(q)):
        # tau (n,) = J^T (n, 6) F (6,), both about the world's origin
        J = pin.computeJointJacobians(model, data, q[i])
        result[i] = ((world[i] @ J) * felt).sum(axis=0)
    return result


def _carriers(skeleton: Skeleton, segment: str) -> list[bool]:
    """Which coordinates (n,) move this segment."""
    above: set[str] = set()
    name: str | None = segment
    while name is not None:
        above.add(name)
        name = skeleton.segments[skeleton.index(name)].parent
    hinges = [s.name in above for s in skeleton.segments for _ in s.hinges]
    return [True] * len(skeleton.root_coordinates) + hinges


def standing_segments(
    recording: MotionRecording, model: Any, samples: slice, world: FloatArray
) -> tuple[str, ...]:
    """The segment at the end of a limb that is nearest to each plate's centre of pressure.

    Judged over the samples of a trial in which the plate bears a load.

    Raises
    ------
    InputError
        Two segments are about equally near: it has to be told.
    """
    skeleton = recording.skeleton
    parents = {s.parent for s in skeleton.segments}
    ends = [s.name for s in skeleton.segments if s.name not in parents]
    q = recording.coordinates[samples]
    places = _segment_origins(model, q, np.array([model.getJointId(n) for n in ends]))
    standing = []
    for k in range(world.shape[1]):
        loaded = world[:, k, 2] > LEAST_LOAD_N
        if not loaded.any():
            standing.append(ends[0])
            continue
        f = world[loaded, k]
        cop = np.stack([-f[:, 4] / f[:, 2], f[:, 3] / f[:, 2]], axis=1)
        away = np.linalg.norm(places[loaded, :, :2] - cop[:, None], axis=2)
        lowest = np.abs(places[loaded, :, 2])
        total = np.hypot(away, lowest).mean(axis=0)
        first, *others = np.argsort(total)
        if others and total[others[0]] < _CLEARLY * total[first]:
            raise InputError(
                f"plate {k + 1}: {ends[first]} and {ends[others[0]]} are about equally near",
                expected="to be told which segment stands on each plate",
            )
        standing.append(ends[first])
    return tuple(standing)


def _segment_origins(model: Any, q: FloatArray, joints: IntArray) -> FloatArray:
    """World positions (S, J, 3) of joints."""
    data, places = model.createData(), np.empty((len(q), len(joints), 3))
    for i in range(len(q)):
        pin.forwardKinematics(model, data, q[i])
        for at, joint in enumerate(joints):
            places[i, at] = data.oMi[int(joint)].translation
    return places
