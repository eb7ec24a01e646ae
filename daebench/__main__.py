"""``python -m daebench``: the command line."""

from daebench.cli.__main__ import main

if __name__ == "__main__":
    main()
