"""The demo's models: what is fitted, what is left out and why, how they compare with the truth."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.lab.parts.demo_models import fit_models, models_text
from armimpedance_figures.tsuji1997.study import study


@pytest.fixture(scope="module")
def studied():
    conditions = {
        "postures": [f"posture_{i:02d}" for i in range(1, 19, 2)],
        "cocontraction": None,
        "force": None,
    }
    return {
        name: study(name, subject="A", seed=3, sets=1, conditions=names)
        for name, names in conditions.items()
    }


def test_three_models_are_fitted_and_many_conditions_are_pooled(studied):
    models = {m.name: m for m in fit_models(studied)}
    assert list(models) == ["posture", "activation", "muscles"]
    for each in models.values():
        assert each.problem == ""
        # an interval and an error of one model are of one size: a factor of four is far
        assert 0.25 < each.interval_percent / each.model_percent < 8
    # 99 numbers for 9 coefficients: an error a third as large on average (nine postures for six
    # coefficients promise next to nothing)
    assert models["activation"].model_percent < models["activation"].estimates_percent
    text = models_text(list(models.values()))
    assert max(map(len, text.splitlines())) <= 100
    assert "experiments 2, 3" in text


def test_what_cannot_be_fitted_is_left_out_with_its_reason(studied):
    nine = studied["postures"]
    two = replace(nine, hand=nine.hand[:2], joint=nine.joint[:2])
    models = fit_models({**studied, "postures": two})
    assert models[0].model is None
    assert np.isnan(models[0].model_percent)
    assert "left out, " in models_text(models)
    assert all(m.model is not None for m in models[1:])
