"""The peers: one row each, what it is, who runs it, how far it is taken."""

from __future__ import annotations

from dataclasses import dataclass

#: What the others are held against.
HAND, JOINT = "armimpedance", "armimpedance, joint"


@dataclass(frozen=True)
class Peer:
    """One way to M, B and K.

    Attributes
    ----------
    name : str
    module, function : str
        Where it is; a function that begins with "hand" gets pushes of a hand, else records of a
        joint.
    ours : bool
        Of this package, and run by its interpreter.
    beside : str
        What of this package does the same and is held against it.
    most : int
        The largest number of trials that it is given.
    """

    name: str
    module: str
    function: str
    ours: bool = False
    beside: str = HAND
    most: int = 100_000

    @property
    def rigs(self) -> tuple[str, ...]:
        """Where it runs: hand, or joint with and without a reflex."""
        return ("hand",) if self.function.startswith("hand") else ("joint", "reflex")


PEERS = (
    Peer(HAND, "with_armimpedance", "hand", ours=True),
    Peer("armimpedance, checked", "with_armimpedance", "hand_checked", ours=True, most=10_000),
    Peer("armimpedance, definite", "with_armimpedance", "hand_definite", ours=True, most=10_000),
    Peer("armimpedance, exact", "with_armimpedance", "hand_exact", ours=True),
    Peer("armimpedance, by sessions", "with_armimpedance", "hand_sessions", ours=True),
    Peer("SciPy loop", "with_scipy", "hand"),
    Peer("statsmodels", "with_statsmodels", "hand", most=10_000),
    Peer("statsmodels, drift", "with_statsmodels", "hand_drift"),
    Peer("SIPPY PARSIM-K", "with_sippy", "hand", most=1000),
    # it knows that the matrices are symmetric
    Peer("MuJoCo, inverse", "with_mujoco", "hand_inverse", beside="armimpedance, definite"),
    # its error is a hundred times what chance does: more trials would say nothing more
    Peer("MuJoCo, forward", "with_mujoco", "hand_forward", most=100),
    Peer(JOINT, "with_armimpedance", "joint", ours=True, beside=JOINT),
    Peer("armimpedance, joint, checked", "with_armimpedance", "joint_checked", True, JOINT),
    Peer("SciPy loop, joint", "with_scipy", "joint", beside=JOINT),
    Peer("statsmodels, joint", "with_statsmodels", "joint", beside=JOINT),
    Peer("SIPPY ARX", "with_sippy", "joint_arx", beside=JOINT),
    Peer("SIPPY OE", "with_sippy", "joint_oe", beside=JOINT),
    Peer("SysIdentPy", "with_sysidentpy", "joint", beside=JOINT),
    Peer("MuJoCo, hinge", "with_mujoco", "joint", beside=JOINT),
)
