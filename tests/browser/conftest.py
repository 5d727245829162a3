"""A real browser, and pages that are opened in it with everything that it says written down."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, sync_playwright
from set_up import AXE_FILE, chromium_file

from armimpedance.app.report.write import report_page
from armimpedance.show.pages.asked import Asked
from armimpedance.show.pages.rendering import write_page
from manipulandum_sim.hand import simulate

HOSTILE = '<img src=x onerror="alert(1)"> & $x_1$ =1+1'


@dataclass
class Seen:
    """A page and what the browser said of it."""

    page: Page
    console: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)
    dialogs: list[str] = field(default_factory=list)

    @property
    def beyond_the_file(self):
        return [url for url in self.requests if not url.startswith(("file:", "data:", "blob:"))]


def violations(page):
    """What axe finds wrong with a page as it is now; what it finds right is not written down."""
    if not page.evaluate("'axe' in window"):
        page.evaluate(AXE_FILE.read_text())
    return page.evaluate("axe.run({ resultTypes: ['violations'] }).then((done) => done.violations)")


@pytest.fixture(scope="session")
def chromium():
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium_file(), args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture
def opened(chromium):
    """Open a file: ``opened(path, dark=False)``."""
    contexts = []

    def call(path, *, dark=False, width=1100):
        context = chromium.new_context(
            color_scheme="dark" if dark else "light", viewport={"width": width, "height": 900}
        )
        contexts.append(context)
        page = context.new_page()
        seen = Seen(page)
        page.on("console", lambda message: seen.console.append(message.text))
        page.on("pageerror", lambda error: seen.console.append(str(error)))
        page.on("request", lambda request: seen.requests.append(request.url))
        page.on("dialog", lambda dialog: (seen.dialogs.append(dialog.message), dialog.dismiss()))
        page.goto(Path(path).absolute().as_uri())
        page.wait_for_selector("body[data-ready]")
        return seen

    yield call
    for context in contexts:
        context.close()


@pytest.fixture(scope="session")
def report(tmp_path_factory):
    """The page of a session of two groups, one of a hostile name."""
    names = ["cocontraction_00", "cocontraction_30"]
    recording, _ = simulate("cocontraction", seed=5, sets=2, conditions=names)
    condition = np.where(recording.trials["condition"] == names[0], HOSTILE, "stiff")
    recording = replace(recording, trials=recording.trials.assign(condition=condition))
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_page(report_page(Asked((Path("session"),), opened=recording)), path)
    return path
