"""What all estimates of a recording have in common of what may make them wrong.

A reflex, a gain or a delay is one person's or one rig's: it makes all conditions wrong together.
With the error u_gc of group g by the column c of a departure, the groups' joint covariance is
``sum_c u_c u_c^T``, u_c of all groups below each other. Columns of one departure differ little, so
that one vector stands for them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from armimpedance.core.arrays import FloatArray


def in_common(errors: Sequence[Mapping[str, FloatArray]]) -> list[dict[str, FloatArray]]:
    """One vector of each departure for each group, which together hold most of its variance.

    Parameters
    ----------
    errors : sequence of mapping of str to (columns, p)
        Of each group what each column of each departure makes wrong, in standard deviations; none
        of a group of which nothing is known.

    Returns
    -------
    list of dict of str to (p,)
        Signs are those of the columns' sum: departures of one recording and of the next add.
    """
    names = dict.fromkeys(name for one in errors for name in one)
    found: list[dict[str, FloatArray]] = [{} for _ in errors]
    for name in names:
        groups = [g for g, one in enumerate(errors) if name in one]
        # U (columns, groups p) = sum_i s_i u_i v_i^T; U^T U, the covariance, is nearly s_1^2 v v^T
        U = np.concatenate([errors[g][name] for g in groups], axis=1)
        main = np.linalg.svd(U, full_matrices=False)
        vector = main.S[0] * main.Vh[0] * (-1 if main.Vh[0] @ U.sum(axis=0) < 0 else 1)
        for g, part in zip(groups, np.split(vector, len(groups)), strict=True):
            found[g][name] = part
    return found
