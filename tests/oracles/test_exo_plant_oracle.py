"""Arm and exoskeleton against an adaptive integrator of the same equations, written out anew."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from manipulandum_sim.elbow.device import (
    GYROSCOPE,
    MOTOR_CURRENT,
    POTENTIOMETER,
    STRAIN_GAUGE,
    Exoskeleton,
    Limits,
    Rendered,
)
from manipulandum_sim.elbow.plant import Drive, run

SAMPLES = 250
I_LIMB, GRAVITY, Q0 = 0.07, 2.6, 1.2


def stiffness(t):
    return 9.0 + 3.0 * np.sin(11.0 * t)


def viscosity(t):
    return 3.5 + 1.0 * np.sin(11.0 * t + 0.4)


def push(t):
    return 13.0 + 2.0 * np.sin(17.0 * t)


def perturbation(t):
    return 3.0 * np.sin(40.0 * t + 1.0) + 1.0 * np.sin(130.0 * t)


def oracle(device, rendered, load, angle, rate):
    """theta, theta', motor, interaction at every sample: one trial, one sample at a time."""
    # Butterworth, second order, 10 Hz, by the bilinear transform with its frequency prewarped
    c = 1 / np.tan(np.pi * 10.0 / 1000.0)
    a0 = 1 + np.sqrt(2) * c + c**2
    b = np.array([1.0, 2.0, 1.0]) / a0
    a = np.array([2 * (1 - c**2), 1 - np.sqrt(2) * c + c**2]) / a0
    keep = np.exp(-2 * np.pi * 3.0 / 1000.0)
    told = [load]
    x, y = {-1: np.zeros(2), -2: np.zeros(2)}, {-1: np.zeros(2), -2: np.zeros(2)}
    error, state, out = 0.0, np.array([angle, rate, load]), []

    def derivative(t, s, command):
        theta, omega, motor = s
        limb = push(t) - stiffness(t) * theta - viscosity(t) * omega - GRAVITY * np.sin(theta)
        drag = device.viscosity * omega + device.friction * np.tanh(omega / device.slip)
        both = I_LIMB + device.inertia
        return [omega, (limb + motor - drag) / both, (command - motor) / device.motor_lag_s]

    for k in range(SAMPLES):
        t = k / 1000.0
        theta, omega, motor = state
        acceleration = derivative(t, state, 0.0)[1]
        drag = device.viscosity * omega + device.friction * np.tanh(omega / device.slip)
        # what of the motor's torque the device does not need for itself reaches the limb
        interaction = motor - drag - device.inertia * acceleration
        out.append([theta, omega, motor, interaction])
        x[k] = np.array([theta - Q0, omega])
        y[k] = b[0] * x[k] + b[1] * x[k - 1] + b[2] * x[k - 2] - a[0] * y[k - 1] - a[1] * y[k - 2]
        felt = rendered.stiffness * y[k][0] + rendered.viscosity * y[k][1]
        felt += rendered.inertia * (y[k][1] - y[k - 1][1]) * 1000.0
        wanted = perturbation(t) + load - felt
        error = keep * error + (1 - keep) * (wanted - interaction)
        done = solve_ivp(
            derivative, (t, t + 0.001), state, "DOP853", args=(told[-1],), rtol=1e-12, atol=1e-13
        )
        state = done.y[:, -1]
        told.append(wanted + 4.0 * error)
    return np.array(out)


@pytest.mark.first_cases(2)
@pytest.mark.parametrize(
    "rendered",
    [Rendered(viscosity=0.3, stiffness=3.0), Rendered(inertia=0.1, stiffness=1.0)],
    ids=["spring and damper", "inertia"],
)
@pytest.mark.parametrize("friction", [0.0, 0.15])
def test_the_plant_moves_as_an_adaptive_integrator_says(rendered, friction):
    """Within 2 % of one count of each sensor; the commands jump by several N m to begin with."""
    device = Exoskeleton(friction=friction)
    fine, coarse = np.arange(2 * SAMPLES - 1) / 2000.0, np.arange(SAMPLES) / 1000.0
    starts = [(1.1, 0.5, 0.4), (1.4, -0.8, -1.0)]
    loads, angles, rates = (np.array([s[i] for s in starts]) for i in (2, 0, 1))
    drive = Drive(
        inertia=I_LIMB,
        gravity=GRAVITY,
        K=np.repeat(stiffness(fine)[:, None], 2, axis=1),
        B=np.repeat(viscosity(fine)[:, None], 2, axis=1),
        push=np.repeat(push(fine)[:, None], 2, axis=1),
        load=loads,
        perturbation=np.repeat(perturbation(coarse)[:, None], 2, axis=1),
        rendered=rendered,
        q0=Q0,
        angle=angles,
        rate=rates,
    )
    motion = run(drive, device, None, Limits(1e3, 1e3))
    for t, (angle, rate, load) in enumerate(starts):
        expected = oracle(device, rendered, load, angle, rate)
        pairs = (
            (motion.angle, POTENTIOMETER),
            (motion.rate, GYROSCOPE),
            (motion.motor, MOTOR_CURRENT),
            (motion.interaction, STRAIN_GAUGE),
        )
        for column, (found, sensor) in enumerate(pairs):
            error = np.abs(found[:, t] - expected[:, column]).max()
            assert error < 0.02 * sensor.step
