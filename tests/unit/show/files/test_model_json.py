"""MODEL.json: what is written is the model, and anything else is refused in one line."""

import json

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.muscles.models.kinds import kind_of
from armimpedance.muscles.models.model_json import CHECKSUM, read_model, write_model
from armimpedance.muscles.models.posture.fit import fit_posture_model
from armimpedance.muscles.models.rows import JointRows
from armimpedance.numerics.regression import FitSummary, NamedParameter
from armimpedance.show.files.tables import write_json


@pytest.fixture(scope="module")
def model():
    rng = np.random.default_rng(3)
    q = rng.uniform([0.2, 0.7], [1.4, 2.0], (12, 2))
    K = np.array([[15.0, 6.0], [6.0, 16.0]]) * (1 + 0.2 * np.sin(q[:, :1, None]))
    K = K + rng.normal(0, 0.3, K.shape)
    return fit_posture_model(JointRows(q, K, K / 12), order=1, model="polynomial")


@pytest.fixture
def path(model, tmp_path):
    write_model(model, tmp_path / "model.json")
    return tmp_path / "model.json"


def test_a_model_read_back_predicts_the_same(model, path):
    read = read_model(path)
    assert kind_of(read).name == "moment-arms"
    postures = np.array([[0.8, 1.2], [2.5, 0.1]])
    before, after = model.predict(postures), read.predict(postures)
    for field in ("stiffness", "viscosity", "stiffness_covariance", "viscosity_covariance"):
        assert getattr(before, field).tobytes() == getattr(after, field).tobytes()
    assert before.reasons == after.reasons
    assert before.dof == after.dof


def test_the_file_holds_what_every_fit_says_of_itself(model, path):
    content = json.loads(path.read_text())
    for name in ("method", "n", "cond_raw", "cond_scaled", "rank", "r2", "vaf", "warnings"):
        assert content[name] == getattr(model.summary, name) or name == "warnings"
    first = content["parameters"][0]
    wanted = {"name", "value", "sd", "sd_robust", "ci95", "rel_sd_percent", "well_identified"}
    assert wanted | {"unit"} <= set(first)
    assert [q["element"] for q in content["quality"]][:4] == ["K_ss", "K_se", "K_es", "K_ee"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"format": "other"}, "column format: not a model"),
        ({"version": 2}, "column version: version 2 (expected 1)"),
        ({"kind": "tendons"}, "kind 'tendons' (expected moment-arms or activation or muscles)"),
        ({"model": [1, 2]}, "column model: no model"),
        ({"model": {}}, "model.json"),
    ],
)
def test_another_file_is_refused(path, change, words):
    content = json.loads(path.read_text())
    # Without its checksum, as files of earlier versions are.
    del content[CHECKSUM]
    path.write_text(json.dumps(content | change))
    with pytest.raises(InputError) as refused:
        read_model(path)
    assert words in str(refused.value)
    assert str(path) in str(refused.value)


def _broken(value):
    """Every way in which one field of the model's plain form can be damaged."""
    for name in value:
        yield {k: v for k, v in value.items() if k != name}
        for wrong in (None, "text", [], {}, [[1.0]], -1, 1e400):
            if value[name] != wrong:
                yield {**value, name: wrong}


def test_a_damaged_model_is_refused_or_read_but_never_breaks(path):
    content = json.loads(path.read_text())
    del content[CHECKSUM]
    refused: list[str] = []
    for damaged in _broken(content["model"]):
        path.write_text(json.dumps(content | {"model": damaged}))
        try:
            read_model(path)
        except InputError as error:
            refused.append(str(error))
    assert len(refused) >= 4 * len(content["model"])
    assert not any("\n" in message for message in refused)


def _numbers(value, at=()):
    """The places of all numbers in a model's plain form."""
    if isinstance(value, bool) or not isinstance(value, int | float | list | dict):
        return
    if isinstance(value, int | float):
        yield at
        return
    for name, inner in value.items() if isinstance(value, dict) else enumerate(value):
        yield from _numbers(inner, (*at, name))


def test_a_number_that_was_changed_is_refused_wherever_it_stands(path):
    content = json.loads(path.read_text())
    places = list(_numbers(content["model"]))
    assert len(places) > 20
    for *way, last in places[:: max(1, len(places) // 40)]:
        changed = json.loads(path.read_text())
        home = changed["model"]
        for name in way:
            home = home[name]
        home[last] = home[last] * 1.0001 + 1e-9
        other = path.with_name("changed.json")
        other.write_text(json.dumps(changed))
        with pytest.raises(InputError, match="not those that were fitted"):
            read_model(other)


def test_another_layout_of_the_same_numbers_is_the_same_model(model, path):
    path.write_text(json.dumps(json.loads(path.read_text()), sort_keys=True, indent=7))
    postures = np.array([[0.8, 1.2]])
    again = read_model(path).predict(postures).stiffness
    assert again.tobytes() == model.predict(postures).stiffness.tobytes()


@pytest.mark.parametrize("text", ["", "{", "[1]", '"format"', "\x00", "[" * 100_000])
def test_what_is_no_json_object_is_refused(tmp_path, text):
    path = tmp_path / "model.json"
    path.write_text(text)
    with pytest.raises(InputError):
        read_model(path)


def test_a_fit_file_keeps_the_contract(tmp_path):
    parameters = (
        NamedParameter("k", 2.0, 0.1, 0.2, "N m/rad", joint=1),
        NamedParameter("h", 0.0, 0.1, 0.2, "N m s/rad", dof=5.0),
    )
    summary = FitSummary("least squares", 700, np.inf, 2.3, 2, 0.9, 0.95, parameters, ("a",))
    write_json({**summary.to_dict(), "subject": "1"}, tmp_path / "FIT.json")
    content = json.loads((tmp_path / "FIT.json").read_text())
    assert content["cond_raw"] is None
    assert content["subject"] == "1"
    k, h = content["parameters"]
    assert k["joint"] == 1
    assert "joint" not in h
    assert k["rel_sd_percent"] == pytest.approx(5.0)
    assert k["well_identified"] is False
    # 95 % of a normal distribution, and of t with 5 degrees of freedom (a table: 2.571)
    assert np.array(k["ci95"]) == pytest.approx([2 - 1.96 * 0.2, 2 + 1.96 * 0.2], abs=1e-4)
    assert h["ci95"][1] == pytest.approx(2.571 * 0.2, abs=1e-4)
    assert h["rel_sd_percent"] is None
