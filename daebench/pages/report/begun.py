"""A function is compiled when this module is loaded: processes that are forked after that find numba begun, which saves half a second."""

import numba

numba.njit(error_model="numpy")(lambda x: (x[0] + abs(x[1]), x[1]))((0.0, 1.0))
