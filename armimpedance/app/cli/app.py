"""A page to work in, without programming: choose, look, estimate, compare, save.

Examples:
  armimpedance app
  armimpedance app exam.kinarm
  armimpedance app recordings --port 8000 --no-browser

The page opens in the browser: choose a file, answer what the file does not say, see its trials and
checks, choose conditions and what to leave out, estimate, compare, and save the table, the figure,
the report and a script that does the same. It is served to this machine only, and to nobody who
does not hold the token of its address. It sends nothing to any network, and writes nothing beside
your files: what you save goes where your browser saves. Ctrl-C ends it.

It needs: pip install 'armimpedance[app]'
"""

from __future__ import annotations

import argparse
from pathlib import Path


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "path",
        nargs="?",
        type=Path,
        default=Path(),
        metavar="PATH",
        help="a recording, or the folder where files are chosen (default: this folder)",
    )
    parser.add_argument(
        "--port", type=int, default=0, metavar="N", help="of this machine (default: a free one)"
    )
    parser.add_argument(
        "--no-browser", action="store_true", help="show the address only, open no browser"
    )


def run(arguments: argparse.Namespace) -> int:
    """Serve until the command is ended."""
    from armimpedance.app.interactive.serving import (
        address_of,
        browsing,
        ended_by_the_user,
        listen,
        new_token,
        opening,
        server_of,
    )
    from armimpedance.core.errors import InputError

    if not arguments.path.exists():
        raise InputError(
            "no such file or folder", file=arguments.path, expected="a recording or a folder"
        )
    with listen(arguments.port) as listening:
        address, token = address_of(listening), new_token()
        server = server_of(address, token)
        opened = opening(address, token, arguments.path)
        print(f"For this machine only:\n  {opened}\nCtrl-C ends it.", flush=True)
        with browsing(opened, not arguments.no_browser), ended_by_the_user():
            server.run(sockets=[listening])
    return 0
