"""``python -m daebench``."""

from daebench.cli import main

main()
