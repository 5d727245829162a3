"""Serve the page on this machine only, to whoever holds its token."""

from __future__ import annotations

import html
import os
import secrets
import socket
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

from armimpedance.core.errors import InputError

if TYPE_CHECKING:
    import uvicorn

#: The page is never offered to a network.
_HERE: Final = "127.0.0.1"
_PAGE: Final = Path(__file__).with_name("notebook.py")


def listen(port: int) -> socket.socket:
    """A socket of this machine's own; 0: of any free port.

    Raises InputError: the port is taken, or not this user's to take.
    """
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    if os.name == "posix":  # elsewhere it would take a port from whoever has it
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((_HERE, port))
        listening.listen()  # a browser that comes early waits
    except (OSError, OverflowError):
        listening.close()
        raise InputError(f"port {port} cannot be used", expected="a free one, or 0") from None
    return listening


def address_of(listening: socket.socket) -> str:
    """Address of the page, without a token."""
    return f"http://{_HERE}:{listening.getsockname()[1]}"


def opening(address: str, token: str, path: Path) -> str:
    """Address that a browser opens, with the token and the path."""
    return f"{address}/?{urlencode({'access_token': token, 'path': str(path.absolute())})}"


def new_token() -> str:
    """A word that nobody guesses; it is held in memory, never in the list of processes."""
    return secrets.token_urlsafe(24)


def server_of(address: str, token: str) -> uvicorn.Server:
    """The server of the page: it answers its own address only, and holders of the token."""
    import marimo
    import uvicorn

    pages_made: list[Any] = []

    def taking(page: Any) -> Any:
        pages_made.append(page)
        return page

    pages: Any = marimo.create_asgi_app(quiet=True, token=token)
    pages.with_app(path="/", root=str(_PAGE), middleware=[taking]).build()
    [page] = pages_made
    own = OwnAddressOnly(page, address)
    return uvicorn.Server(uvicorn.Config(own, log_level="error", timeout_graceful_shutdown=2))


class OwnAddressOnly:
    """Let through what a browser asks from the page's own address.

    A cookie goes to every port of this machine, and the page's library answers pages of any origin:
    a page that another user of the machine serves could ask in this user's name.

    `page`: the ASGI application.
    `address`: of the page.
    """

    def __init__(self, page: Any, address: str) -> None:
        self._page = page
        self._address = address

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Pass on, or refuse with 403."""
        if scope["type"] == "lifespan":
            await self._until_the_end(receive, send)
        elif self._is_own(dict(scope["headers"])):
            await self._page(scope, receive, send)
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
        else:
            await send({"type": "http.response.start", "status": 403, "headers": []})
            await send({"type": "http.response.body", "body": b"another origin"})

    async def _until_the_end(self, receive: Any, send: Any) -> None:
        """Close every visit when the server ends: each has a thread, and a folder of its own."""
        await receive()
        await send({"type": "lifespan.startup.complete"})
        await receive()
        await self._page.state.session_manager.shutdown()
        await send({"type": "lifespan.shutdown.complete"})

    def _is_own(self, headers: dict[bytes, bytes]) -> bool:
        host, origin = headers.get(b"host", b""), headers.get(b"origin")
        own = self._address.encode()
        return b"http://" + host == own and origin in (None, own)


@contextmanager
def browsing(address: str, browse: bool) -> Iterator[None]:
    """Open the address in the user's browser, while the block serves it.

    A browser is started with what it opens in its command line, which every user of the machine
    can read. So it is given a file that only this user can read, which leads on.
    """
    if not browse:
        yield
        return
    with TemporaryDirectory() as folder:
        file = Path(folder, "open.html")
        file.write_text(f'<meta http-equiv="refresh" content="0; url={html.escape(address)}">')
        webbrowser.open(file.as_uri())
        yield


@contextmanager
def ended_by_the_user() -> Iterator[None]:
    """Ctrl-C is how a page is closed, and no failure; a signal of the system stays one."""
    try:
        yield
    except KeyboardInterrupt as ended:
        if type(ended) is not KeyboardInterrupt:
            raise
