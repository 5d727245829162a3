"""The page to work in: an exam, or a log, becomes a report and a script by clicks alone."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import urllib.error
import urllib.request

import numpy as np
import pandas as pd
import pytest
from conftest import HOSTILE

from armimpedance.lab.parts.starter import write_form
from manipulandum_sim.hand import simulate

PATIENCE_MS = 120_000
NAMES = ["cocontraction_00", "cocontraction_30"]


@pytest.fixture(scope="module")
def simulated():
    """A session of two conditions, and its truth."""
    return simulate("cocontraction", seed=4, sets=1, conditions=NAMES)


@pytest.fixture(scope="module")
def exam(simulated, tmp_path_factory):
    """A Kinarm exam, as the robot's computer keeps it."""
    folder = tmp_path_factory.mktemp("kinarm")
    write_form("kinarm", *simulated, folder)
    return folder / "exam.kinarm"


@pytest.fixture(scope="module")
def log(simulated, tmp_path_factory):
    """A robot's log of two conditions, one of a hostile name, with units in its header."""
    recording, _ = simulated
    parts = []
    for i, (first, last) in enumerate(zip(recording.offsets, recording.offsets[1:], strict=False)):
        rows = slice(first, last)
        place, force = 1e3 * recording.position[rows], recording.force[rows]
        time = 1e3 * (recording.time_s[rows] - recording.time_s[first])
        named = HOSTILE if recording.trials["condition"][i] == NAMES[0] else "stiff"
        columns = {"Time (ms)": time, "HandX (mm)": place[:, 0], "HandY (mm)": place[:, 1]}
        columns |= {"Fx (N)": force[:, 0], "Fy (N)": force[:, 1]}
        parts.append(pd.DataFrame({"Trial": i + 1, "Cond": named, **columns}).round(4))
    path = tmp_path_factory.mktemp("log") / "log.csv"
    pd.concat(parts).to_csv(path, index=False)
    return path


@pytest.fixture(scope="module")
def serve():
    """Start the command on a path; its address. All end with the last test."""
    running = []

    def start(path):
        command = [sys.executable, "-m", "armimpedance", "app", str(path), "--no-browser"]
        running.append(
            subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True)
        )
        lines = (running[-1].stdout.readline() for _ in range(3))
        return next(filter(None, (re.search(r"http\S+", line) for line in lines)))[0]

    yield start
    for process in running:
        process.send_signal(signal.SIGINT)
    for process in running:
        assert process.wait(30) == 0
        process.stdout.close()


@pytest.fixture(scope="module")
def address(exam, serve):
    """Where the exam is served to all tests that look at it."""
    return serve(exam)


@pytest.fixture
def visited(chromium):
    """Open an address: its page, what it asked for, what it wanted to say in a window."""
    contexts = []

    def visit(address, **options):
        context = chromium.new_context(viewport={"width": 1100, "height": 3000}, **options)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(PATIENCE_MS)
        asked, dialogs = [], []
        page.on("request", lambda request: asked.append(request.url))
        page.on("dialog", lambda dialog: (dialogs.append(dialog.message), dialog.dismiss()))
        page.goto(address)
        return page, asked, dialogs

    yield visit
    for context in contexts:
        context.close()


def _save(page, label, path):
    with page.expect_download() as saved:
        page.get_by_text(label, exact=True).click()
    saved.value.save_as(path)
    return path


def _estimate(page):
    page.get_by_role("button", name="Estimate", exact=True).click()
    page.get_by_text("Report", exact=True).wait_for()


def test_from_an_exam_to_its_report_and_a_script_that_does_the_same(address, visited, tmp_path):
    page, asked, _ = visited(address)
    page.get_by_text("16 trials", exact=True).last.click()
    page.get_by_role("checkbox", name=re.compile("select row", re.I)).nth(1).click()
    _estimate(page)
    page.get_by_role("button", name="Compare the groups").click()
    differences = _save(page, "Differences (.csv)", tmp_path / "clicked.csv")
    hand = _save(page, "Table (.csv)", tmp_path / "hand_clicked.csv")
    report = _save(page, "Report", tmp_path / "report_clicked.html")
    script = _save(page, "Script (.py)", tmp_path / "analysis.py")
    assert "trial not in (2,)" in report.read_text()
    assert "trial not in (2,)" in script.read_text()
    subprocess.run([sys.executable, script.name], cwd=tmp_path, check=True, capture_output=True)
    assert (tmp_path / "hand.csv").read_bytes() == hand.read_bytes()
    assert (tmp_path / "differences.csv").read_bytes() == differences.read_bytes()
    assert [url for url in asked if "//127.0.0.1:" not in url and not _own(url)] == []


