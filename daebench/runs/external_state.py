"""Validation of a state from an external code: an array, or a pair of arrays, of the required shapes."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput, foreign, in_words


def external_state(state: Any, shapes: Sequence[tuple[int, ...]], duty: str) -> list[NDArray[np.float64]]:
    """Return the parts of a state as new arrays of these shapes; a state of one part is that part itself."""
    expected_shape = f"{shapes[0]} each" if len(shapes) > 1 else f"{shapes[0]}"
    try:
        # New arrays: code from outside may use its own again for the next step.
        arrays = [np.array(part) for part in (state if len(shapes) > 1 else [state])]
        if state is None or len(arrays) != len(shapes):
            raise TypeError
        if any(map(np.iscomplexobj, arrays)):
            raise BadInput(f"{duty}, of shape {expected_shape}; {'they are' if len(shapes) > 1 else 'it is'} complex.", "state-complex")
        arrays = [array.astype(float) for array in arrays]
    except (TypeError, ValueError):
        raise BadInput(f"{duty}, of shape {expected_shape}; it returned {foreign(type(state).__name__)}.", "state-not-arrays") from None
    except OverflowError:
        raise BadInput(f"{duty}, of shape {expected_shape}; a number in it is too large for double precision.", "state-overflows") from None
    except BadInput:
        raise
    # Whatever an object of outside code does when it is read, as one that computes its entries late.
    except (Exception, SystemExit) as error:
        raise BadInput(
            f"{duty}, of shape {expected_shape}; reading what it returned raises {in_words(error)}.", "state-reading-raises"
        ) from error
    if [array.shape for array in arrays] != list(shapes):
        actual_shapes = " and ".join(str(array.shape) for array in arrays)
        raise BadInput(
            f"{duty}, of shape {expected_shape}; {'their shapes are' if len(shapes) > 1 else 'its shape is'} {actual_shapes}.",
            "state-shape-wrong",
        )
    return arrays
