"""The pair (p, q) as code from outside hands it over: two arrays of the shape that was asked for, or there is a sentence."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput

Array = NDArray[np.float64]


def pair(found: Any, shape: tuple[int, ...], duty: str) -> tuple[Array, Array]:
    """Return p and q as new arrays of this shape.

    Raises
    ------
    BadInput
        If they are not; the message begins with the duty.
    """
    try:
        p, q = (np.array(part) for part in found)
        if np.iscomplexobj(p) or np.iscomplexobj(q):
            raise TypeError
        p, q = p.astype(float), q.astype(float)
    except (TypeError, ValueError):
        raise BadInput(f"{duty}, of shape {shape} each; it returned {type(found).__name__}.") from None
    if p.shape != shape or q.shape != shape:
        raise BadInput(f"{duty}, of shape {shape} each; their shapes are {p.shape} and {q.shape}.")
    return p, q
