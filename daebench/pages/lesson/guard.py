"""The layer around the server of a lesson: it answers those who have the token and come from this machine, and a few pages at a time.

marimo has a token of its own, and no check of Host: a page of another site whose name is made to point to 127.0.0.1 (DNS rebinding)
would be answered. Its cookie goes to every other server on 127.0.0.1 besides, for cookies know no ports. So the token is the first part of
every path, of pages, files and websockets alike, and no cookie is set.
"""

import secrets
import time
from collections.abc import Awaitable, Callable, Iterable, Iterator, MutableMapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import parse_qs

HOST = "127.0.0.1"
NAMES = (HOST, "localhost")

MOST = 8
"""Pages that may be open at a time: each has a kernel of marimo, with all that the lesson has prepared."""

LINGERS = 30
"""Seconds for which the kernel of a closed page waits for it to come back, and for which it is counted."""

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]


@dataclass(frozen=True)
class Address:
    """Where a lesson is served.

    Parameters
    ----------
    port : int
        Port of the loopback address.
    token : str
        Secret part of the address.
    """

    port: int
    token: str = field(default_factory=lambda: secrets.token_urlsafe(24), repr=False)

    @property
    def root(self) -> str:
        """First part of every path."""
        return f"/{self.token}/"

    @property
    def url(self) -> str:
        """Address to open in the browser."""
        return f"http://{HOST}:{self.port}{self.root}"

    @property
    def hosts(self) -> tuple[str, ...]:
        """What a browser on this machine may send as Host."""
        return tuple(f"{name}:{self.port}" for name in NAMES) + (NAMES if self.port == 80 else ())


class Pages:
    """The pages that are open, by their session, and those that were closed a moment ago.

    Parameters
    ----------
    clock : callable
        Returns the time, s.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.clock, self.connections, self.closed = clock, dict[str, int](), dict[str, float]()

    def has_room(self, session: str | None = None) -> bool:
        """Return whether one more page may be open, or this one, which has been open already."""
        now = self.clock()
        self.closed = {name: end for name, end in self.closed.items() if end + LINGERS > now}
        counted = {*self.connections, *self.closed}
        return session in counted or len(counted) < MOST

    @contextmanager
    def open(self, session: str) -> Iterator[None]:
        """Count a page for the time of a block; its session may have several connections, one of which is about to end."""
        self.connections[session] = self.connections.get(session, 0) + 1
        try:
            yield
        finally:
            self.connections[session] -= 1
            if not self.connections[session]:
                del self.connections[session]
                self.closed[session] = self.clock()


class Guard:
    """The server of a lesson behind its checks, as an ASGI application.

    Parameters
    ----------
    app : callable
        The server, mounted at the root of the address.
    address : Address
        Where it is served.
    """

    def __init__(self, app: App, address: Address) -> None:
        self.app, self.address, self.pages = app, address, Pages()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request or a handshake, or refuse it with a sentence."""
        if why := refusal(scope, self.address):
            return await _refuse(scope, send, 403, why)
        if scope["path"] not in (self.address.root, *_connections(self.address)):
            return await self.app(scope, receive, send)
        session = parse_qs(scope["query_string"].decode("latin-1")).get("session_id", [None])[0]
        if not self.pages.has_room(session):
            return await _refuse(scope, send, 503, f"This lesson has {MOST} pages open; close one, wait {LINGERS} s and reload.")
        if scope["path"] == self.address.root:
            return await self.app(scope, receive, send)
        with self.pages.open(session or ""):
            return await self.app(scope, receive, send)


def refusal(scope: Scope, address: Address) -> str | None:
    """Return why a request is refused: by its Host, its Origin, or the token at the beginning of its path; None if it is not."""
    host, origin = _values(scope["headers"], b"host"), _values(scope["headers"], b"origin")
    if len(host) != 1 or host[0] not in address.hosts:
        return f"This lesson is only for this machine: open it at {HOST}:{address.port}, and not under another name."
    socket = scope["type"] == "websocket"
    if origin != [f"http://{host[0]}"] and (origin or socket):  # every browser names the origin of a handshake
        return "Pages from other sites may not send requests to this lesson."
    root, path = address.root.encode(), scope["path"].encode("utf-8", "surrogatepass")
    if not secrets.compare_digest(path[: len(root)], root):
        return "Open this lesson by the whole address that daebench printed: it contains a token, which is new at each start."
    if socket and scope["path"] not in _connections(address):
        return "This lesson has no such connection."
    return None


def _connections(address: Address) -> tuple[str, ...]:
    """Return the paths at which marimo makes a session: a websocket, or a stream of events in its place."""
    return (f"{address.root}ws", f"{address.root}sse")


def _values(headers: Iterable[tuple[bytes, bytes]], name: bytes) -> list[str]:
    return [value.decode("latin-1").lower() for key, value in headers if key == name]


async def _refuse(scope: Scope, send: Send, status: int, why: str) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 1008, "reason": why})
        return
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"cache-control", b"no-store")]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": f"{why}\n".encode()})
