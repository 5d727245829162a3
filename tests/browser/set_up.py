"""Install what the browser tests need and is missing: Playwright, axe-core, Chromium.

Playwright drives the system's Chromium; axe-core, which judges accessibility, is a file of the npm
package of that name. Both go into the virtual environment.
"""

from __future__ import annotations

import hashlib
import shutil
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
AXE = "axe-core@4.14.1"
#: SHA-256 of its package.
AXE_SUM = "e6b0ce02b84d892e2e33e403485e7f3d6c29e2be6df65daf44d89ba564139745"
#: Where the tests find it.
AXE_FILE = Path(sys.prefix) / "axe.min.js"


def main() -> None:
    """Install what is missing; whatever fails ends with its own message."""
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    _run(*pip, "--require-hashes", "-r", str(HERE / "requirements.txt"))
    if not AXE_FILE.exists():
        _axe()
    if chromium_file() is None:
        _run("apt-get", "update", "-qq")
        _run("apt-get", "install", "-y", "-qq", "--no-install-recommends", "chromium")


def chromium_file() -> str | None:
    """The system's Chromium."""
    names = ("chromium", "chromium-browser", "google-chrome")
    return next(filter(None, map(shutil.which, names)), None)


def _axe() -> None:
    with tempfile.TemporaryDirectory() as folder:
        _run("npm", "pack", "--silent", AXE, cwd=folder)
        [package] = Path(folder).glob("*.tgz")
        if hashlib.sha256(package.read_bytes()).hexdigest() != AXE_SUM:
            raise SystemExit(f"{AXE} is not the file that was tested")
        with tarfile.open(package) as archive:
            source = archive.extractfile("package/axe.min.js")
            if source is None:
                raise SystemExit(f"{AXE} holds no axe.min.js")
            AXE_FILE.write_bytes(source.read())


def _run(*command: str, cwd: str | None = None) -> None:
    subprocess.run(command, check=True, cwd=cwd)


if __name__ == "__main__":
    main()
