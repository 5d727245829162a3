"""Install what the office tests need and is missing: LibreOffice's Calc and Octave."""

from __future__ import annotations

import os
import shutil
import subprocess

#: Program -> package of Debian and Ubuntu that brings it.
NEEDED = {"soffice": "libreoffice-calc", "octave-cli": "octave"}


def main() -> None:
    """Install what is missing, or end with what to install where that cannot be done here."""
    missing = [package for program, package in NEEDED.items() if shutil.which(program) is None]
    if not missing:
        return
    if shutil.which("apt-get") is None or os.geteuid() != 0:
        raise SystemExit(f"office tests: install {' and '.join(missing)}, or run this as root")
    quiet = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    for command in (["update"], ["install", "-y", "--no-install-recommends", *missing]):
        subprocess.run(["apt-get", command[0], "-qq", *command[1:]], check=True, env=quiet)


if __name__ == "__main__":
    main()
