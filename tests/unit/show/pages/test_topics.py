"""A page of each topic: it names what was fitted and holds the numbers that the verb gives."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from sessions import pushes

import armimpedance as ai
from armimpedance.__main__ import main
from armimpedance.app.report.write import report_page
from armimpedance.muscles.models import write_model
from armimpedance.show.files.tables import write_json
from armimpedance.show.pages import TOPICS
from armimpedance.show.pages.asked import Asked
from armimpedance.show.pages.page import Picture
from armimpedance.show.pages.rendering import html_of
from manipulandum_sim.elbow import simulate_bench
from manipulandum_sim.hand import simulate
from manipulandum_sim.passive import simulate_passive


def of(recording, **options):
    return report_page(Asked((Path("session"),), opened=recording, **options))


@pytest.fixture(scope="module")
def session():
    return pushes(1, ("cocontraction_10",))


@pytest.fixture
def unrendered(monkeypatch):
    """Drawings are made and not written as SVG, which is most of a page's time."""
    monkeypatch.setattr(Figure, "savefig", lambda _, text, **__: text.write("<svg></svg>"))


@pytest.mark.usefixtures("unrendered")
def test_a_joint_under_a_random_perturbation(parse):
    recording, _ = simulate_bench(0.07, 0.6, 20.0, trials=2, duration_s=6.0, snr_db=30.0, seed=3)
    page, fit = of(recording), ai.elbow(recording)
    held = pd.DataFrame(parse(html_of(page)).data("parameters"))
    np.testing.assert_allclose(held["value"], fit.to_frame()["value"], rtol=1e-6)
    assert fit.method in page.methods.paragraph
    assert [b for b in page.blocks if isinstance(b, Picture)]


@pytest.mark.study
def test_a_relaxed_joint(parse):
    recording, _ = simulate_passive("release", trials=2, duration_s=4.0)
    page, fits = of(recording), ai.passive(recording)
    held = pd.DataFrame(parse(html_of(page)).data("parameters"))
    np.testing.assert_allclose(held["value"], fits.to_frame()["value"], rtol=1e-6)
    assert "output-error" in page.methods.paragraph
    other = of(recording, method="parallel")
    assert "parallel" in other.methods.paragraph


@pytest.mark.study
def test_joints_are_mapped_from_the_hand(session):
    page = of(session, topic="joint")
    joint = ai.to_joint(ai.estimate(session), recording=session)
    assert page.data["results"]["K_11"].iloc[0] == joint.to_frame()["K_11"].iloc[0]
    assert "K_j = J^T K_e J" in page.methods.paragraph


@pytest.mark.study
def test_reflex_and_comparison_of_a_session():
    pair = ["cocontraction_00", "cocontraction_30"]
    recording, _ = simulate("cocontraction", seed=6, sets=1, conditions=pair)
    reflex = of(recording, topic="reflex")
    assert list(reflex.data["verdicts"]["condition"]) == pair
    compared = of(recording, topic="comparison")
    assert "1 of 1 pair differ" in compared.verdict.trust


@pytest.mark.usefixtures("unrendered")
def test_a_fit_file_is_reported_with_its_checks(tmp_path, capsys):
    recording, _ = simulate_bench(0.07, 0.6, 20.0, trials=2, duration_s=6.0, snr_db=30.0, seed=3)
    fit = ai.elbow(recording)
    write_json(fit.summary.to_dict(), tmp_path / "fit.json")
    out = tmp_path / "page.html"
    assert main(["report", str(tmp_path / "fit.json"), "--out", str(out)]) == 0
    text = out.read_text()
    for check in fit.checks:
        assert check.name in text


def test_a_file_of_nothing_is_refused_in_one_line(tmp_path, capsys):
    listed = '{"method": "m", "parameters": [1.0]}'
    for name, content in {
        "a.json": "{}",
        "d.json": listed,
        "b.csv": "x,y\n1,2\n",
        "c.json": "[1",
    }.items():
        (tmp_path / name).write_text(content)
        out = tmp_path / "page.html"
        assert main(["report", str(tmp_path / name), "--out", str(out)]) == 2
        said = capsys.readouterr().err.strip()
        assert "\n" not in said
        assert name in said
        assert not out.exists()


def test_a_fit_file_of_the_wrong_shape_is_refused(tmp_path, capsys):
    for content in ({"parameters": 3}, {"parameters": [{}], "method": "x"}):
        (tmp_path / "fit.json").write_text(json.dumps(content))
        assert main(["report", str(tmp_path / "fit.json"), "--out", str(tmp_path / "p.html")]) == 2
        assert "fit.json" in capsys.readouterr().err


def test_therapy_says_which_files_are_missing(session):
    with pytest.raises(ai.InputError, match="ROBOT.json"):
        of(session, topic="therapy")


def test_every_topic_has_words_for_the_help():
    assert all(topic.what for topic in TOPICS.values())


@pytest.mark.usefixtures("unrendered")
def test_a_course_over_time(parse):
    recording, _ = simulate_bench(0.07, 0.6, 20.0, duration_s=6.0, snr_db=30.0, seed=3)
    page = of(recording, topic="elbow_over_time", method="windows")
    course = ai.elbow_over_time(recording, method="windows")
    held = pd.DataFrame(parse(html_of(page)).data("course"))
    np.testing.assert_allclose(held["K"], course.K, rtol=1e-6)
    assert "method windows" in page.methods.paragraph


@pytest.mark.study
def test_a_model_over_posture_is_drawn_where_it_was_measured_and_beyond(tmp_path):
    recording, _ = simulate("postures", seed=5, sets=1)
    model = ai.fit_posture(ai.to_joint(ai.estimate(recording), recording=recording), order=1)
    write_model(model, tmp_path / "posture.json")
    page = report_page(Asked((tmp_path / "posture.json",)))
    assert len(page.data["parameters"]) == len(model.to_frame())
    assert [block.name for block in page.blocks if isinstance(block, Picture)] == ["predicted"]
