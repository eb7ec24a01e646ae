/* Pendulum chain of three links: SHAKE with a single pass over the rods, then the velocities properly. par = mass, length, gravity */
#include <math.h>
#define N 3
static void rod(const double *x, int k, double d[2])
{
    for (int c = 0; c < 2; c++) d[c] = x[2 * k + c] - (k ? x[2 * k - 2 + c] : 0.0);
}
int step(const double *par, double *p, double *q, double h)
{
    double m = par[0], l = par[1], g = par[2], x[2 * N], d[2], s[2];
    for (int k = 0; k < N; k++) p[2 * k + 1] -= 0.5 * h * m * g;
    for (int i = 0; i < 2 * N; i++) x[i] = q[i] + h * p[i] / m;
    for (int k = 0; k < N; k++) {
        rod(q, k, d);
        rod(x, k, s);
        double w = k ? 2.0 / m : 1.0 / m;
        double lam = (s[0] * s[0] + s[1] * s[1] - l * l) / (2.0 * w * (s[0] * d[0] + s[1] * d[1]));
        for (int c = 0; c < 2; c++) {
            x[2 * k + c] -= lam * d[c] / m;
            p[2 * k + c] -= lam * d[c] / h;
            if (k) {
                x[2 * k - 2 + c] += lam * d[c] / m;
                p[2 * k - 2 + c] += lam * d[c] / h;
            }
        }
    }
    for (int i = 0; i < 2 * N; i++) q[i] = x[i];
    for (int k = 0; k < N; k++) p[2 * k + 1] -= 0.5 * h * m * g;
    for (int it = 0; it < 5000; it++) {
        double worst = 0;
        for (int k = 0; k < N; k++) {
            rod(q, k, s);
            double w = k ? 2.0 : 1.0, r = 0;
            for (int c = 0; c < 2; c++) r += s[c] * (p[2 * k + c] - (k ? p[2 * k - 2 + c] : 0.0));
            worst = fmax(worst, fabs(r));
            r /= w * (s[0] * s[0] + s[1] * s[1]);
            for (int c = 0; c < 2; c++) {
                p[2 * k + c] -= r * s[c];
                if (k) p[2 * k - 2 + c] += r * s[c];
            }
        }
        if (worst < 1e-14) break;
    }
    return 0;
}
