"""Published numbers that several tests hold against ours."""

import numpy as np

BARI_Q = [15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948, 0.5244099658805304, 0.5347301163226948]
BARI_Q += [1.048080741042263]
BARI_LAM = [199.1753333731910, -29.75531228015052, 23.06654119098399, 31.45271365475927, 22.64249232082739, 11.61740700019673]
"""Andrews' squeezer at t = 0.03 s in the Bari test set: off by 1.4e-9 in q, by one time shift of 1e-12 s, and by 1.5e-5 in lam."""

_COARSE, _FINE = np.array([0.3284552, 0.9445195]), np.array([0.32845738, 0.94451879])

FOUR_BAR_B0 = (4 * _FINE - _COARSE) / 3
"""B_0 of the four-bar linkage, case iftomm, at t = 10 s, by a program of second order with steps of 2.5e-4 and 1.25e-4, extrapolated."""
