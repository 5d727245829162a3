"""The interval that holds several intervals, where a record does not choose among them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.numerics.regression import Parameters, t_factor


def hull(own: Parameters, others: Sequence[Parameters], centre: FloatArray) -> Parameters:
    """Parameters at `centre` whose 95 % intervals hold those of `own` and of the others.

    Parameters
    ----------
    own : Parameters
        Its correlations and degrees of freedom are kept.
    others : sequence of Parameters
    centre : (p,)

    Returns
    -------
    Parameters
    """
    limits = np.array([p.interval() for p in (own, *others)])
    low, high = limits[..., 0].min(axis=0), limits[..., 1].max(axis=0)
    half = np.maximum(centre - low, high - centre)
    scale = half / (t_factor(own.dof) * own.sd)
    # C' (p, p) = diag(scale) C diag(scale)
    covariance = own.covariance * np.outer(scale, scale)
    return replace(own, values=centre, covariance=covariance)


def middle(several: Sequence[Parameters]) -> FloatArray:
    """The middle (p,) of the interval that holds all of theirs, no farther than their values."""
    limits = np.array([p.interval() for p in several])
    values = np.array([p.values for p in several])
    centre = (limits[..., 0].min(axis=0) + limits[..., 1].max(axis=0)) / 2
    return np.clip(centre, values.min(axis=0), values.max(axis=0))


def shifted(found: Parameters, one: Parameters, other: Parameters) -> Parameters:
    """What `found`, which was made of `one`, would be had it been made of `other`."""
    scale = np.maximum(other.sd / one.sd, 1.0)
    # C' (p, p) = diag(scale) C diag(scale)
    return replace(
        found,
        values=found.values + other.values - one.values,
        covariance=found.covariance * np.outer(scale, scale),
    )
