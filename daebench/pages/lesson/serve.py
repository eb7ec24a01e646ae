"""A lesson in the browser: marimo's server on this machine's own address, behind a token, for as long as the command runs."""

import os
import signal
import socket
import threading
import time
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager

from daebench.errors import BadInput
from daebench.pages.lesson.guard import HOST, LINGERS, Address, Guard
from daebench.pages.lesson.installed import require_lesson
from daebench.systems.files.package import folder

LOOKS = 0.5
"""Seconds between two looks at whether the parent is there."""


def serve(name: str, port: int | None = None, *, browser: bool = True) -> None:
    """Serve a lesson until it is interrupted, in this process: no signal can leave a part of it behind.

    Parameters
    ----------
    name : str
        Name as ``daebench list lessons`` has it.
    port : int, optional
        Port of the loopback address; by default any that is free.
    browser : bool
        Whether the browser is opened.

    Raises
    ------
    BadInput
        If the lesson does not exist, marimo is not installed, or the port cannot be used.
    """
    require_lesson(name)
    with listener(port) as bound:
        address = Address(int(bound.getsockname()[1]))
        app = application(name, address)
        end_with_interrupt()
        end_with_parent()
        print(f"lesson {name}: {address.url}, until Ctrl-C", flush=True)
        if browser:
            threading.Thread(target=webbrowser.open, args=(address.url,), daemon=True).start()
        run(app, bound)


@contextmanager
def listener(port: int | None) -> Iterator[socket.socket]:
    """Listen on a port of the loopback address during a block: the requested port, or any.

    Raises
    ------
    BadInput
        If the requested port is not valid, or is in use.
    """
    if port is not None and not 1 <= port <= 65535:
        raise BadInput(f"port = {port} must be from 1 to 65535.")
    with socket.socket() as bound:
        if os.name == "posix":  # elsewhere it would let two programs have one port
            bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            bound.bind((HOST, port or 0))
            bound.listen()
        except OSError as error:
            raise BadInput(f"port {port} of {HOST} cannot be used ({error.strerror}); give another --port, or leave it out.") from error
        yield bound


def application(name: str, address: Address) -> Guard:
    """Return the server of a lesson: read-only, without its code, and behind the checks of :class:`daebench.pages.lesson.guard.Guard`."""
    import marimo

    file = folder("daebench.reports.lessons") / f"{name.replace('-', '_')}.py"
    builder = marimo.create_asgi_app(quiet=True, include_code=False, session_ttl=LINGERS)
    return Guard(builder.with_app(path=address.root.rstrip("/"), root=str(file)).build(), address)


def run(app: Guard, bound: socket.socket) -> None:
    """Answer on a socket until a signal ends the process: there is nothing to save, and nothing is waited for.

    The shutdown of the server waits for its pages, and for the threads in which their kernels compute.
    """
    import uvicorn

    class Server(uvicorn.Server):
        @contextmanager
        def capture_signals(self) -> Iterator[None]:
            yield

    Server(uvicorn.Config(app, log_level="critical", lifespan="off", proxy_headers=False, server_header=False)).run(sockets=[bound])


def end_with_interrupt() -> None:
    """End this process with status 0 at Ctrl-C, which is how a lesson ends; where it is ignored, as in the background, it stays so."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, lambda number, frame: os._exit(0))


def end_with_parent() -> None:
    """End this process once the one that started it has ended, unless it is told to outlive that, as by nohup."""
    if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
        return
    parent = os.getppid()

    def look() -> None:
        while os.getppid() == parent:
            time.sleep(LOOKS)
        os._exit(1)

    threading.Thread(target=look, daemon=True).start()
