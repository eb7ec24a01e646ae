/* Strang splitting, HLW (1.45), on the spherical pendulum, by hand: what the linked kernel is measured against.
   Half a rotation in the plane of q and p, the potential's kick in the tangent plane, and half a rotation again. */

#include <math.h>

/* Rotate over the time t: the flow of |p|^2 / (2 mass) on |q| = length. */
static inline void rotate(double p[3], double q[3], double mass, double length, double t)
{
    const double w = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) / (mass * length);
    const double half = sin(0.5 * w * t), versine = 2.0 * half * half;
    const double sine = 2.0 * half * cos(0.5 * w * t);
    const double by_q = w > 0.0 ? sine / (mass * w) : t / mass, by_p = mass * w * sine;
    int i;
    for (i = 0; i < 3; i++) {
        const double p0 = p[i], q0 = q[i];
        p[i] = p0 - by_p * q0 - versine * p0;
        q[i] = q0 + by_q * p0 - versine * q0;
    }
}

/* Take n steps of size h from state = (p, q); return the number of steps taken, and no sweeps: nothing is iterated. */
long strang(double state[6], double mass, double length, double gravity, double h, long n, long *sweeps)
{
    double p[3] = {state[0], state[1], state[2]}, q[3] = {state[3], state[4], state[5]};
    const double weight = mass * gravity;
    long done;
    int i;
    for (done = 0; done < n; done++) {
        double mu;
        rotate(p, q, mass, length, 0.5 * h);
        p[2] -= h * weight;
        mu = (q[0] * p[0] + q[1] * p[1] + q[2] * p[2]) / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
        for (i = 0; i < 3; i++)
            p[i] -= mu * q[i];
        rotate(p, q, mass, length, 0.5 * h);
    }
    for (i = 0; i < 3; i++)
        state[i] = p[i], state[3 + i] = q[i];
    *sweeps = 0;
    return done;
}
