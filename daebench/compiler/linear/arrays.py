"""The *arrays* algebra: vectors are NumPy arrays, for systems for which straight-line code would be too long."""

from daebench.compiler.linear.elimination import Space
from daebench.compiler.python_text import function


class Arrays:
    """Source of the operations that :mod:`daebench.compiler.shapes` and ``kernels/language.py`` name, for arrays of any length."""

    elementwise = False
    """Whether entries may be arrays in place of numbers."""

    def __init__(self, n: int) -> None:
        self.n = n

    def __repr__(self) -> str:
        return f"Arrays({self.n})"

    names = ("axpy", "axpy_m", "scale", "first_half", "second_half", "joined", "norm", "norm_m")
    """Names of its operations."""

    def provide(self, name: str, space: Space) -> None:
        """Bring an operation into the names of a module."""
        space.add(self.source(name))

    def source(self, name: str) -> str:
        """Return the source of the operation of this name."""
        half = self.n // 2
        bodies = {
            "axpy(w, x, y)": "w * x + y",
            "axpy_m(w, x, y)": "w * x + y",
            "scale(w, x)": "w * x",
            "first_half(y)": f"y[:{half}]",
            "second_half(y)": f"y[{half}:]",
        }
        if name in ("norm", "norm_m"):
            return function(f"{name}(x)", "found = abs(x[0])", "for i in range(1, x.shape[0]):", "    found += abs(x[i])", "return found")
        if name == "joined":
            lines = ["out = empty(y.shape[0], dtype=y.dtype)", f"out[:{half}] = u", f"out[{half}:] = v", "return out"]
            return function("joined(u, v, y)", *lines)
        sources = {signature.partition("(")[0]: function(signature, f"return {body}") for signature, body in bodies.items()}
        return sources[name]
