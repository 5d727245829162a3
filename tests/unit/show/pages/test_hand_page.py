"""The page of a session: what it says is what was estimated, and it asks nobody for anything."""

from __future__ import annotations

import re
from dataclasses import replace
from hashlib import sha256
from importlib.resources import files
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from sessions import LEVELS, pushes

import armimpedance as ai
from armimpedance.__main__ import main
from armimpedance.app.report.write import report_page
from armimpedance.show.pages.asked import Asked
from armimpedance.show.pages.rendering import VEGA, html_of

HOSTILE = '<script>alert("1")</script> & $x_1$ </script> =1+1'
#: Names of the file and of a condition are no words of the page's own language.
NAME = Path(HOSTILE[:9])
CONDITIONS = [HOSTILE, "b"]


@pytest.fixture(scope="module")
def session():
    recording = pushes()
    named = dict(zip(LEVELS, CONDITIONS, strict=True))
    return _with(recording, recording.trials.replace({"condition": named}))


@pytest.fixture(scope="module")
def page(session):
    return report_page(Asked((NAME,), opened=session))


@pytest.fixture(scope="module")
def parsed(page, parse):
    return parse(html_of(page))


def test_the_page_asks_nobody_for_anything(parsed):
    asked = [
        value
        for _, attributes in parsed.elements
        for name, value in attributes.items()
        if name in ("src", "href", "srcset", "action", "poster")
    ]
    assert asked
    assert all(value.startswith(("data:", "#")) for value in asked)
    policy = [a["content"] for _, a in parsed.elements if a.get("http-equiv")]
    assert policy[0].startswith("default-src 'none'")


def test_the_tables_hold_what_estimate_gives(session, parsed):
    hand = ai.estimate(session)
    held = pd.DataFrame(parsed.data("results"))
    for name in ("K_11", "ci_low_K_11", "ci_high_B_22", "M_size"):
        np.testing.assert_allclose(held[name], hand.to_frame()[name], rtol=1e-6)
    ellipses = pd.DataFrame(parsed.data("ellipses")).set_index(["group", "matrix", "quantity"])
    for estimate, name in zip(hand, CONDITIONS, strict=True):
        size = ellipses.loc[(name, "stiffness", "size")]
        np.testing.assert_allclose(
            size["value"], ai.ellipse_of(estimate, "stiffness").size, rtol=1e-6
        )


def test_the_courses_of_the_trials_are_the_recordings_to_half_a_step(session, parsed):
    courses = pd.DataFrame(parsed.data("courses"))
    trials = pd.DataFrame(parsed.data("trials"))
    assert sorted(courses["trial"].unique()) == sorted(session.trials["trial"])
    assert dict(zip(trials["trial"], trials["group"], strict=True)) == dict(
        zip(session.trials["trial"], session.trials["condition"], strict=True)
    )
    row = 3
    part = courses[courses["trial"] == session.trials["trial"].iloc[row]]
    onset = float(session.trials["onset_s"].iloc[row])
    own = slice(*session.offsets[row : row + 2])
    at = np.searchsorted(session.time_s[own], onset + 1e-3 * part["ms"].to_numpy() - 5e-4)
    moved = 1e3 * session.position[own][at, 0]
    # both less their means at rest; 16 bits of 5 mm, and the time's own step of half a sample
    difference = part["moved_1"].to_numpy() - moved
    assert np.abs(difference - np.median(difference)).max() < 0.05


def test_names_of_a_file_stay_text(parsed):
    assert len([tag for tag, _ in parsed.elements if tag == "script"]) == 4
    assert HOSTILE in parsed.words
    assert HOSTILE in parsed.data("results")["condition"]


def _with(recording, trials):
    return replace(recording, trials=trials)


@pytest.mark.study
@pytest.mark.first_cases(1)
@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({}, ("weighted", "jackknife")),
        ({"method": "exact"}, ("Estimator: exact",)),
        ({"covariance": "bootstrap", "seed": 3}, ("drawing trials with replacement",)),
        ({"covariance": "replicates"}, ("within each direction",)),
    ],
    ids=lambda value: "-".join(map(str, value.values())) if isinstance(value, dict) else "",
)
def test_the_methods_paragraph_says_what_ran(session, options, words):
    page = report_page(Asked((NAME,), opened=session, **options))
    for word in (*words, ai.__version__, "disturbances", "reflex"):
        assert word in page.methods.paragraph
    said = dict(page.made)
    assert said["method"] == options.get("method", "weighted")


def test_every_check_stands_on_the_page_with_what_it_would_have_seen(session, parsed):
    for check in ai.inspect(session).checks:
        assert check.message in parsed.words
        assert check.smallest in parsed.words


@pytest.mark.study
def test_the_same_session_gives_the_same_bytes(session, page):
    again = report_page(Asked((NAME,), opened=session))
    assert html_of(again) == html_of(page)


