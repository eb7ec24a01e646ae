"""The parts of the site that are written from the code: reference, command line, tables, results; and formulas as MathML."""

from typing import TYPE_CHECKING

from daebench_site import api, commands, json_keys, mathml, norms, notebooks, results, tables

if TYPE_CHECKING:
    from sphinx.application import Sphinx


def setup(app: "Sphinx") -> dict[str, bool]:
    """Add the parts to a build."""
    for part in (api, commands, json_keys, mathml, norms, notebooks, results, tables):
        part.setup(app)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
