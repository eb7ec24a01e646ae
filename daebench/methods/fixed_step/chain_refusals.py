"""Which schemes cannot be written as loops over the nodes of a chain."""

from typing import TYPE_CHECKING, Any

from daebench.compiler.cache import generated
from daebench.errors import InvalidProblem

if TYPE_CHECKING:
    from daebench.runs.ivp import ConstrainedIvp


def unwritten(ivp: "ConstrainedIvp", file: str, **structure: Any) -> str:
    """Return why a scheme's file cannot be written as loops over nodes, as a sentence, or ""; kept with the generated modules.

    Parameters
    ----------
    ivp : ConstrainedIvp
        A chain whose vectors are arrays.
    file : str
        Name of the scheme's file.
    **structure
        Form, stages and projection, as for :class:`daebench.compiler.link.Options`.
    """

    def build() -> str:
        from daebench.compiler.link import Linker, Options

        linker = Linker(ivp.source.derivation, Options(**structure), f"daebench.schemes.{file}")
        why = ""
        try:
            linker.module("", [("daebench.schemes.kernels.loop", "integrate")])
        except InvalidProblem as error:
            why = str(error)
        return f'"""Whether {file} is loops over nodes of {ivp.problem}."""\n\nWHY = {why!r}\n'

    key = f"{ivp.source.key} {file} {sorted(structure.items())} loops"
    return str(generated(f"{ivp.problem}_{file}_loops", key, build).WHY)
