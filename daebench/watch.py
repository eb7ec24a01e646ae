"""What the loop does beside stepping: watch errors, add up work, store states; each written out for what is asked, or empty."""

from collections.abc import Callable, Sequence

from daebench.codegen import function, pack


class Watch:
    """Source of the functions declared in ``kernels/hole.py`` under *what only Newton and the loop use*.

    Parameters
    ----------
    d, m : int
        Numbers of positions and of constraints.
    count : int
        Number of first integrals that the problem declares besides H.
    watch : sequence of str
        Any of "energy", "manifold", "integrals"; or "samples", for the loop to store H in place of states.
    kinds : int
        Number of kinds of work that are counted; 0 to count nothing.
    raw : int
        Number of raw multipliers of a step that are stored, each shape(m,); 0 to store none.
    guarded : bool
        Whether H may have no value where the forces have one, see :mod:`daebench.domain`.
    """

    def __init__(self, d: int, m: int, count: int, watch: Sequence[str], kinds: int, raw: int = 0, *, guarded: bool = False) -> None:
        self.d, self.m = d, m
        self.kinds, self.raw = range(kinds), range(raw)
        integrals = range(count) if "integrals" in watch else range(0)
        self.sampled = "samples" in watch
        self.guard = "H(x[0], x[1], par)" if guarded and "energy" not in watch else ""
        H = ["H(x[0], x[1], par)"] * ("energy" in watch or self.sampled)
        self.conserved = [*H, *(f"integrals(x[0], x[1], par)[{i}]" for i in integrals)]
        constraints = [self._largest("g(x[1], par)"), self._largest("Gv(x[0], x[1], par)")] * ("manifold" in watch)
        changes = [f"abs({value} - first[{i}])" for i, value in enumerate(self.conserved)]
        self.errors = changes[: len(H)] * ("energy" in watch) + constraints + changes[len(H) :]

    def needs(self, name: str) -> list[str]:
        """Return the names of the problem's functions that one of these calls."""
        texts = {"watched": self.conserved, "watch": self.errors, "store": self.conserved * self.sampled, "defined": [self.guard]}.get(
            name, []
        )
        return [needed for needed in ("H", "g", "Gv", "integrals") if any(f"{needed}(" in text for text in texts)]

    def source(self, name: str) -> str | None:
        """Return the source of the function of this name, or None if it is none of these."""
        rule = self._rules.get(name)
        return None if rule is None else rule()

    @property
    def _rules(self) -> dict[str, Callable[[], str]]:
        d = range(self.d)
        return shared_rules(len(self.errors), len(self.kinds), self.guard) | {
            "watched": lambda: function("watched(x, par)", "return " + pack(self.conserved)),
            "watch": lambda: function("watch(x, first, par)", "return " + pack(self.errors)),
            "store": lambda: stored_as(
                *(f"X[row, {half * self.d + i}] = x[{half}][{i}]" for half in (0, 1) for i in d),
                *(f"R[row, {k * self.m + i}] = raw[{k}][{i}]" for k in self.raw for i in range(self.m)),
                sample=self.conserved[0] if self.sampled else "",
            ),
        }

    def _largest(self, call: str) -> str:
        """Source of the largest modulus of the m values of a call."""
        moduli = [f"abs({call}[{i}])" for i in range(self.m)]
        return moduli[0] if self.m == 1 else f"max({', '.join(moduli)})"


def stored_as(*lines: str, sample: str = "") -> str:
    """Return the source of what stores a state by these lines, or in its place the value of an expression of it."""
    return function("store(X, R, row, x, raw, par)", *([f"X[row, 0] = {sample}"] if sample else lines))


def shared_rules(errors: int, kinds: int, guard: str) -> dict[str, Callable[[], str]]:
    """Return the functions that do not depend on the kind of state: for so many errors and kinds of work, and H where it is guarded."""
    larger = "x[{i}] if x[{i}] != x[{i}] or x[{i}] >= y[{i}] else y[{i}]"
    return {
        "worst": lambda: function("worst(x, y)", "return " + pack(larger.format(i=i) for i in range(errors))),
        "total": lambda: function("total(x)", "return " + (" + ".join(f"x[{i}]" for i in range(errors)) or "0.0")),
        "defined": lambda: function("defined(x, par)", f"return abs(0.0 * {guard})" if guard else "return 0.0"),
        "no_work": lambda: function("no_work()", "return " + pack("0" for _ in range(kinds))),
        "plus_work": lambda: function("plus_work(x, y)", "return " + pack(f"x[{i}] + y[{i}]" for i in range(kinds))),
    }
