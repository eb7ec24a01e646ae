r"""Assertions for the tests of any code: agreement with or convergence to certified references, and properties of its steps.

These are plain functions that raise AssertionError; pytest has them as fixtures of the same names wherever daebench is installed.

Programs in other languages read the CSV that ``daebench reference export`` writes: a line of names, then t, q1, ..., p1, ..., lam1, ... (of
a Poisson system t, y1, ...) with 34 digits each. The spacing of t is a power of two, here 1/8. In C, with h also a power of two, so that
every t is reached exactly::

    #include <math.h>
    #include <stdio.h>

    void step(double *p, double *q, double h); /* yours */

    int main(void) {
        double t, now = 0, p[2], q[2], P[2], Q[2], h = 1.0 / 1024, error = 0;
        FILE *csv = fopen("planar_pendulum-horizontal.csv", "r");
        if (!csv || fscanf(csv, "%*s %lf,%lf,%lf,%lf,%lf,%*s", &now, q, q + 1, p, p + 1) != 5) return 2;
        while (now < 10 && fscanf(csv, "%lf,%lf,%lf,%lf,%lf,%*s", &t, Q, Q + 1, P, P + 1) == 5) {
            for (; now < t; now += h) step(p, q, h);
            double d = hypot(q[0] - Q[0], q[1] - Q[1]);
            if (!(d <= error)) error = d; /* so that NaN is seen */
        }
        printf("largest error of q up to t = %g: %.1e\n", now, error);
        return now < 10 || !(error < 1e-4);
    }
"""

from daebench.testing.properties import assert_keeps, assert_no_drift, assert_order, assert_reversible, assert_symplectic
from daebench.testing.references import Step, assert_agrees, assert_converges, assert_solver_converges, reference_trajectory

__all__ = [
    "Step",
    "assert_agrees",
    "assert_converges",
    "assert_keeps",
    "assert_no_drift",
    "assert_order",
    "assert_reversible",
    "assert_solver_converges",
    "assert_symplectic",
    "reference_trajectory",
]
