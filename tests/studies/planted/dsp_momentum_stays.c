/* Positions are corrected, the momenta not, until the velocity stage. */
#include "dsp_common.h"
int step(const double *par, double *p, double *q, double h)
{
    double w1 = 1 / par[0], w2 = 1 / par[1], x[6], a[2][3], s[2][3], A[2][2], r[2], lam[2];
    p[2] -= h / 2 * par[0] * par[4];
    p[5] -= h / 2 * par[1] * par[4];
    for (int c = 0; c < 3; c++) { x[c] = q[c] + h * w1 * p[c]; x[3 + c] = q[3 + c] + h * w2 * p[3 + c]; }
    rods(q, a);
    for (int it = 0; it < 50; it++) {
        rods(x, s);
        r[0] = (dot(s[0], s[0]) - par[2] * par[2]) / 2;
        r[1] = (dot(s[1], s[1]) - par[3] * par[3]) / 2;
        coupling(s, a, w1, w2, A);
        solve2(A, r, lam);
        push(x, a, lam, w1, w2, -1);
        if (fabs(r[0]) + fabs(r[1]) < 1e-15) break;
    }
    for (int i = 0; i < 6; i++) q[i] = x[i];
    p[2] -= h / 2 * par[0] * par[4];
    p[5] -= h / 2 * par[1] * par[4];
    rods(q, s);
    double v[6];
    for (int c = 0; c < 3; c++) { v[c] = w1 * p[c]; v[3 + c] = w2 * p[3 + c] - w1 * p[c]; }
    r[0] = dot(s[0], v);
    r[1] = dot(s[1], v + 3);
    coupling(s, s, w1, w2, A);
    solve2(A, r, lam);
    push(p, s, lam, 1, 1, -1);
    return 0;
}
