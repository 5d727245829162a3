"""``python -m armimpedance`` and the console script; standard library only until a command runs."""

from __future__ import annotations

import sys


def main(argv: list[str] | None = None) -> int:
    """Run the command line and return its exit status (0, 1 or 2)."""
    from armimpedance.cli.main import run

    return run(sys.argv[1:] if argv is None else argv)


if __name__ == "__main__":
    sys.exit(main())
