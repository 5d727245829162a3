"""A plant that shares nothing with ours: MyoSuite's right arm in MuJoCo, four joints, 23 muscles.

Bodies, joints, the shoulder girdle's coupling, muscle paths with their wrapping, maximum tensions,
force over length and weight are MuJoCo's and the model's (package `myo-sim`, Apache 2.0, from the
MoBL arm of Holzbaur et al. 2005). Forearm, wrist and fingers stand still. Two answers of a muscle
to a push are there:

- ``short-range``: an active muscle is stiff in proportion to its tension, 23.4 tensions per fibre
  length (Cui et al. 2008, J Biomech 41:1945), behind a tendon of 37.5 maximum tensions per tendon
  length (Zajac 1989, Crit Rev Biomed Eng 17:359): what small fast pushes meet, as Hu, Murray and
  Perreault (2011, J Neurophysiol 105:1633) found at the hand;
- ``force-length``: nothing but the slopes of MuJoCo's muscle, which are negative on long fibres.

Every stiffness is minus the numerical derivative of the torque or of the hand's force.
"""

from __future__ import annotations

import warnings
from typing import Any

import mujoco
import myo_sim
import numpy as np
from scipy.optimize import lsq_linear

Array = np.ndarray
JOINTS = ("elv_angle_r", "shoulder_elv_r", "shoulder_rot_r", "elbow_flexion_r")
MUSCLES = (
    *("DELT1", "DELT2", "DELT3", "SUPSP", "INFSP", "SUBSC", "TMIN", "TMAJ"),
    *("PECM1", "PECM2", "PECM3", "LAT1", "LAT2", "LAT3", "CORB"),
    *("TRIlong", "TRIlat", "TRImed", "ANC", "BIClong", "BICshort", "BRA", "BRD"),
)
#: Postures in front of the body, at the height of a table to that of the shoulder: rad.
RANGE = np.array([[0.5, 1.4], [0.7, 1.4], [-0.3, 0.6], [0.9, 1.8]])
SHORT_RANGE, TENDON = 23.4, 37.5
_STEP = 1e-4


