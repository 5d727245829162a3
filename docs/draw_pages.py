"""Take the pictures of the pages that the docs show, in the browser of the browser tests.

make test-browser            installs the browser where it is missing
python docs/draw_pages.py
"""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from playwright.sync_api import Browser, sync_playwright

import armimpedance as ai
from armimpedance.__main__ import main as main_of_the_package
from armimpedance.hand.still.show import write_choice
from armimpedance.muscles.show import write_explore
from manipulandum_sim.hand import simulate

DOCS = Path(__file__).resolve().parent
sys.path.append(str(DOCS.parent / "tests" / "browser"))
from set_up import chromium_file  # noqa: E402

GALLERY = DOCS / "gallery"
#: Size of the window, CSS pixels: what a reader sees first.
WINDOW = {"width": 1120, "height": 900}


def main() -> int:
    """Write the pages to a temporary folder and photograph them."""
    recording, _ = simulate("postures", seed=1997, sets=2)
    hand = ai.estimate(recording)
    model = ai.fit_posture(ai.to_joint(hand, recording=recording))
    with TemporaryDirectory() as folder, sync_playwright() as playwright:
        ai.write_report(recording, Path(folder) / "report_page.html")
        explored = Path(folder) / "explore_page.html"
        write_explore([model, hand], explored, recording=recording.subject)
        write_choice(recording, Path(folder) / "trials_page.html", "postures")
        browser = playwright.chromium.launch(executable_path=chromium_file(), args=["--no-sandbox"])
        for page in sorted(Path(folder).glob("*.html")):
            photograph(browser, page, GALLERY / f"{page.stem}.png")
            print(GALLERY / f"{page.stem}.png")
        photograph_app(browser, Path(folder), GALLERY / "app_page.png")
    return 0


def photograph(browser: Browser, page: Path, picture: Path) -> None:
    """A picture of the top of a page, once it has drawn itself."""
    window = browser.new_page(viewport=WINDOW)
    window.goto(page.as_uri())
    window.wait_for_selector("body[data-ready]")
    window.screenshot(path=picture)
    window.close()


def photograph_app(browser: Browser, folder: Path, picture: Path) -> None:
    """The page to work in, with an exam that was opened and estimated."""
    main_of_the_package(["new", "--for", "kinarm", str(folder / "kinarm")])
    exam = folder / "kinarm" / "exam.kinarm"
    command = [sys.executable, "-m", "armimpedance", "app", str(exam), "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as served:  # noqa: S603
        address = next(line.strip() for line in served.stdout or () if "http" in line)
        window = browser.new_page(viewport={**WINDOW, "height": 2400}, device_scale_factor=0.8)
        window.goto(address)
        window.get_by_role("button", name="Estimate", exact=True).click()
        window.get_by_text("Report", exact=True).wait_for()
        window.screenshot(path=picture)
        served.send_signal(signal.SIGINT)


if __name__ == "__main__":
    sys.exit(main())
