"""What the loop does beside stepping a chain: as for other constrained systems, but that whole arrays are stored and watched."""

from daebench.codegen import function
from daebench.watch import Watch, stored_as


class ChainWatch(Watch):
    """Source of the functions declared in ``kernels/hole.py`` under *what only Newton and the loop use*, for states that are arrays."""

    def needs(self, name: str) -> list[str]:
        """Return the names of the functions that one of these calls."""
        return [*super().needs(name), *(["largest"] if name == "watch" and len(self.errors) > 1 else [])]

    def source(self, name: str) -> str | None:
        """Return the source of the function of this name, or None if it is none of these."""
        d, m = self.d, self.m
        if name == "store" and not self.sampled:
            lines = [f"X[row, :{d}] = x[0]", f"X[row, {d}:] = x[1]"]
            return stored_as(*lines, *(f"R[row, {k * m}:{(k + 1) * m}] = raw[{k}]" for k in self.raw))
        if name == "largest":
            lines = ["found = abs(x[0])", "for each in x:", "    if not abs(each) <= found:", "        found = abs(each)"]
            return function("largest(x)", *lines, "return found")
        return super().source(name)

    def _largest(self, call: str) -> str:
        """Source of the largest modulus of the values of a call, NaN if any is."""
        return f"largest({call})"
