"""``daebench`` and ``python -m daebench``: the command line, which Ctrl-C ends in one sentence even while it is being loaded."""

import os
import signal
import sys

INTERRUPTED = 130
"""Status of a command that Ctrl-C ended."""


def main() -> None:
    """Load the command line and run it."""
    handler = signal.getsignal(signal.SIGINT)
    if handler is not signal.SIG_IGN:  # as the shell sets it for what runs in the background
        signal.signal(signal.SIGINT, _leave)
    from daebench.cli.app import main as called

    signal.signal(signal.SIGINT, handler)
    called()


def _leave(*_: object) -> None:
    """End the process at once: nothing is under way, and a library half loaded may take an exception for one of its own."""
    if sys.stderr is not None:
        os.write(2, b"daebench: interrupted.\n")
    os._exit(INTERRUPTED)


if __name__ == "__main__":
    main()
