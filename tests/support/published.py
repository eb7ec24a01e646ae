"""Published numbers that several tests hold against ours."""

import numpy as np

BARI_Q = [15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948, 0.5244099658805304, 0.5347301163226948]
BARI_Q += [1.048080741042263]
BARI_LAM = [199.1753333731910, -29.75531228015052, 23.06654119098399, 31.45271365475927, 22.64249232082739, 11.61740700019673]
"""Andrews' squeezer at t = 0.03 s in the Bari test set: off by 1.4e-9 in q, by one time shift of 1e-12 s, and by 1.5e-5 in lam."""

_COARSE, _FINE = np.array([0.3284552, 0.9445195]), np.array([0.32845738, 0.94451879])

FOUR_BAR_B0 = (4 * _FINE - _COARSE) / 3
"""B_0 of the four-bar linkage, case iftomm, at t = 10 s, by a program of second order with steps of 2.5e-4 and 1.25e-4, extrapolated."""


_CVPENDULUM = """
1e-5 YES  2.53e-06  2.25e-03  1.80e-04  8.01e-02  |  0.00e+00  |   1421     1663+96         96 ( 24)     |    0   11
1e-5 NO   5.61e-01  8.98e-01  4.26e+00  2.10e+00  |  6.19e-04  |   1549     1757+112       114 ( 28)     |    0   40
1e-6 YES  1.07e-07  4.64e-04  9.25e-06  1.99e-02  |  0.00e+00  |   2089     2336+140       120 ( 35)     |    0    5
1e-6 NO   1.68e-03  5.74e-02  5.77e-02  1.00e+00  |  7.05e-05  |   2221     2502+156       167 ( 39)     |    0   39
1e-7 YES  3.04e-09  7.79e-05  2.73e-07  3.51e-03  |  2.22e-16  |   3013     3293+204       170 ( 51)     |    0    5
1e-7 NO   2.58e-04  3.45e-02  1.61e-02  1.11e+00  |  6.77e-04  |   3236     3526+228       202 ( 57)     |    0   38
1e-8 YES  9.43e-11  1.37e-05  8.22e-09  5.99e-04  |  0.00e+00  |   4295     4728+292       236 ( 73)     |    0    6
1e-8 NO   9.55e-06  8.52e-03  3.38e-04  1.95e-01  |  5.35e-05  |   4600     4962+312       260 ( 78)     |    0   16
1e-9 YES  1.60e-12  1.79e-06  1.39e-10  7.79e-05  |  1.11e-16  |   6542     7056+436       346 (109)     |    0    5
1e-9 NO   1.39e-06  1.70e-03  1.12e-04  3.90e-02  |  5.67e-06  |   6661     7123+448       348 (112)     |    0    2
"""
CVPENDULUM = [line.split(maxsplit=2) for line in _CVPENDULUM.strip().splitlines()]
"""What SUNDIALS 7.5.0 prints in cvPendulum_dns.out: tolerance, whether steps are projected, and the line that follows."""

CAR_AXIS_Q = [0.493455784275402809122e-1, 0.496989460230171153861, 1.04174252488542151681, 0.373911027265361256927]
CAR_AXIS_V = [-0.770583684040972357970e-1, 0.744686658723778553466e-2, 0.175568157537232222276e-1, 0.770341043779251976443]
CAR_AXIS_LAM = [-0.473688659084893324729e-2, -0.110468033125734368808e-2]
"""The car axis at t = 3 in the Bari test set: good to 3e-13 in q and 5e-12 in v; lam of the sign there, which is not ours."""

AREVALO_IDA = {0: 2.116, 4: 1.438e-1, 8: 4.890e-2, 12: 5.620e-3, 16: 1.099e-3, 20: 1.319e-4, 24: 8.930e-6}
"""Errors of IDA in GGL form at t = 5 on Arevalo's problem, rtol = atol = 10^-(3 + m/4), by m, in the benchmark of ``solve_dae``."""

SLIDER_CRANK = {
    2.5: (7.2238e-02, 1.4980e00, -3.6096e-02),
    5.0: (-1.4300e00, 9.3903e-01, 5.1790e-01),
    7.5: (1.8041e-01, 1.4879e00, -8.9839e-02),
    10.0: (1.2757e00, 1.0236e00, -4.9881e-01),
}
"""The crank's angle, the slider's place and the rod's angle by time, as idaSlCrank_dns of SUNDIALS prints them at tolerance 1e-6."""

SLIDER_CRANK_G, SLIDER_CRANK_GRADIENT = 3.3366155611545363, {"k": 3.3346e-1, "c": -3.6375e-1}
"""The integral of kinetic energy up to t = 10 and its derivatives, as idasSlCrank_FSA prints them: good to 1e-5 and 4e-5."""
