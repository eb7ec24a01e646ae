"""A notebook made of a text in Markdown: its blocks of Python become cells that run."""

import json
import re
from typing import Any

BLOCK = re.compile(r"^```python\n(.*?)^```\n", re.DOTALL | re.MULTILINE)


def notebook(text: str) -> str:
    """Return a notebook of Jupyter, as JSON."""
    cells: list[dict[str, Any]] = []
    for k, part in enumerate(BLOCK.split(text)):
        lines = part.strip().splitlines(keepends=True)
        if k % 2:
            cells.append({"cell_type": "code", "metadata": {}, "execution_count": None, "outputs": [], "source": lines})
        elif lines:
            cells.append({"cell_type": "markdown", "metadata": {}, "source": lines})
    kernel = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
    return json.dumps({"cells": cells, "metadata": kernel, "nbformat": 4, "nbformat_minor": 4}, indent=1) + "\n"