def test_a_session_that_cannot_be_used_gets_a_page_that_says_so(session, tmp_path, capsys):
    turned = replace(session, force=-session.force)
    ai.write_recording(turned, tmp_path / "turned")
    out = tmp_path / "page.html"
    assert main(["report", str(tmp_path / "turned"), "--out", str(out)]) == 2
    assert "force sign" in capsys.readouterr().out
    text = out.read_text()
    assert "Cannot be used" in text
    assert "K_11" not in text


@pytest.mark.usefixtures("undrawn")
def test_overruled_checks_are_warnings_and_methods_stand_side_by_side_where_asked(session):
    turned = replace(session, force=-session.force)
    asked = Asked((NAME,), opened=turned, method="all", despite=("force sign", "units"))
    page = report_page(asked)
    assert page.verdict.state != "ok"
    assert "force sign" in page.verdict.wrong
    assert "Methods side by side" in [section.title for section in page.reviewer]


def test_a_table_of_results_is_reported_without_its_trials(session, tmp_path):
    ai.estimate(session).write(tmp_path / "hand.csv")
    out = tmp_path / "page.html"
    assert main(["report", str(tmp_path / "hand.csv"), "--out", str(out)]) == 0
    text = out.read_text()
    assert len(text) < 1.6e6
    assert re.search("SHA-256 of hand.csv", text)


def test_the_points_of_a_picture_stand_beside_it(parsed):
    points = pd.DataFrame(parsed.data("fit"))
    assert {"measured", "fitted"} <= set(points["line"])
    measured, fitted = (points[points["line"] == name]["y"] for name in ("measured", "fitted"))
    # the fit explains most of the force, in newtons
    assert np.abs(measured).max() > 0.5
    assert np.std(np.array(measured) - np.array(fitted)) < 0.5 * np.std(measured)


@pytest.mark.study
def test_conditions_of_one_direction_can_be_grouped_by_another_column(session):
    trials = session.trials.assign(condition=session.trials["direction_deg"].astype(str))
    of_directions = _with(session, trials)
    assert report_page(Asked((Path("a"),), opened=of_directions)).verdict.state == "unusable"
    page = report_page(Asked((Path("a"),), opened=of_directions, by=("experiment",)))
    assert page.verdict.state != "unusable"
    assert len(page.data["results"]) == 1


def test_the_groups_of_a_session_are_compared_on_its_page(session, page):
    [table] = next(s for s in page.reader if s.title == "What differs").blocks
    [row] = table.rows
    [pair] = ai.compare(ai.estimate(session)).pairs
    assert row[0] == " | ".join(CONDITIONS)
    assert float(row[1]) == pytest.approx(
        pair.tests[3].p_t2_adjusted, rel=0.15
    )  # one digit is shown
    size = next(c for c in pair.changes if (c.matrix, c.quantity) == ("stiffness", "size"))
    assert size.low <= float(row[3].split()[0]) <= size.high


@pytest.mark.study
def test_one_group_is_compared_with_nothing(session):
    one = session.select((session.trials["condition"] == CONDITIONS[0]).to_numpy())
    page = report_page(Asked((NAME,), opened=one))
    assert "What differs" not in [section.title for section in page.reader]


@pytest.mark.study
def test_checks_stand_in_the_order_of_their_weight(session):
    turned = replace(session, force=-session.force)
    page = report_page(Asked((Path("turned"),), opened=turned, despite=("force sign", "units")))
    order = ("unusable", "warning", "cannot tell", "missing", "ok")
    [checks] = next(s for s in page.reviewer if s.title == "Checks").blocks
    ranks = [order.index(finding.verdict) for finding in checks.findings]
    assert ranks == sorted(ranks)
    assert len(set(ranks)) > 1


@pytest.mark.study
def test_linked_pictures_are_vega_lite(page):
    """They are built without a check of their parts; the schema of the whole says as much."""
    import altair as alt
    from jsonschema import ValidationError

    sections = (*page.reader, *page.reviewer)
    linked = [block for one in sections for block in one.blocks if hasattr(block, "spec")]
    assert {one.name for one in linked} == {"ellipses_and_numbers", "trials"}
    for one in linked:
        alt.Chart.from_dict(dict(one.spec))
        with pytest.raises(ValidationError):
            alt.Chart.from_dict({**one.spec, "config": 42})


def test_the_pages_library_is_as_published_and_of_the_version_that_the_pictures_are_written_in():
    """Its checksums stand beside the licences of what it holds; altair says which one it writes."""
    import altair as alt

    folder = files("armimpedance.show.pages") / "assets/vega"
    rows = re.findall(
        r"^([\w-]+) (\d+)\.(\S+)  sha256 (\w+)$", (folder / "LICENSES.txt").read_text(), re.M
    )
    assert [f"vega/{name}.min.js" for name, *_ in rows] == list(VEGA)
    for name, *_, checksum in rows:
        assert sha256((folder / f"{name}.min.js").read_bytes()).hexdigest() == checksum
    majors = {name: major for name, major, *_ in rows}
    assert alt.SCHEMA_VERSION.startswith(f"v{majors['vega-lite']}.")
