"""JSON carries what RESULTS.csv carries."""

import csv
import json

import numpy as np

from armimpedance.core.records import Quality
from armimpedance.hand.show.results_csv import write_results


def refuse(constant):
    raise AssertionError(f"{constant} is not JSON")


def test_json_and_csv_agree_and_hold_no_nan(tmp_path, make_estimate):
    nan = float("nan")
    unknown = Quality(2, 0, nan, 0.9, float("inf"), nan, 0, nan)
    estimates = [
        make_estimate(),
        make_estimate(k=3, dof=float("inf"), quality=unknown, position=None),
        make_estimate(k=1, level="joint", joint_angles=None, shoulder_m=None),
    ]
    write_results(estimates, tmp_path / "r.csv")
    write_results(estimates, tmp_path / "r.json")
    with open(tmp_path / "r.csv", newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    text = (tmp_path / "r.json").read_text(encoding="utf-8")
    objects = json.loads(text, parse_constant=refuse)
    for row, found, estimate in zip(rows, objects, estimates, strict=True):
        assert found["group"] == {"condition": "relaxed", "day": 2}
        for symbol in ("M", "B", "K", "sd_M", "ci_low_K", "ci_high_B", "M_with_handle"):
            for i, j in np.ndindex(estimate.k, estimate.k):
                assert found[symbol][i][j] == float(row[f"{symbol}_{i + 1}{j + 1}"])
        for name in ("size", "orientation_deg", "shape"):
            if estimate.k == 2:
                assert found["K_ellipse"][name] == float(row[f"K_{name}"])
                assert found["K_ellipse"][f"ci_low_{name}"] == float(row[f"ci_low_K_{name}"])
            else:
                assert found["K_ellipse"] is None
        assert found["covariance"] == json.loads(row["covariance"])
        assert found["warnings"] == ["onsets were detected"]
    assert objects[0]["M_antisymmetric"] == float(rows[0]["M_antisymmetric"])
    assert objects[1]["dof"] is None
    assert objects[1]["cond_raw"] is None
    assert objects[1]["multiple_correlation"] is None
    assert objects[1]["position_m"] is None
    assert objects[2]["position_rad"] == [float(rows[2]["position_1_rad"])]
