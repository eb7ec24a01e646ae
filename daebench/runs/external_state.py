"""Validation of a state from an external code: an array, or a pair of arrays, of the required shapes."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from daebench.errors import BadInput
from daebench.runs.ivp import Array


def external_state(state: Any, shapes: Sequence[tuple[int, ...]], duty: str) -> list[Array]:
    """Return the parts of a state as new arrays of these shapes; a state of one part is that part itself.

    Raises
    ------
    BadInput
        If the state is not of these shapes; the message begins with the duty.
    """
    expected_shape = f"{shapes[0]} each" if len(shapes) > 1 else f"{shapes[0]}"
    try:
        arrays = [np.array(part) for part in (state if len(shapes) > 1 else [state])]
        if state is None or len(arrays) != len(shapes):
            raise TypeError
        if any(map(np.iscomplexobj, arrays)):
            raise BadInput(f"{duty}, of shape {expected_shape}; {'they are' if len(shapes) > 1 else 'it is'} complex.")
        arrays = [array.astype(float) for array in arrays]
    except (TypeError, ValueError, OverflowError):
        raise BadInput(f"{duty}, of shape {expected_shape}; it returned {type(state).__name__}.") from None
    if [array.shape for array in arrays] != list(shapes):
        actual_shapes = " and ".join(str(array.shape) for array in arrays)
        raise BadInput(f"{duty}, of shape {expected_shape}; {'their shapes are' if len(shapes) > 1 else 'its shape is'} {actual_shapes}.")
    return arrays
