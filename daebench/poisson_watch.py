"""What the loop does beside stepping a Poisson system: watch errors, add up work, store states."""

from collections.abc import Sequence

from daebench.codegen import function, pack
from daebench.watch import shared_rules


class PoissonWatch:
    """Source of the functions declared in ``kernels/hole.py`` under *what only Newton and the loop use*, for states y.

    Parameters
    ----------
    n : int
        Number of coordinates in which states are seen.
    casimirs, integrals : int
        Numbers of Casimir functions and of other first integrals.
    watch : sequence of str
        Any of "energy", "casimirs", "integrals".
    kinds : int
        Number of kinds of work that are counted; 0 to count nothing.
    """

    def __init__(self, n: int, casimirs: int, integrals: int, watch: Sequence[str], kinds: int) -> None:
        self.n, self.kinds = n, kinds
        self.conserved = ["H(x, par)"] * ("energy" in watch)
        self.conserved += [f"casimirs(x, par)[{i}]" for i in range(casimirs) if "casimirs" in watch]
        self.conserved += [f"integrals(x, par)[{i}]" for i in range(integrals) if "integrals" in watch]

    def needs(self, name: str) -> list[str]:
        """Return the names of the system's functions that one of these calls."""
        texts = self.conserved if name in ("watched", "watch") else []
        return [needed for needed in ("H", "casimirs", "integrals") if any(text.startswith(f"{needed}(") for text in texts)]

    def source(self, name: str) -> str | None:
        """Return the source of the function of this name, or None if it is none of these."""
        errors = [f"abs({value} - first[{i}])" for i, value in enumerate(self.conserved)]
        own = {
            "watched": lambda: function("watched(x, par)", "return " + pack(self.conserved)),
            "watch": lambda: function("watch(x, first, par)", "return " + pack(errors)),
            "store": lambda: function("store(X, R, row, x, raw)", *(f"X[row, {i}] = x[{i}]" for i in range(self.n))),
        }
        rule = (own | shared_rules(len(errors), self.kinds)).get(name)
        return None if rule is None else rule()