class MyoArm:
    """The plant, and what a laboratory knows of it without error: its kinematics and its weight."""

    joints, axes = 4, 3

    def __init__(self, answer: str = "short-range") -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self._model: Any = myo_sim.load_model("myoarm_r")
        m = self._model
        m.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        self._data: Any = mujoco.MjData(m)
        self.answer, self.muscles = answer, MUSCLES
        places = [m.joint(name).qposadr[0] for name in JOINTS]
        # the girdle follows the upper arm in proportion: qpos (38,) = coupling (38, 4) q (4,)
        self._coupling = np.zeros((m.nv, 4))
        self._coupling[places, range(4)] = 1.0
        for first, second, data in zip(m.eq_obj1id, m.eq_obj2id, m.eq_data, strict=True):
            follows, leads = m.joint(first).qposadr[0], m.joint(second).qposadr[0]
            self._coupling[follows, places.index(leads)] = data[1]
        self._active = np.array([m.actuator(name).id for name in MUSCLES])
        self._hand = m.site("S_grasp_r").id
        # the humeral head of the neutral arm is where places are counted from
        self._shoulder = np.zeros(3)
        self._go(np.zeros(4))
        self._shoulder = self._data.xpos[m.body("humerus_r").id].copy()
        reach = m.actuator_lengthrange
        relaxed = m.actuator_gainprm[:, :2]
        self.fibre = (reach[:, 1] - reach[:, 0]) / (relaxed[:, 1] - relaxed[:, 0])
        self.tendon = np.maximum(reach[:, 0] - relaxed[:, 0] * self.fibre, 1e-3)
        self.strongest = m.actuator_gainprm[:, 2].copy()
        self.strongest_of_muscles = self.strongest[self._active]
        self.fibre_of_muscles = self.fibre[self._active]

    def _go(self, q: Array) -> None:
        self._data.qpos[:] = self._coupling @ np.asarray(q, dtype=float)
        self._data.qvel[:] = 0.0
        mujoco.mj_fwdPosition(self._model, self._data)
        mujoco.mj_fwdVelocity(self._model, self._data)

    def _arms(self) -> Array:
        """dL/dq (63, 4) where the arm stands."""
        m, d = self._model, self._data
        dense = np.zeros((m.nu, m.nv))
        where = (d.moment_rownnz, d.moment_rowadr, d.moment_colind)
        mujoco.mju_sparse2dense(dense, d.actuator_moment, *where)
        return dense @ self._coupling

    def _tensions(self, alpha: Array) -> Array:
        """Tension (63,) of every muscle where the arm stands, N."""
        self._data.act[:] = 0.0
        self._data.act[self._active] = alpha
        mujoco.mj_fwdActuation(self._model, self._data)
        return -self._data.actuator_force.copy()

    def moment_arms(self, q: Array) -> Array:
        """dL/dq of the muscles (23, 4), m."""
        self._go(q)
        return self._arms()[self._active]

    def tensions(self, q: Array, alpha: Array) -> Array:
        """Of the muscles (23,), N."""
        self._go(q)
        return self._tensions(alpha)[self._active]

    def weight(self, q: Array) -> Array:
        """Torque (4,) that holds the arm up, N m."""
        self._go(q)
        return self._coupling.T @ self._data.qfrc_bias

    def torque(self, q: Array, alpha: Array, around: Array | None = None) -> Array:
        """Torque (4,) of all muscles at q; pushed there from `around`, if that is told."""
        if around is None or self.answer == "force-length":
            self._go(q)
            tension = self._tensions(alpha)
            return -self._arms().T @ tension
        self._go(around)
        relaxed, before = self._tensions(np.zeros(len(alpha))), self._data.actuator_length.copy()
        active = self._tensions(alpha) - relaxed
        short = SHORT_RANGE * active / self.fibre
        tendon = TENDON * self.strongest / self.tendon
        k = short * tendon / (short + tendon)
        self._go(q)
        pulled = active + k * (self._data.actuator_length - before)
        return -self._arms().T @ (self._tensions(np.zeros(len(alpha))) + pulled)

    def joint_stiffness(self, q: Array, alpha: Array) -> Array:
        """``-d(torque of the muscles)/dq`` (4, 4), N m/rad."""
        return -_derivative(lambda x: self.torque(x, alpha, around=q), q)

    def joint_viscosity(self, q: Array, alpha: Array) -> Array:
        """``-d(torque)/d(velocity)`` (4, 4) of muscles and of the model's joints, N m s/rad."""

        def torque(velocity: Array) -> Array:
            self._go(q)
            self._data.qvel[:] = self._coupling @ velocity
            mujoco.mj_fwdVelocity(self._model, self._data)
            passive = self._coupling.T @ self._data.qfrc_passive
            return passive - self._arms().T @ self._tensions(alpha)

        return -_derivative(torque, np.zeros(4), 1e-3)

    # what the analysis asks an arm for

    def hand_position(self, q: Array) -> Array:
        """Hand from the shoulder of the neutral arm (3,), m."""
        self._go(q)
        return self._data.site_xpos[self._hand] - self._shoulder

    def jacobian(self, q: Array) -> Array:
        """(3, 4)."""
        self._go(q)
        J = np.zeros((3, self._model.nv))
        mujoco.mj_jacSite(self._model, self._data, J, None, self._hand)
        return J @ self._coupling

    def jacobian_derivative(self, q: Array) -> Array:
        """(3, 4, 4)."""
        D = _derivative(self.jacobian, q)
        return (D + D.swapaxes(-1, -2)) / 2

    def gravity_gradient(self, q: Array) -> Array:
        """(4, 4), N m/rad."""
        D = _derivative(self.weight, q)
        return (D + D.T) / 2

    # what a person does, and how stiff the hand then is

    def held(self, q: Array, force: Array, wish: Array) -> Array:
        """Activations (23,) nearest to a wish that hold weight and hand force (3,) N at q."""
        wanted = self.weight(q) + self.jacobian(q).T @ force
        self._go(q)
        passive = -self._arms().T @ self._tensions(np.zeros(len(wish)))
        G = self._arms()[self._active]
        pull = np.array(
            [
                -G[i] * (self._tensions(np.eye(len(wish))[i])[self._active[i]] - at_rest)
                for i, at_rest in enumerate(self._tensions(np.zeros(len(wish)))[self._active])
            ]
        ).T
        # min |alpha - wish|^2 with pull (4, 23) alpha = wanted - passive, 0.005 <= alpha <= .9
        X = np.vstack([1e3 * pull, np.eye(len(wish))])
        y = np.concatenate([1e3 * (wanted - passive), wish])
        return np.asarray(lsq_linear(X, y, (0.005, 0.9)).x)

    def hand_stiffness(self, q: Array, alpha: Array, force: Array) -> Array:
        """``K_e = (J (K_q + Gamma + dg/dq)^-1 J^T)^-1`` with K_q from derivatives, N/m."""
        gamma = np.tensordot(force, self.jacobian_derivative(q), 1)
        K = self.joint_stiffness(q, alpha) + gamma + self.gravity_gradient(q)
        J = self.jacobian(q)
        return np.linalg.inv(J @ np.linalg.solve((K + K.T) / 2, J.T))

    def pushed(self, q: Array, alpha: Array, step: float = 1e-4) -> Array:
        """Minus the change of the hand's force (3, 3) as the hand is moved and all joints give way.

        The slow way: where the hand stands ``p(x) = p(q) + d`` and the torque along the swivel
        vanishes, found by Newton's method.
        """
        start = self.hand_position(q)

        def force(d: Array) -> Array:
            x = q.copy()
            for _ in range(8):
                J = self.jacobian(x)
                swivel = np.linalg.svd(J)[2][-1]
                left = np.concatenate([self.hand_position(x) - start - d, [swivel @ spare(x)]])
                slope = np.vstack([J, _derivative(lambda y: swivel_at(y) @ spare(y), x, 1e-5)])
                x = x - np.linalg.solve(slope, left)
            return np.linalg.lstsq(self.jacobian(x).T, spare(x), rcond=None)[0]

        def spare(x: Array) -> Array:
            return self.torque(x, alpha, around=q) - self.weight(x)

        reference = np.linalg.svd(self.jacobian(q))[2][-1]

        def swivel_at(x: Array) -> Array:
            v = np.linalg.svd(self.jacobian(x))[2][-1]
            return v * np.sign(v @ reference)

        return -np.array([(force(step * e) - force(-step * e)) / (2 * step) for e in np.eye(3)]).T


def _derivative(function: Any, q: Array, step: float = _STEP) -> Array:
    """Central differences (..., n) of a function of q (n,)."""
    q = np.asarray(q, dtype=float)
    turns = step * np.eye(len(q))
    return np.stack([(function(q + t) - function(q - t)) / (2 * step) for t in turns], axis=-1)
