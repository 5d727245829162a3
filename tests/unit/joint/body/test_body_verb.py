"""`body` in a notebook: what the command gives, from records and from paths."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.joint.body.show import body
from armimpedance.recordings import write_recording
from manipulandum_sim.body import simulate_body


@pytest.fixture(scope="module")
def recording():
    return simulate_body(("walk", "all_joints"), sample_rate_hz=50.0)[0]


@pytest.fixture(scope="module")
def fit(recording):
    return body(recording, motions=1, noise_draws=0)


@pytest.fixture(scope="module")
def held(recording):
    return body(recording, motions=1, method="prior", noise_draws=0)


@pytest.mark.study
def test_a_path_and_its_record_give_the_same(recording, fit, tmp_path):
    write_recording(recording, tmp_path / "session")
    read = body(tmp_path / "session", motions=1, noise_draws=0)
    assert read.to_dict() == fit.to_dict()


def test_a_result_as_a_table(fit):
    frame = fit.to_frame()
    assert list(frame.index) == list(fit.base.names)
    assert list(frame.columns) == ["value", "sd", "ci_low", "ci_high", "unit", "expression"]
    assert np.array_equal(frame.value, fit.parameters.values)
    assert (frame.ci_low < frame.ci_high).all()


def test_a_hundred_parameters_show_themselves_in_a_few_lines(fit, held):
    for one in (fit, replace(fit, warnings=("poor",) * 30), held):
        assert 3 <= len(repr(one).splitlines()) <= 12
    assert "128 base parameters" in repr(fit)
    assert fit._repr_html_().count("<tr>") <= 12


def test_hostile_names_are_escaped(fit):
    names = tuple(f"<i>{name}" for name in fit.base.names)
    parameters = replace(fit.parameters, names=names)
    html = replace(fit, parameters=parameters, warnings=("<b>",))._repr_html_()
    assert "<i>" not in html
    assert "<b>" not in html


def test_the_identified_skeleton_has_the_bodys_mass(fit, held, recording):
    assert held.skeleton.mass_kg == pytest.approx(held.parameters["m_pelvis"].value, rel=1e-9)
    assert held.skeleton.coordinates == recording.skeleton.coordinates
    with pytest.raises(InputError, match="sums of segments' parameters"):
        _ = fit.skeleton


def test_the_summary_is_that_of_the_file(fit):
    assert fit.summary.method == "body_weighted"
    assert fit.method == "weighted"
    assert body(fit.recording, motions=1, method="ls").summary.method == "body_least_squares"


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"method": "magic"}, "method .magic."),
        ({"prior_sd_percent": 30.0}, "method 'prior'"),
        ({"method": "prior", "prior_sd_percent": -3.0}, "more than 0"),
        ({"noise_draws": 1}, "2 or more"),
        ({"noise_draws": 1}, "1 draws"),
        ({"noise_draws": 4, "method": "ls"}, "no effect"),
        ({"noise_draws": 4, "cutoff_hz": None}, "no effect"),
        ({"longest_gap_s": 0.1}, "a recording of markers"),
        ({"terms": ("viscosity",)}, "rows 'all'"),
        ({"passive_joints": {"right_elbow_flexion": 90.0}}, "degrees"),
        ({"terms": ("viscosity",), "passive_joints": {"right_elbow_flexion": 0.3}}, "one of the"),
    ],
)
def test_what_has_no_effect_or_no_meaning_is_refused(recording, options, told):
    with pytest.raises(InputError, match=told):
        body(recording, **options)


def test_a_prior_that_is_not_used_is_refused(recording):
    with pytest.raises(InputError, match="a prior with method 'weighted'"):
        body(recording, prior=recording.skeleton)


@pytest.mark.study
def test_progress_counts_trials_then_draws(recording):
    told = []
    progress = lambda *counts: told.append(counts)  # noqa: E731
    body(recording, motions=1, noise_draws=2, progress=progress)
    assert told == [(1, 2), (2, 2), (1, 2), (2, 2)]
