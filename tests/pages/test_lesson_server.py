"""The server of a lesson: who is answered, how many pages may be open, and that no signal leaves it behind."""

import http.client
import os
import re
import select
import signal
import socket
import subprocess
import sys
import time
from contextlib import closing, contextmanager, suppress
from pathlib import Path

import pytest

from daebench.errors import BadInput
from daebench.pages.lesson.guard import LINGERS, MOST, Address, Pages, refusal
from daebench.pages.lesson.serve import HOST, listener

ROOT = Path(__file__).parents[2]
NAME = "why-symplectic"
STARTED = 120.0
"""Seconds that a server may take to start on a busy machine."""
GONE = 10.0
"""Seconds in which no process is left."""

STRANGE_HOSTS = ("evil.example", "evil.example:{port}", "127.0.0.1", "127.0.0.1:1", "localhost", "[::1]:{port}", "0.0.0.0:{port}", "")
STRANGE_HOSTS += ("127.0.0.1.evil.example:{port}", "127.0.0.1:{port}@evil.example", "127.1:{port}", "localhost.:{port}")
STRANGE_ORIGINS = ("http://evil.example", "https://127.0.0.1:{port}", "http://127.0.0.1", "http://127.0.0.1:1", "null", "file://", "")
STRANGE_ORIGINS += ("http://localhost:{port}", "http://127.0.0.1:{port}.evil.example", "http://127.0.0.1:{port}/")
STRANGE_PATHS = ("/", "/ws", "/{short}/", "/{token}x/", "/{upper}/", "//{token}/", "/?token={token}", "/assets/", "/health", "/{token}")


def listening():
    """Take signals as a command at a terminal does: tests may run in the background or under nohup, where some are ignored."""
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


@contextmanager
def started(*words, through=()):
    """Start the lesson's command, perhaps through another program, and give its process and address once it listens."""
    command = [*through, sys.executable, "-m", "daebench", "lesson", NAME, "--no-browser", *words]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, start_new_session=True, preexec_fn=listening)
    try:
        assert select.select([process.stdout], [], [], STARTED)[0]
        port, token = re.search(rf"http://{HOST}:(\d+)/([\w-]+)/", process.stdout.readline()).groups()
        yield process, Address(int(port), token)
    finally:
        process.kill()
        process.wait(GONE)
        process.stdout.close()


@pytest.fixture(scope="module")
def served():
    """Return the address of one lesson that is served."""
    with started() as (_, address):
        yield address


def ask(address, path, *, method="GET", host=None, origin=None, socket=False):
    """Return the status, the headers and the beginning of the answer to one request or handshake."""
    with closing(http.client.HTTPConnection(HOST, address.port, timeout=STARTED)) as connection:
        connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
        connection.putheader("Host", f"{HOST}:{address.port}" if host is None else host)
        if origin is not None:
            connection.putheader("Origin", origin)
        if socket:
            for name, value in {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13"}.items():
                connection.putheader(name, value)
            connection.putheader("Sec-WebSocket-Key", "AAAAAAAAAAAAAAAAAAAAAA==")
        connection.endheaders()
        answer = connection.getresponse()
        return answer.status, dict(answer.getheaders()), "" if answer.status == 101 else answer.read(400).decode()


def filled(texts, address):
    token = address.token
    return [each.format(port=address.port, token=token, short=token[:-1], upper=token.swapcase()) for each in texts]


@pytest.mark.slow
@pytest.mark.parametrize("name", [HOST, "localhost"])
def test_the_address_that_is_printed_is_answered_and_sets_no_cookie(served, name):
    host = f"{name}:{served.port}"
    for origin in (None, f"http://{host}"):
        status, headers, text = ask(served, served.root, host=host, origin=origin)
        assert status == 200
        assert "<html" in text.lower()
        assert "set-cookie" not in map(str.lower, headers)
    assert ask(served, f"{served.root}ws?session_id=s_{name}", host=host, origin=f"http://{host}", socket=True)[0] == 101


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["host", "origin", "path"])
@pytest.mark.parametrize("socket", [False, True], ids=["page", "websocket"])
def test_a_stranger_is_refused_by_the_server(served, kind, socket):
    right = {"path": f"{served.root}ws?session_id=s_stranger" if socket else served.root, "origin": f"http://{HOST}:{served.port}"}
    for value in filled({"host": STRANGE_HOSTS, "origin": STRANGE_ORIGINS, "path": STRANGE_PATHS}[kind], served):
        status, _, text = ask(served, **right | {kind: value}, socket=socket)
        assert status in (400, 403), value  # an empty Host is no request at all
        assert served.token not in text


@pytest.mark.slow
@pytest.mark.parametrize(
    "path", ["api/kernel/execute", "api/kernel/set_ui_element_value", "api/kernel/shutdown", "api/kernel/scratchpad/run"]
)
def test_a_foreign_page_can_post_nothing_even_with_the_token(served, path):
    assert ask(served, f"{served.root}{path}", method="POST", origin="http://evil.example")[0] == 403
    assert ask(served, f"/{path}", method="POST", origin=f"http://{HOST}:{served.port}")[0] == 403


