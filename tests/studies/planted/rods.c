/* Two rods in space, the second from the first mass: par = mass1, mass2, length1, length2, gravity.
   Conjugate corrections, multipliers as accumulated impulses, in the precision REAL; MISTAKE says which one is made. */
#include <math.h>
#ifndef REAL
#define REAL double
#endif
#ifndef MISTAKE
#define MISTAKE 0
#endif
enum { NONE, DRIFTED, EVERY_SWEEP, NO_IMPULSE, NO_PROJECTION, EARLY_STOP, GAME, NO_MASS, OLD_NORMAL, ONE_BODY, LAST_ROD_FREE, UPWARDS, HALF_KICK };
typedef struct { REAL x[2][3]; } V;
static void rods(const V *a, REAL r[2][3])
{
    for (int c = 0; c < 3; c++) { r[0][c] = a->x[0][c]; r[1][c] = a->x[1][c] - a->x[0][c]; }
}
static REAL dot(const REAL *a, const REAL *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
static void apply(V *y, REAL n[2][3], const REAL *k, const REAL *w, REAL s)
{
    for (int c = 0; c < 3; c++) {
        REAL share = MISTAKE == ONE_BODY ? 0 : 1;
        y->x[0][c] += s * w[0] * (k[0] * n[0][c] - share * k[1] * n[1][c]);
        y->x[1][c] += s * w[1] * k[1] * n[1][c];
    }
}
static void solve(REAL s[2][3], REAL n[2][3], const REAL *w, const REAL *b, REAL *k)
{
    REAL share = MISTAKE == ONE_BODY ? 0 : 1;
    REAL a00 = w[0] * dot(s[0], n[0]), a01 = -share * w[0] * dot(s[0], n[1]), a10 = -w[0] * dot(s[1], n[0]);
    REAL a11 = (share * w[0] + w[1]) * dot(s[1], n[1]), det = a00 * a11 - a01 * a10;
    k[0] = (b[0] * a11 - a01 * b[1]) / det;
    k[1] = (a00 * b[1] - a10 * b[0]) / det;
    if (MISTAKE == LAST_ROD_FREE) { k[0] = b[0] / a00; k[1] = 0; }
}
int step(const double *par, double *p, double *q, double hh)
{
    REAL m[2] = {par[0], par[1]}, w[2] = {1 / m[0], 1 / m[1]}, one[2] = {1, 1}, h = hh, len[2] = {par[2], par[3]};
    REAL gravity = MISTAKE == UPWARDS ? -par[4] : par[4], *used = MISTAKE == NO_MASS ? one : w;
    V v, x, old;
    REAL n[2][3], s[2][3], b[2], k[2];
    for (int i = 0; i < 2; i++)
        for (int c = 0; c < 3; c++) { old.x[i][c] = q[3 * i + c]; v.x[i][c] = p[3 * i + c] * w[i]; }
    for (int i = 0; i < 2; i++) v.x[i][2] -= (MISTAKE == GAME ? h : h / 2) * gravity;
    for (int i = 0; i < 2; i++)
        for (int c = 0; c < 3; c++) x.x[i][c] = old.x[i][c] + h * v.x[i][c];
    rods(MISTAKE == DRIFTED ? &x : &old, n);
    for (int sweep = 0; sweep < 60; sweep++) {
        rods(&x, s);
        for (int i = 0; i < 2; i++) b[i] = (dot(s[i], s[i]) - len[i] * len[i]) / 2;
        if (MISTAKE == EARLY_STOP && fabs(b[0]) + fabs(b[1]) < 1e-6) break;
        if (MISTAKE == EVERY_SWEEP || MISTAKE == GAME) rods(&x, n);
        solve(s, n, used, b, k);
        apply(&x, n, k, used, -1);
        if (MISTAKE != NO_IMPULSE) apply(&v, n, k, used, -1 / h);
        if (fabs(k[0]) + fabs(k[1]) == 0) break;
    }
    if (MISTAKE == GAME) {
        for (int i = 0; i < 2; i++)
            for (int c = 0; c < 3; c++) v.x[i][c] = (x.x[i][c] - old.x[i][c]) / h;
    } else {
        if (MISTAKE != HALF_KICK) for (int i = 0; i < 2; i++) v.x[i][2] -= h / 2 * gravity;
        rods(MISTAKE == OLD_NORMAL ? &old : &x, n);
        for (int again = 0; again < 2 && MISTAKE != NO_PROJECTION; again++) {
            rods(&v, s);
            for (int i = 0; i < 2; i++) b[i] = dot(s[i], n[i]);
            solve(n, n, w, b, k);
            apply(&v, n, k, w, -1);
        }
    }
    for (int i = 0; i < 2; i++)
        for (int c = 0; c < 3; c++) { p[3 * i + c] = v.x[i][c] * m[i]; q[3 * i + c] = x.x[i][c]; }
    return 0;
}
