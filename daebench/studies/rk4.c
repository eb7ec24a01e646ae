/* The classical Runge-Kutta method on (1.18) of the spherical pendulum, by hand: what the linked kernel is measured against. */

/* p' and q' = p/m:  p' = -m g e3 - 2 lam q,  2 lam = m (|v|^2 - g q3) / |q|^2. */
#define FORCE(F, p1, p2, p3, q1, q2, q3)                                                                             \
    do {                                                                                                             \
        const double tension = (w * (p1 * p1 + p2 * p2 + p3 * p3) - weight * q3) / (q1 * q1 + q2 * q2 + q3 * q3);    \
        F##1 = -tension * q1;                                                                                        \
        F##2 = -tension * q2;                                                                                        \
        F##3 = -tension * q3 - weight;                                                                               \
    } while (0)

/* Take n steps of size h from state = (p, q); return the number of steps taken, and no sweeps: nothing is iterated.
   The length of the rod does not enter (1.18). */
long rk4(double state[6], double mass, double length, double gravity, double h, long n, long *sweeps)
{
    double p1 = state[0], p2 = state[1], p3 = state[2], q1 = state[3], q2 = state[4], q3 = state[5];
    const double w = 1.0 / mass, weight = mass * gravity, half = 0.5 * h, hw = h * w, halfw = half * w, sixth = h / 6.0;
    long done;
    (void)length;
    for (done = 0; done < n; done++) {
        double a1, a2, a3, b1, b2, b3, c1, c2, c3, d1, d2, d3;
        double r1, r2, r3, s1, s2, s3, t1, t2, t3, x1, x2, x3;
        FORCE(a, p1, p2, p3, q1, q2, q3);
        r1 = p1 + half * a1, r2 = p2 + half * a2, r3 = p3 + half * a3;
        x1 = q1 + halfw * p1, x2 = q2 + halfw * p2, x3 = q3 + halfw * p3;
        FORCE(b, r1, r2, r3, x1, x2, x3);
        s1 = p1 + half * b1, s2 = p2 + half * b2, s3 = p3 + half * b3;
        x1 = q1 + halfw * r1, x2 = q2 + halfw * r2, x3 = q3 + halfw * r3;
        FORCE(c, s1, s2, s3, x1, x2, x3);
        t1 = p1 + h * c1, t2 = p2 + h * c2, t3 = p3 + h * c3;
        x1 = q1 + hw * s1, x2 = q2 + hw * s2, x3 = q3 + hw * s3;
        FORCE(d, t1, t2, t3, x1, x2, x3);
        q1 += sixth * w * (p1 + 2.0 * (r1 + s1) + t1);
        q2 += sixth * w * (p2 + 2.0 * (r2 + s2) + t2);
        q3 += sixth * w * (p3 + 2.0 * (r3 + s3) + t3);
        p1 += sixth * (a1 + 2.0 * (b1 + c1) + d1);
        p2 += sixth * (a2 + 2.0 * (b2 + c2) + d2);
        p3 += sixth * (a3 + 2.0 * (b3 + c3) + d3);
    }
    state[0] = p1, state[1] = p2, state[2] = p3, state[3] = q1, state[4] = q2, state[5] = q3;
    *sweeps = 0;
    return done;
}
