"""What the loop does beside stepping a Poisson system: watch errors, add up work, store states."""

from collections.abc import Sequence

from daebench.codegen import function, pack
from daebench.watch import shared_rules, stored_as


class PoissonWatch:
    """Source of the functions declared in ``kernels/hole.py`` under *what only Newton and the loop use*, for states y.

    Parameters
    ----------
    n : int
        Number of coordinates in which states are seen.
    casimirs, integrals : int
        Numbers of Casimir functions and of other first integrals.
    watch : sequence of str
        Any of "energy", "casimirs", "integrals"; or "samples", for the loop to store H in place of states.
    kinds : int
        Number of kinds of work that are counted; 0 to count nothing.
    guarded : bool
        Whether H may have no value where the rates have one, see :mod:`daebench.domain`.
    """

    def __init__(self, n: int, casimirs: int, integrals: int, watch: Sequence[str], kinds: int, *, guarded: bool = False) -> None:
        self.n, self.kinds = n, kinds
        self.sampled = "samples" in watch
        self.guard = "H(x, par)" if guarded and "energy" not in watch else ""
        H = ["H(x, par)"] * ("energy" in watch or self.sampled)
        others = [f"casimirs(x, par)[{i}]" for i in range(casimirs) if "casimirs" in watch]
        others += [f"integrals(x, par)[{i}]" for i in range(integrals) if "integrals" in watch]
        self.conserved = H + others
        changes = [f"abs({value} - first[{i}])" for i, value in enumerate(self.conserved)]
        self.errors = changes[: len(H)] * ("energy" in watch) + changes[len(H) :]

    def needs(self, name: str) -> list[str]:
        """Return the names of the system's functions that one of these calls."""
        texts = {"watched": self.conserved, "watch": self.errors, "store": self.conserved * self.sampled, "defined": [self.guard]}.get(
            name, []
        )
        return [needed for needed in ("H", "casimirs", "integrals") if any(f"{needed}(" in text for text in texts)]

    def source(self, name: str) -> str | None:
        """Return the source of the function of this name, or None if it is none of these."""
        own = {
            "watched": lambda: function("watched(x, par)", "return " + pack(self.conserved)),
            "watch": lambda: function("watch(x, first, par)", "return " + pack(self.errors)),
            "store": lambda: stored_as(*(f"X[row, {i}] = x[{i}]" for i in range(self.n)), sample=self.conserved[0] if self.sampled else ""),
        }
        rule = (own | shared_rules(len(self.errors), self.kinds, self.guard)).get(name)
        return None if rule is None else rule()
