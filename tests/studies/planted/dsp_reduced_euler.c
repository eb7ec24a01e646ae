/* Multipliers from the twice differentiated constraints; symplectic Euler, implicit in the momenta. */
#include "dsp_common.h"
static void force(const double *par, const double *p, const double *q, double *f)
{
    double w1 = 1 / par[0], w2 = 1 / par[1], s[2][3], A[2][2], r[2], lam[2], v[6];
    rods(q, s);
    for (int c = 0; c < 3; c++) { v[c] = w1 * p[c]; v[3 + c] = w2 * p[3 + c] - w1 * p[c]; }
    r[0] = dot(v, v) - par[4] * s[0][2];
    r[1] = dot(v + 3, v + 3);
    coupling(s, s, w1, w2, A);
    solve2(A, r, lam);
    for (int i = 0; i < 6; i++) f[i] = 0;
    f[2] = -par[0] * par[4];
    f[5] = -par[1] * par[4];
    push(f, s, lam, 1, 1, -1);
}
int step(const double *par, double *p, double *q, double h)
{
    double u[6], f[6];
    for (int i = 0; i < 6; i++) u[i] = p[i];
    for (int it = 0; it < 200; it++) {
        double moved = 0;
        force(par, u, q, f);
        for (int i = 0; i < 6; i++) {
            double n = p[i] + h * f[i];
            moved = fmax(moved, fabs(n - u[i]));
            u[i] = n;
        }
        if (moved < 1e-15) break;
    }
    for (int i = 0; i < 6; i++) {
        q[i] += h * u[i] / par[i < 3 ? 0 : 1];
        p[i] = u[i];
    }
    return 0;
}