def _own(url):
    return url.startswith(("data:", "blob:"))


def test_a_table_asks_whose_force_it_holds_and_its_names_are_text(log, serve, visited, tmp_path):
    page, _, dialogs = visited(serve(log))
    page.get_by_label("Whose force the columns hold").select_option("the limb's, on the device")
    _estimate(page)
    rows = pd.read_csv(_save(page, "Table (.csv)", tmp_path / "hand.csv"))
    _save(page, "Mapping (columns.toml)", tmp_path / "columns.toml")
    script = _save(page, "Script (.py)", tmp_path / "analysis.py")
    subprocess.run([sys.executable, script.name], cwd=tmp_path, check=True, capture_output=True)
    again = pd.read_csv(tmp_path / "hand.csv")
    assert set(rows["condition"]) == {HOSTILE, "stiff"}
    np.testing.assert_array_equal(rows["K_11"], again["K_11"])
    assert dialogs == []


def test_what_cannot_be_read_is_one_line_and_the_page_goes_on(serve, visited, tmp_path):
    broken = tmp_path / "broken.csv"
    broken.write_text("a,b\n1,x\n")
    page, _, _ = visited(serve(broken))
    page.get_by_text("no recording of a known format").or_(
        page.get_by_text(re.compile("broken.csv.*expected", re.S))
    ).first.wait_for()
    assert page.get_by_role("button", name="Estimate", exact=True).count() == 0
    assert page.get_by_text("Traceback").count() == 0


def _answer(address, **headers):
    """The status of an answer, where it came from, and its text."""
    asked = urllib.request.Request(address, headers=headers)  # noqa: S310 - of this machine
    try:
        with urllib.request.urlopen(asked) as answer:  # noqa: S310
            return answer.status, answer.url, answer.read().decode()
    except urllib.error.HTTPError as refused:
        return refused.code, refused.url, refused.read().decode()


def test_without_the_token_there_is_nothing(address):
    place = address.partition("?")[0]
    for words in ("", "?access_token=wrong", "?path=/etc", "api/status", "sse", "@file/1-a.png"):
        status, url, text = _answer(place + words)
        assert status in (401, 404) or "/auth/login" in url or "UNAUTHORIZED" in text
        assert "exam" not in text


def test_only_its_own_address_is_answered(address):
    assert _answer(address)[0] == 200
    for headers in ({"Origin": "http://127.0.0.1:9"}, {"Host": "evil.example"}):
        assert _answer(address, **headers)[0] == 403


def test_a_browser_without_the_token_is_not_connected(address, chromium):
    place = address.partition("?")[0]
    page = chromium.new_context().new_page()
    page.goto(place + "auth/login")
    closed = page.evaluate(
        "url => new Promise(done => { const s = new WebSocket(url);"
        " s.onclose = () => done('closed'); s.onmessage = (m) => done(m.data); })",
        place.replace("http", "ws") + "ws?session_id=s_abcdef",
    )
    assert closed == "closed"


@pytest.mark.skipif(os.name != "posix", reason="rights of files as POSIX has them")
def test_the_browser_is_led_by_a_file_that_only_the_user_reads(monkeypatch, tmp_path):
    from armimpedance.app.interactive import serving

    opened = []
    monkeypatch.setattr(serving.webbrowser, "open", opened.append)
    with serving.browsing("http://127.0.0.1:1/?access_token=secret", browse=True):
        [uri] = opened
        assert "secret" not in uri
        folder = os.path.dirname(uri.removeprefix("file://"))
        assert os.stat(folder).st_mode & 0o077 == 0
