"""``daebench`` and ``python -m daebench``: the command line; Ctrl-C ends it with one sentence even while it is being loaded."""

import os
import signal
import sys

INTERRUPTED = 130
"""Status of a command that Ctrl-C ended."""


def main() -> None:
    """Load the command line and run it."""
    handler = signal.getsignal(signal.SIGINT)
    if handler is not signal.SIG_IGN:  # as the shell sets it for background processes
        signal.signal(signal.SIGINT, _leave)
    from daebench.cli.app import main as called

    signal.signal(signal.SIGINT, handler)
    called()


def _leave(*_: object) -> None:
    """End the process at once: no work is in progress, and a partially loaded library may handle the exception itself."""
    if sys.stderr is not None:
        os.write(2, b"daebench: interrupted.\n")
    os._exit(INTERRUPTED)


if __name__ == "__main__":
    main()
