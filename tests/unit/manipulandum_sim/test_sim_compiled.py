"""The compiled integration against NumPy's, which is its oracle."""

import sys

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from manipulandum_sim.hand import compiled
from manipulandum_sim.hand.disturbances import custom
from manipulandum_sim.hand.noise import NoiseLevel
from manipulandum_sim.hand.rig import Reflex, Rig
from manipulandum_sim.hand.robot import IDEAL, Robot, Servo
from manipulandum_sim.hand.simulate import simulate, simulate_condition

pytestmark = pytest.mark.study

numba = pytest.importorskip("numba")

UNSTEADY = NoiseLevel("unsteady", drift_sd=0.003, tremor=0.08, voluntary_sd=0.25)
RIGS = {
    "default": {},
    "soft": {"servo": Servo(300.0, 0.05)},
    "stiff": {"servo": Servo(200_000.0)},
    "no feedforward": {"servo": Servo(5_000.0, 1.0, False, False)},
    "velocity steps": {"disturbance": "half_sine"},
    "custom": {"disturbance": custom("wave", np.sin(np.linspace(0, 3 * np.pi, 20)))},
    "stays off": {"residual_m": 0.004, "amplitude_m": -0.02},
    "reflex": {"reflex": Reflex(0.5, 0.04)},
    "late reflex": {"reflex": Reflex(0.25, 2.0)},
    "quick reflex": {"reflex": Reflex(0.25, 0.001), "servo": Servo(50_000.0)},
    "substeps": {"substeps": 3, "noise": UNSTEADY, "reflex": Reflex()},
    "unsteady": {"noise": UNSTEADY},
    "heavy": {"handle_mass_kg": 1.5, "robot": Robot(handle_kg=2.0)},
}


def session(by_numba, experiment="force", sets=1, **rig):
    """A session with noise of the limb but none of the sensors, which would round alike."""
    asked = {"noise": "none", "emg": False, **rig}
    names = {"force": ["force_0.5_x9.8N_045deg", "force_3.0_x9.8N_270deg"]}.get(experiment)
    return simulate(experiment, seed=3, sets=sets, conditions=names, compiled=by_numba, **asked)[0]


def same_bits(one, other):
    return (
        one.position.tobytes() == other.position.tobytes()
        and one.force.tobytes() == other.force.tobytes()
        and one.joint_angles.tobytes() == other.joint_angles.tobytes()
    )


@pytest.mark.parametrize("name", RIGS)
def test_compiled_and_numpy_agree_to_rounding(name):
    plain, fast = session(False, **RIGS[name]), session(True, **RIGS[name])
    moved = np.ptp(plain.position, axis=0).max()
    # 1e-9 of the motion itself, which is small beside where the hand is
    np.testing.assert_allclose(fast.position, plain.position, rtol=0, atol=1e-9 * moved)
    largest = np.abs(plain.force).max()
    np.testing.assert_allclose(fast.force, plain.force, rtol=0, atol=1e-9 * largest)


@pytest.mark.parametrize("subject", "BD")
def test_every_posture_of_every_subject_agrees(subject):
    plain, fast = (
        simulate("postures", seed=1, sets=1, subject=subject, noise="none", emg=False, compiled=c)
        for c in (False, True)
    )
    np.testing.assert_allclose(fast[0].position, plain[0].position, rtol=0, atol=1e-11)
    np.testing.assert_allclose(fast[0].force, plain[0].force, rtol=0, atol=1e-8)


def test_a_trial_has_its_bits_whatever_is_beside_it(monkeypatch):
    rig = {"noise": UNSTEADY, "reflex": Reflex(), "emg": False, "seed": 5, "compiled": True}
    many = simulate_condition(repeats=3, **rig)[0]
    few = simulate_condition(repeats=1, sets=5, **rig)[0]
    monkeypatch.setattr(sys.modules["manipulandum_sim.hand.simulate"], "BLOCK", 13)
    apart = simulate_condition(repeats=3, **rig)[0]
    assert same_bits(many, apart)
    samples = len(few.position)
    assert many.position[:samples].tobytes() == few.position.tobytes()
    assert many.force[:samples].tobytes() == few.force.tobytes()


def test_where_numba_keeps_no_files_it_compiles_in_memory(monkeypatch):
    real, refused = numba.njit, []

    def njit(**options):
        if options.pop("cache", False):
            refused.append(options)
            raise RuntimeError("cannot cache function: no locator available")
        # kept here, that the test need not wait for the compiler
        return real(cache=True, **options)

    kept = session(True)
    monkeypatch.setattr(numba, "njit", njit)
    compiled._compiled.cache_clear()
    in_memory = session(True)
    compiled._compiled.cache_clear()
    assert refused
    assert same_bits(kept, in_memory)


def test_the_arctangent_is_right_to_the_last_bits():
    kernel = pytest.importorskip("manipulandum_sim.hand.kernel")
    turn = np.concatenate([np.linspace(-np.pi, np.pi, 4001)[1:], np.arange(-4, 5) * np.pi / 8])
    found = [kernel.angle.py_func(np.sin(q), np.cos(q)) for q in turn]
    true = np.arctan2(np.sin(turn), np.cos(turn))
    np.testing.assert_allclose(found, true, rtol=5e-16, atol=5e-16)


def test_an_ideal_servo_integrates_nothing():
    assert same_bits(session(False, servo=IDEAL), session(True, servo=IDEAL))


def test_only_a_compiled_course_is_told_as_one():
    assert any("compiled" in line for line in session(True).provenance)
    assert session(False).provenance == Rig(emg=False, noise="none").sentences + ("seed 3",)
    assert session(True, servo=IDEAL).provenance == session(False, servo=IDEAL).provenance


def test_a_compiled_run_without_numba_is_one_line(monkeypatch):
    monkeypatch.setitem(sys.modules, "numba", None)
    with pytest.raises(InputError, match=r'numba.*pip install "armimpedance\[fast\]"'):
        simulate_condition(seed=1, compiled=True)
    assert "compiled" not in " ".join(simulate_condition(seed=1, sets=1)[0].provenance)
