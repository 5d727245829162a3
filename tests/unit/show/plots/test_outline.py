"""The band of an outline is what draws from the covariance spread over."""

import numpy as np
import pytest

from armimpedance.hand.ellipses import locus
from armimpedance.hand.show.ellipse_plot_parts import confidence_band, outline_radius

K = np.array([[104.8, -70.4], [-78.4, 179.3]])
ANGLES = np.linspace(0, 2 * np.pi, 25)


def test_outline_passes_through_the_locus():
    x, y = locus(K).T
    radius, _ = outline_radius(K, np.zeros((4, 4)), np.arctan2(y, x))
    np.testing.assert_allclose(radius, np.hypot(x, y), rtol=1e-12)


def test_standard_error_is_the_derivative():
    # A covariance of rank one moves the matrix along one direction only.
    rng = np.random.default_rng(5)
    step = rng.normal(size=(2, 2))
    _, sd = outline_radius(K, np.outer(step.ravel(), step.ravel()), ANGLES)
    h = 1e-4
    plus, _ = outline_radius(K + h * step, np.zeros((4, 4)), ANGLES)
    minus, _ = outline_radius(K - h * step, np.zeros((4, 4)), ANGLES)
    np.testing.assert_allclose(sd, np.abs(plus - minus) / (2 * h), rtol=1e-6, atol=1e-8)


def test_standard_error_is_the_spread_of_draws():
    root = np.random.default_rng(1).normal(size=(4, 4))
    covariance = root @ root.T
    radius, sd = outline_radius(K, covariance, ANGLES)
    draws = np.random.default_rng(2).multivariate_normal(K.ravel(), covariance, 4000)
    none = np.zeros((4, 4))
    sampled = np.array([outline_radius(d.reshape(2, 2), none, ANGLES)[0] for d in draws])
    # A sampled sd of 4000 is known to 1.1 %: four of these, and as much for curvature.
    np.testing.assert_allclose(sampled.std(axis=0), sd, rtol=0.09)


def test_band_is_wider_with_fewer_degrees_of_freedom_and_holds_the_outline(make_estimate):
    widths = []
    for dof in (4.0, 39.0, np.inf):
        inner, outer = confidence_band(make_estimate(dof=dof), "stiffness")
        middle = np.linalg.norm(locus(make_estimate().stiffness, len(inner)), axis=1)
        low, high = np.linalg.norm(inner, axis=1), np.linalg.norm(outer, axis=1)
        np.testing.assert_allclose((low + high) / 2, middle, rtol=1e-9)
        widths.append(high - low)
    # 97.5 % points of t with 4, 39 and infinite degrees of freedom
    np.testing.assert_allclose(widths[0] / widths[2], 2.7764 / 1.9600, rtol=1e-4)
    np.testing.assert_allclose(widths[1] / widths[2], 2.0227 / 1.9600, rtol=1e-4)


def test_band_of_a_poor_estimate_ends_at_the_centre(make_estimate):
    inner, _ = confidence_band(make_estimate(covariance=np.eye(12) * 1e6), "stiffness")
    assert np.linalg.norm(inner, axis=1).min() == pytest.approx(0)
