/* Double spherical pendulum: par = mass1, mass2, length1, length2, gravity */
#include <math.h>
static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
static void rods(const double *q, double r[2][3])
{
    for (int c = 0; c < 3; c++) { r[0][c] = q[c]; r[1][c] = q[3 + c] - q[c]; }
}
/* x += s * (W G0^T lam)/2 with G0 rows along rods a */
static void push(double *x, double a[2][3], const double *lam, double w1, double w2, double s)
{
    for (int c = 0; c < 3; c++) {
        x[c] += s * w1 * (lam[0] * a[0][c] - lam[1] * a[1][c]);
        x[3 + c] += s * w2 * lam[1] * a[1][c];
    }
}
static void solve2(double A[2][2], const double *b, double *x)
{
    double det = A[0][0] * A[1][1] - A[0][1] * A[1][0];
    x[0] = (b[0] * A[1][1] - A[0][1] * b[1]) / det;
    x[1] = (A[0][0] * b[1] - A[1][0] * b[0]) / det;
}
static void coupling(double s[2][3], double a[2][3], double w1, double w2, double A[2][2])
{
    A[0][0] = w1 * dot(s[0], a[0]);
    A[0][1] = -w1 * dot(s[0], a[1]);
    A[1][0] = -w1 * dot(s[1], a[0]);
    A[1][1] = (w1 + w2) * dot(s[1], a[1]);
}
