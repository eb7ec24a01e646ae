"""A lesson in the browser: marimo's server on this machine's own address, and on no other."""

import os
import socket
import subprocess
import sys
from pathlib import Path

from daebench.errors import BadInput, DaebenchError, unknown
from daebench.lesson.installed import require_marimo

HOST = "127.0.0.1"


def command(name: str, port: int, *, browser: bool) -> list[str]:
    """Return what starts marimo with a lesson: read-only, on the loopback address, and silent towards the network."""
    file = Path(__file__).parents[1] / "reports" / "lessons" / f"{name.replace('-', '_')}.py"
    start = [sys.executable, "-m", "marimo", "--quiet", "--yes", "run", str(file), "--host", HOST, "--port", str(port), "--no-sandbox"]
    return start if browser else [*start, "--headless"]


def free_port(port: int | None) -> int:
    """Return a port of the loopback address that nobody listens on: the one asked for, or any.

    Raises
    ------
    BadInput
        If the one asked for is no port, or is taken.
    """
    if port is not None and not 1 <= port <= 65535:
        raise BadInput(f"port = {port} must be from 1 to 65535.")
    with socket.socket() as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((HOST, port or 0))
        except OSError as error:
            raise BadInput(f"port {port} of {HOST} cannot be used ({error.strerror}); give another --port, or leave it out.") from error
        return int(listener.getsockname()[1])


def serve(name: str, port: int | None = None, *, browser: bool = True) -> None:
    """Serve a lesson until it is interrupted.

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
        If there is no such lesson, marimo is not installed, or the port cannot be used.
    DaebenchError
        If marimo ends by itself.
    """
    from daebench.catalogue import lessons

    if name not in lessons():
        raise unknown("lesson", name, lessons())
    require_marimo()
    port = free_port(port)
    print(f"lesson {name}: http://{HOST}:{port}, until Ctrl-C", flush=True)
    environment = os.environ | {"MARIMO_SKIP_UPDATE_CHECK": "1", "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    with subprocess.Popen(command(name, port, browser=browser), env=environment) as process:
        try:
            status = process.wait()
        except KeyboardInterrupt:
            process.terminate()
            return
    if status:
        raise DaebenchError(f"marimo ended with status {status}; what it said stands above.")
