"""Ellipsoids: what their intervals hold, and their drawing."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.ellipses import Ellipsoid, ellipsoid_of
from armimpedance.hand.still.show import plot_estimates


def turned(values, seed=3):
    Q = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    return (Q * values) @ Q.T, Q


def with_stiffness(K, sd, dof=np.inf):
    covariance = np.eye(27)
    covariance[18:, 18:] *= sd**2
    position, quality = np.array([0.1, 0.4, 0.0]), None
    made = {"inertia": np.eye(3), "inertia_with_handle": np.eye(3), "viscosity": np.eye(3)}
    return ImpedanceEstimate(
        level="hand",
        method="weighted",
        stiffness=K,
        covariance=covariance,
        dof=dof,
        position=position,
        quality=quality,
        keys={"condition": "one"},
        **made,
    )


def test_half_axes_size_and_axes_are_those_of_the_matrix():
    K, Q = turned([1000.0, 400.0, 100.0])
    one = ellipsoid_of(with_stiffness(K, 1.0), "stiffness")
    assert isinstance(one, Ellipsoid)
    np.testing.assert_allclose(one.semi_axes, [1000, 400, 100])
    np.testing.assert_allclose(np.abs((one.axes * Q).sum(axis=0)), 1)
    assert one.size == pytest.approx(4 / 3 * np.pi * 1000 * 400 * 100)
    np.testing.assert_allclose(one.shape, [0.4, 0.1])


def test_intervals_hold_what_they_promise():
    rng, sd, dof = np.random.default_rng(1), 15.0, 60
    K, Q = turned([1000.0, 450.0, 300.0])
    truth = [1000.0, 450.0, 300.0, 4 / 3 * np.pi * 1000 * 450 * 300]
    held, axes = np.zeros(4), np.zeros(3)
    draws = 400
    for _ in range(draws):
        seen = sd * np.sqrt(rng.chisquare(dof) / dof)
        one = ellipsoid_of(with_stiffness(K + sd * rng.normal(size=(3, 3)), seen, dof), "stiffness")
        low, high = one.interval().T
        held += (low <= truth) & (truth <= high)
        axes += [one.may_be_axis(Q[:, i]) for i in range(3)]
    # 95 % less and more four standard errors of so many draws
    assert (np.abs(np.append(held, axes) / draws - 0.95) < 0.045).all()


def test_an_axis_turns_more_the_worse_it_is_known_and_all_the_way_between_equals():
    K, _ = turned([1000.0, 400.0, 390.0])
    sharp, blunt = (ellipsoid_of(with_stiffness(K, sd), "stiffness").turns() for sd in (5, 30))
    assert (blunt >= sharp).all()
    assert sharp[1, 1] == sharp[2, 1] == np.pi / 2
    assert np.degrees(sharp[0]).max() < 3


def test_what_has_no_ellipsoid_is_none_and_an_unknown_matrix_refused():
    K, _ = turned([1000.0, 400.0, -1.0])
    assert ellipsoid_of(with_stiffness(K, 1.0), "stiffness") is None
    with pytest.raises(InputError):
        ellipsoid_of(with_stiffness(K, 1.0), "softness")


def test_few_estimates_in_space_are_drawn_as_ellipsoids_many_as_diagonals():
    K, _ = turned([1000.0, 400.0, 100.0])
    bad, _ = turned([1000.0, 400.0, -5.0])
    figure = plot_estimates([with_stiffness(K, 10.0), with_stiffness(bad, 10.0)])
    titles = [ax.get_title() for ax in figure.axes]
    assert titles[:3] == ["from above", "from behind", "from the right"]
    reach = K[0] @ K[:, 0]
    # the outline reaches |A n| along n
    x = np.concatenate([line.get_xdata() for line in figure.axes[0].lines if len(line.get_xdata())])
    assert np.nanmax(x) == pytest.approx(np.sqrt(reach), rel=1e-3)
    assert len(plot_estimates([with_stiffness(K, 10.0)] * 9).axes) == 9
