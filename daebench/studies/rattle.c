/* RATTLE, HLW (1.25), on the spherical pendulum, by hand: what the linked kernels are measured against.
   Newton runs until the increment of q is at round-off, as everywhere in this package. */

#include <math.h>

#define EPS 2.220446049250313e-16

/* Take n steps of size h from state = (p, q); return the number of steps taken. */
long rattle(double state[6], double mass, double length, double gravity, double h, long n, long *sweeps)
{
    double p1 = state[0], p2 = state[1], p3 = state[2], q1 = state[3], q2 = state[4], q3 = state[5];
    const double w = 1.0 / mass, ll = length * length, weight = mass * gravity;
    long done, total = 0;
    for (done = 0; done < n; done++) {
        const double G1 = 2.0 * q1, G2 = 2.0 * q2, G3 = 2.0 * q3;
        const double V1 = w * G1, V2 = w * G2, V3 = w * G3;
        double nu = 0.0, last = INFINITY, x1, x2, x3, mu, r3;
        int sweep;
        p3 -= 0.5 * h * weight;
        x1 = q1 + h * w * p1;
        x2 = q2 + h * w * p2;
        x3 = q3 + h * w * p3;
        for (sweep = 1;; sweep++) {
            const double value = x1 * x1 + x2 * x2 + x3 * x3 - ll;
            const double change = value / (2.0 * (x1 * V1 + x2 * V2 + x3 * V3));
            const double d1 = change * V1, d2 = change * V2, d3 = change * V3;
            const double size = fabs(d1) + fabs(d2) + fabs(d3);
            double scale;
            x1 -= d1;
            x2 -= d2;
            x3 -= d3;
            nu += change;
            scale = fabs(x1) + fabs(x2) + fabs(x3);
            if (scale < 1.0)
                scale = 1.0;
            if (size <= 4.0 * EPS * scale || (size >= last && size <= 1e4 * EPS * scale))
                break;
            if (sweep == 100 || !(size < INFINITY))
                goto end;
            last = size;
        }
        total += sweep;
        nu /= h;
        p1 -= nu * G1;
        p2 -= nu * G2;
        r3 = p3 - nu * G3 - 0.5 * h * weight;
        mu = (x1 * p1 + x2 * p2 + x3 * r3) / (x1 * x1 + x2 * x2 + x3 * x3);
        p1 -= mu * x1;
        p2 -= mu * x2;
        p3 = r3 - mu * x3;
        q1 = x1;
        q2 = x2;
        q3 = x3;
    }
end:
    state[0] = p1, state[1] = p2, state[2] = p3, state[3] = q1, state[4] = q2, state[5] = q3;
    *sweeps = total;
    return done;
}
