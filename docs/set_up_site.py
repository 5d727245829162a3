"""Tell the environment of the site where the project's lies: it sees all that is installed there.

So the site's own packages stay out of the environment that the tests run in, and nothing is
installed twice.
"""

from __future__ import annotations

import sys
import sysconfig
from pathlib import Path


def main(project: str) -> None:
    """Write the path of the other environment's packages where this one finds it."""
    packages = Path(sysconfig.get_path("purelib"))
    other = Path(project).resolve() / packages.relative_to(sys.prefix)
    # `addsitedir` reads the other's .pth files too: the project itself is installed by one.
    (packages / "project.pth").write_text(f"import site; site.addsitedir({str(other)!r})\n")


if __name__ == "__main__":
    main(sys.argv[1])
