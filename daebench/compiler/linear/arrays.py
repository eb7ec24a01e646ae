"""The *arrays* algebra: vectors are NumPy arrays, for systems for which straight-line code would be too long."""

from daebench.compiler.codegen import function


class Arrays:
    """Source of the operations that :mod:`daebench.compiler.shapes` and ``kernels/language.py`` name, for arrays of any length.

    Parameters
    ----------
    n : int
        Number of coordinates; halves have half as many.
    """

    elementwise = False
    """Whether entries may be arrays in place of numbers."""

    def __init__(self, n: int) -> None:
        self.n = n

    def source(self, name: str) -> str | None:
        """Return the source of the operation of this name, or None if there is none."""
        half = self.n // 2
        bodies = {
            "axpy(w, x, y)": "w * x + y",
            "axpy_m(w, x, y)": "w * x + y",
            "scale(w, x)": "w * x",
            "first_half(y)": f"y[:{half}]",
            "second_half(y)": f"y[{half}:]",
            "joined(u, v, y)": "concatenate((u, v))",
        }
        if name in ("norm", "norm_m"):
            return function(f"{name}(x)", "found = abs(x[0])", "for i in range(1, x.shape[0]):", "    found += abs(x[i])", "return found")
        sources = {signature.partition("(")[0]: function(signature, f"return {body}") for signature, body in bodies.items()}
        return sources.get(name)
