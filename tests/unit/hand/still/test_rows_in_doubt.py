"""What makes all rows of a model wrong alike is named by the model, too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.records import ImpedanceEstimate, Quality
from armimpedance.hand.show import write_results
from armimpedance.muscles.show import fit_model, read_joint_rows


def estimates(*warnings: str) -> list[ImpedanceEstimate]:
    """A joint at six places."""
    rng = np.random.default_rng(0)
    M, B = np.diag([0.3, 0.1]), np.array([[1.2, 0.4], [0.4, 1.0]])
    K = np.array([[15.0, 6.0], [6.0, 16.0]])
    quality = Quality(8, 8, 1.0, 1.0, 1.0, 1.0, 12, 0.0)
    fields = {"covariance": 0.04 * np.eye(12), "dof": 20.0, "quality": quality}
    one = ImpedanceEstimate("joint", "weighted", M, B, K, **fields, warnings=tuple(warnings))
    places = rng.uniform([0.5, 1.0], [1.5, 2.0], (6, 2))
    return [
        replace(one, joint_angles=q, keys={"condition": f"place_{i}"}) for i, q in enumerate(places)
    ]


@pytest.mark.parametrize("through_a_file", [False, True])
def test_a_reflex_of_the_rows_is_told_by_the_model(through_a_file, tmp_path):
    def warnings(*told: str) -> tuple[str, ...]:
        rows = estimates(*told)
        if not through_a_file:
            return fit_model("moment-arms", rows, order=0).warnings
        write_results(rows, tmp_path / "joint.csv")
        return fit_model("moment-arms", read_joint_rows([tmp_path / "joint.csv"]), order=0).warnings

    doubted = warnings("only 8 clusters: t", "reflex: an answer makes K wrong; disturb shorter")
    assert any("together" in w and "reflex" in w and "clusters" not in w for w in doubted)
    assert not any("together" in w for w in warnings("only 8 clusters: t"))
