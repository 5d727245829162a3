"""Make the paths of the arm "myoarm7": polynomials fitted to MyoSuite's moment arms.

    python benchmarks/space/myoarm_paths.py armimpedance/limb/arm/muscles/myoarm.csv  # extra
    "plant"

MyoSuite's arm (package `myo-sim`, Apache 2.0, from the MoBL arm of Saul et al. 2015 and Holzbaur et
al. 2005) is asked for the moment arms of 32 muscles at 3,000 postures in front of the body; lengths
of the third order are fitted to them, and 1,000 other postures say how far their arms are off.
Angles are those of `limb.arm.SpatialArm`: the model's plane of elevation is a quarter turn
and our turn, and its rotation of the humerus is our turn and our axial angle.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import myo_sim
import numpy as np

from armimpedance.limb.arm import arm_named, fit_paths

JOINTS = (
    *("elv_angle_r", "shoulder_elv_r", "shoulder_rot_r", "elbow_flexion_r"),
    *("pro_sup_r", "deviation_r", "flexion_r"),
)
MUSCLES = (
    *("DELT1", "DELT2", "DELT3", "SUPSP", "INFSP", "SUBSC", "TMIN", "TMAJ"),
    *("PECM1", "PECM2", "PECM3", "LAT1", "LAT2", "LAT3", "CORB"),
    *("TRIlong", "TRIlat", "TRImed", "ANC", "BIClong", "BICshort", "BRA", "BRD"),
    *("SUP", "PT", "PQ", "ECRL", "ECRB", "ECU", "FCR", "FCU", "PL"),
)
#: Angles that are asked for, rad.
RANGE = arm_named("myoarm7").angle_range
#: Rotation of the humerus that is asked for, rad.
ROTATION = (-1.0, 1.0)
#: A muscle spans a joint about which its moment arm is more than this (rms), m.
SPANS = 2e-4
#: Coefficients below this move no arm in the box by a micrometre, m.
NEGLIGIBLE = 1e-7
#: Angles that are scaled to -1 and 1: none are.
RADIANS = np.tile([-1.0, 1.0], (7, 1))
CREDIT = """\
# Muscle lengths as polynomials of the angles of an arm in space, m, up to a constant.
# Fitted by benchmarks/space/myoarm_paths.py to the moment arms of MyoSuite's right arm.
# Source: myo-sim {version} (myoarm_r), The MyoSuite Authors, Apache License 2.0; geometry after
# Saul et al. 2015 (Comput Methods Biomech Biomed Engin 18:1445) and Holzbaur et al. 2005.
# Powers are those of the angles in rad.
"""


class Model:
    """MyoSuite's arm, whose girdle follows the upper arm, in our angles."""

    def __init__(self) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self._model: Any = myo_sim.load_model("myoarm_r")
        m = self._model
        self._data: Any = mujoco.MjData(m)
        places = [m.joint(name).qposadr[0] for name in JOINTS]
        self._coupling = np.zeros((m.nv, len(JOINTS)))
        self._coupling[places, range(len(JOINTS))] = 1.0
        for first, second, data in zip(m.eq_obj1id, m.eq_obj2id, m.eq_data, strict=True):
            follows, leads = m.joint(first).qposadr[0], m.joint(second).qposadr[0]
            self._coupling[follows, places.index(leads)] = data[1]
        # theirs (7,) = turned (7, 7) ours (7,) + a quarter turn
        self._turned = np.eye(len(JOINTS))
        self._turned[2, 0] = 1.0
        self._active = [m.actuator(name).id for name in MUSCLES]

    def moment_arms(self, q: np.ndarray) -> np.ndarray:
        """dL/dq (32, 7), m."""
        m, d = self._model, self._data
        d.qpos[:] = self._coupling @ (self._turned @ q + np.pi / 2 * np.eye(len(JOINTS))[0])
        mujoco.mj_fwdPosition(m, d)
        mujoco.mj_fwdVelocity(m, d)
        dense = np.zeros((m.nu, m.nv))
        where = (d.moment_rownnz, d.moment_rowadr, d.moment_colind)
        mujoco.mju_sparse2dense(dense, d.actuator_moment, *where)
        return (dense @ self._coupling @ self._turned)[self._active]

    def strength(self) -> tuple[np.ndarray, np.ndarray]:
        """Greatest tensions (N) and fibre lengths (m)."""
        m = self._model
        reach, relaxed = m.actuator_lengthrange, m.actuator_gainprm
        fibre = (reach[:, 1] - reach[:, 0]) / (relaxed[:, 1] - relaxed[:, 0])
        return relaxed[self._active, 2], fibre[self._active]


def postures(rng: np.random.Generator, count: int) -> np.ndarray:
    """Angles (count, 7) in the range, with the humerus' rotation in its own."""
    found = np.empty((0, len(JOINTS)))
    low, high = RANGE.T
    while len(found) < count:
        drawn = rng.uniform(low, high, (count, len(JOINTS)))
        turned = drawn[:, 0] + drawn[:, 2]
        found = np.vstack([found, drawn[(turned > ROTATION[0]) & (turned < ROTATION[1])]])
    return found[:count]


def lines(model: Model) -> Iterator[str]:
    """The table, and on standard error how far its arms are off."""
    rng = np.random.default_rng(0)
    q, others = postures(rng, 3000), postures(rng, 1000)
    G = np.array([model.moment_arms(one) for one in q])
    spans = np.sqrt(np.mean(G**2, axis=0)) > SPANS
    paths = fit_paths(MUSCLES, q, G, 2, spans, box=RADIANS).paths
    true = np.array([model.moment_arms(one) for one in others])
    off = np.sqrt(np.mean((paths.moment_arms(others) - true) ** 2, axis=0))
    for muscle, row, size in zip(MUSCLES, off, np.sqrt(np.mean(true**2, axis=0)), strict=True):
        told = ", ".join(
            f"{1e3 * a:.1f} of {1e3 * b:.1f}" for a, b in zip(row, size, strict=True) if b > SPANS
        )
        print(f"{muscle}: arms off by {told} mm (rms)", file=sys.stderr)
    whole = np.sqrt((off**2)[spans].mean()), np.sqrt(np.mean(true**2, axis=0)[spans].mean())
    print(f"all: {1e3 * whole[0]:.2f} of {1e3 * whole[1]:.2f} mm", file=sys.stderr)
    strongest, fibre = model.strength()
    yield ",".join(["muscle", *(f"q_{j}_power" for j in range(1, 8)), "length_m"]) + (
        ",max_tension_N,fibre_m\n"
    )
    for i, muscle in enumerate(MUSCLES):
        for powers, value in zip(paths.exponents, paths.coefficients[i], strict=True):
            if abs(value) > NEGLIGIBLE:
                numbers = f"{value:.6g},{strongest[i]:.6g},{fibre[i]:.4g}"
                yield ",".join([muscle, *map(str, powers), numbers]) + "\n"


def main() -> None:
    """Write the table aside, then put it in its place."""
    place = Path(sys.argv[1])
    text = CREDIT.format(version=myo_sim.__version__) + "".join(lines(Model()))
    aside = place.with_suffix(".part")
    aside.write_text(text, encoding="utf-8")
    aside.replace(place)


if __name__ == "__main__":
    main()