@pytest.mark.parametrize("port", [80, 8080])
def test_hosts_origins_and_tokens_are_compared_as_a_whole(port):
    address = Address(port)

    def of(path=address.root, host=f"{HOST}:{port}", origin=None, kind="http"):
        headers = [(b"host", each.encode()) for each in ([host] if isinstance(host, str) else host)]
        headers += [] if origin is None else [(b"origin", origin.encode())]
        return refusal({"type": kind, "path": path, "headers": headers}, address)

    assert of() is None
    assert of(host=f"LOCALHOST:{port}", origin=f"http://localhost:{port}") is None
    assert of(f"{address.root}ws", origin=f"http://{HOST}:{port}", kind="websocket") is None
    assert (of(host=HOST) is None) == (port == 80)
    strange = set(STRANGE_HOSTS) - {HOST, "localhost"}  # they are right at port 80
    assert all("only for this machine" in of(host=each) for each in filled(strange, address))
    assert all("only for this machine" in of(host=each) for each in ([], [f"{HOST}:{port}"] * 2))
    assert all("other sites" in of(origin=each) for each in filled(STRANGE_ORIGINS, address))
    assert all("whole address" in of(path) for path in filled(STRANGE_PATHS, address))
    assert "other sites" in of(f"{address.root}ws", kind="websocket")
    assert "no such" in of(f"{address.root}terminal/ws", origin=f"http://{HOST}:{port}", kind="websocket")
    assert "no such" in of(origin=f"http://{HOST}:{port}", kind="websocket")


def test_every_start_has_another_token_and_no_trace_of_it_is_in_a_message():
    tokens = {Address(8080).token for _ in range(100)}
    assert len(tokens) == 100
    assert min(map(len, tokens)) >= 32
    assert all(token not in repr(Address(8080, token)) for token in tokens)


def test_pages_are_counted_by_session_and_for_a_while_after():
    now = 0.0
    pages = Pages(lambda: now)
    opened = [pages.open(f"s{i}") for i in range(MOST)]
    for each in opened:
        assert pages.has_room()
        each.__enter__()
    assert not pages.has_room()
    assert not pages.has_room("another")
    assert pages.has_room("s0")  # its connection comes back before the old one has ended
    with pages.open("s0"):
        opened[0].__exit__(None, None, None)
        now = LINGERS + 1.0
        assert not pages.has_room("another")
    assert not pages.has_room("another")
    assert pages.has_room("s0")
    now += LINGERS + 1.0
    assert pages.has_room("another")


@pytest.mark.slow
def test_one_page_too_many_is_a_sentence_and_makes_no_session():
    with started() as (_, address):
        origin, opened = f"http://{HOST}:{address.port}", []
        for i in range(MOST):
            assert ask(address, address.root)[0] == 200
            opened.append(handshake(address, f"s_{i}", origin))
        assert [each.recv(12) for each in opened] == [b"HTTP/1.1 101"] * MOST
        status, _, text = ask(address, address.root)
        assert (status, text) == (503, f"This lesson has {MOST} pages open; close one, wait {LINGERS} s and reload.\n")
        assert ask(address, f"{address.root}ws?session_id=s_more", origin=origin, socket=True)[0] == 403
        assert ask(address, f"{address.root}sse?session_id=s_more", origin=origin)[0] == 503
        for each in opened:
            each.close()


def handshake(address, session, origin):
    """Return a connection that asked for a websocket and stays open."""
    connection = socket.create_connection((HOST, address.port), timeout=STARTED)
    lines = [f"GET {address.root}ws?session_id={session} HTTP/1.1", f"Host: {HOST}:{address.port}", f"Origin: {origin}"]
    lines += ["Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA=="]
    connection.sendall("\r\n".join([*lines, "", ""]).encode())
    return connection


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT, signal.SIGKILL], ids=lambda number: number.name)
def test_no_signal_leaves_a_process_behind(number):
    with started() as (process, address), closing(handshake(address, "s_0", f"http://{HOST}:{address.port}")):
        assert process.pid in session_of(process.pid)
        process.send_signal(number)
        process.wait(GONE)
        assert (process.returncode == 0) == (number == signal.SIGINT)
        assert all_gone(process.pid)


@pytest.mark.slow
@pytest.mark.parametrize("ignored", [False, True], ids=["plain", "nohup"])
def test_a_lesson_ends_with_its_parent_unless_it_is_told_to_outlive_it(ignored):
    """Python stands for the shell or the editor that started the command, and is killed so that it can say nothing to its child."""
    ready = "import signal; signal.signal(signal.SIGHUP, signal.SIG_IGN); " if ignored else ""
    through = [sys.executable, "-c", f"{ready}import subprocess, sys; subprocess.run(sys.argv[1:])"]
    with started(through=through) as (process, _):
        (child,) = session_of(process.pid) - {process.pid}
        process.kill()
        process.wait(GONE)
        assert all_gone(process.pid, seconds=2.0 if ignored else GONE) != ignored
        if ignored:
            os.kill(child, signal.SIGKILL)


def session_of(pid):
    """Return the processes that a process and those that it started have begun, whoever their parent is now."""
    import psutil

    found = set()
    for each in psutil.process_iter(["status"]):
        with suppress(ProcessLookupError):
            if os.getsid(each.pid) == pid and each.info["status"] != psutil.STATUS_ZOMBIE:
                found.add(each.pid)
    return found


def all_gone(pid, seconds=GONE):
    """Return whether a process and all that it began end within some seconds."""
    until = time.monotonic() + seconds
    while time.monotonic() < until and session_of(pid):
        time.sleep(0.1)
    return not session_of(pid)


def test_a_port_is_free_or_there_is_a_sentence():
    with listener(None) as bound:
        port = bound.getsockname()[1]
        assert bound.getsockname()[0] == HOST
        with pytest.raises(BadInput, match=rf"port {port} of {HOST} cannot be used \(.*\); give another --port"), listener(port):
            pass
    with listener(port):
        pass
    for wrong in (0, -1, 65536, 10**9):
        with pytest.raises(BadInput, match=f"port = {wrong} must be from 1 to 65535"), listener(wrong):
            pass
