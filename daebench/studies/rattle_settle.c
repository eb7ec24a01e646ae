/* RATTLE with SETTLE on a rigid water molecule in a field and a well, by hand: what the linked kernel is measured against.
   Miyamoto and Kollman, J. Comput. Chem. 13 (1992) 952-962, with distances from oxygen; momenta by the inverse of the constant matrix. */

#include <math.h>

/* Take n steps of size h from state = (p, q); return the number of steps taken, and no sweeps: nothing is iterated. */
long rattle_settle(double state[18], double m_O, double m_H, double bond, double angle, double charge, double field, double stiffness,
                   double h, long n, long *sweeps)
{
    const double half_angle = 0.5 * angle * 3.14159265358979323846 / 180.0, push = charge * field;
    const double rc = bond * sin(half_angle), height = bond * cos(half_angle), part = m_H / (m_O + 2.0 * m_H);
    const double ra = 2.0 * part * height, rb = height - ra, w_O = 1.0 / m_O, w_H = 1.0 / m_H;
    const double d2 = bond * bond, e2 = 4.0 * rc * rc, between = d2 - 0.5 * e2;
    const double same = d2 * (w_O + w_H), other = between * w_O, edge = 0.5 * e2 * w_H, far = 2.0 * e2 * w_H;
    const double det = 1.0 / ((same + other) * far - 2.0 * edge * edge), apart = 0.5 / (same - other);
    double p[9], q[9];
    long done;
    int i;
    for (i = 0; i < 9; i++)
        p[i] = state[i], q[i] = state[9 + i];
    for (done = 0; done < n; done++) {
        double x[9], b0[3], c0[3], a1[3], b1[3], c1[3], Z[3], X[3], Y[3], a3[3], b3[3], c3[3], w, v[9], e1[3], e3[3], eh[3];
        double b0x, b0y, c0x, c0y, a1z, b1x, b1y, b1z, c1x, c1y, c1z, s_phi, c_phi, s_psi, c_psi, s_theta, c_theta;
        double bx, by, cy, tilt, alpha, beta, gamma, total, r1, r2, r3, plus, minus, mu1, mu2, mu3;
        /* kick and drift */
        for (i = 0; i < 3; i++)
            p[i] -= 0.5 * h * stiffness * q[i];
        p[2] -= h * push;
        p[5] += 0.5 * h * push;
        p[8] += 0.5 * h * push;
        for (i = 0; i < 3; i++) {
            x[i] = q[i] + h * w_O * p[i];
            x[3 + i] = q[3 + i] + h * w_H * p[3 + i];
            x[6 + i] = q[6 + i] + h * w_H * p[6 + i];
            b0[i] = q[3 + i] - q[i];
            c0[i] = q[6 + i] - q[i];
            b1[i] = x[3 + i] - x[i];
            c1[i] = x[6 + i] - x[i];
            a1[i] = -part * (b1[i] + c1[i]);
            b1[i] += a1[i];
            c1[i] += a1[i];
        }
        /* the axes of the old plane */
        Z[0] = b0[1] * c0[2] - b0[2] * c0[1];
        Z[1] = b0[2] * c0[0] - b0[0] * c0[2];
        Z[2] = b0[0] * c0[1] - b0[1] * c0[0];
        w = 1.0 / sqrt(Z[0] * Z[0] + Z[1] * Z[1] + Z[2] * Z[2]);
        Z[0] *= w, Z[1] *= w, Z[2] *= w;
        X[0] = a1[1] * Z[2] - a1[2] * Z[1];
        X[1] = a1[2] * Z[0] - a1[0] * Z[2];
        X[2] = a1[0] * Z[1] - a1[1] * Z[0];
        w = 1.0 / sqrt(X[0] * X[0] + X[1] * X[1] + X[2] * X[2]);
        X[0] *= w, X[1] *= w, X[2] *= w;
        Y[0] = Z[1] * X[2] - Z[2] * X[1];
        Y[1] = Z[2] * X[0] - Z[0] * X[2];
        Y[2] = Z[0] * X[1] - Z[1] * X[0];
        b0x = X[0] * b0[0] + X[1] * b0[1] + X[2] * b0[2];
        b0y = Y[0] * b0[0] + Y[1] * b0[1] + Y[2] * b0[2];
        c0x = X[0] * c0[0] + X[1] * c0[1] + X[2] * c0[2];
        c0y = Y[0] * c0[0] + Y[1] * c0[1] + Y[2] * c0[2];
        a1z = Z[0] * a1[0] + Z[1] * a1[1] + Z[2] * a1[2];
        b1x = X[0] * b1[0] + X[1] * b1[1] + X[2] * b1[2];
        b1y = Y[0] * b1[0] + Y[1] * b1[1] + Y[2] * b1[2];
        b1z = Z[0] * b1[0] + Z[1] * b1[1] + Z[2] * b1[2];
        c1x = X[0] * c1[0] + X[1] * c1[1] + X[2] * c1[2];
        c1y = Y[0] * c1[0] + Y[1] * c1[1] + Y[2] * c1[2];
        c1z = Z[0] * c1[0] + Z[1] * c1[1] + Z[2] * c1[2];
        /* the three angles */
        s_phi = a1z / ra;
        c_phi = sqrt(1.0 - s_phi * s_phi);
        s_psi = (b1z - c1z) / (2.0 * rc * c_phi);
        c_psi = sqrt(1.0 - s_psi * s_psi);
        bx = -rc * c_psi;
        tilt = rc * s_psi * s_phi;
        by = -rb * c_phi - tilt;
        cy = -rb * c_phi + tilt;
        alpha = bx * (b0x - c0x) + b0y * by + c0y * cy;
        beta = bx * (c0y - b0y) + b0x * by + c0x * cy;
        gamma = b0x * b1y - b1x * b0y + c0x * c1y - c1x * c0y;
        total = alpha * alpha + beta * beta;
        s_theta = (alpha * gamma - beta * sqrt(total - gamma * gamma)) / total;
        c_theta = sqrt(1.0 - s_theta * s_theta);
        if (!(fabs(s_phi) < 1.0 && fabs(s_psi) < 1.0 && fabs(s_theta) < 1.0))
            break;
        /* back to space, and the momenta that go with it */
        for (i = 0; i < 3; i++) {
            a3[i] = X[i] * (-ra * c_phi * s_theta) + Y[i] * (ra * c_phi * c_theta) + Z[i] * a1z - a1[i];
            b3[i] = X[i] * (bx * c_theta - by * s_theta) + Y[i] * (bx * s_theta + by * c_theta) + Z[i] * b1z - b1[i];
            c3[i] = X[i] * (-bx * c_theta - cy * s_theta) + Y[i] * (-bx * s_theta + cy * c_theta) + Z[i] * c1z - c1[i];
            q[i] = x[i] + a3[i];
            q[3 + i] = x[3 + i] + b3[i];
            q[6 + i] = x[6 + i] + c3[i];
            p[i] += m_O / h * a3[i] - 0.5 * h * stiffness * q[i];
            p[3 + i] += m_H / h * b3[i];
            p[6 + i] += m_H / h * c3[i];
        }
        p[2] -= h * push;
        p[5] += 0.5 * h * push;
        p[8] += 0.5 * h * push;
        for (i = 0; i < 3; i++) {
            v[i] = w_O * p[i];
            v[3 + i] = w_H * p[3 + i];
            v[6 + i] = w_H * p[6 + i];
            e1[i] = q[3 + i] - q[i];
            e3[i] = q[6 + i] - q[i];
            eh[i] = q[6 + i] - q[3 + i];
        }
        r1 = e1[0] * (v[3] - v[0]) + e1[1] * (v[4] - v[1]) + e1[2] * (v[5] - v[2]);
        r2 = e3[0] * (v[6] - v[0]) + e3[1] * (v[7] - v[1]) + e3[2] * (v[8] - v[2]);
        r3 = eh[0] * (v[6] - v[3]) + eh[1] * (v[7] - v[4]) + eh[2] * (v[8] - v[5]);
        plus = (0.5 * far * (r1 + r2) - edge * r3) * det;
        minus = (r1 - r2) * apart;
        mu1 = plus + minus;
        mu2 = plus - minus;
        mu3 = ((same + other) * r3 - edge * (r1 + r2)) * det;
        for (i = 0; i < 3; i++) {
            p[i] += mu1 * e1[i] + mu2 * e3[i];
            p[3 + i] -= mu1 * e1[i] - mu3 * eh[i];
            p[6 + i] -= mu2 * e3[i] + mu3 * eh[i];
        }
    }
    for (i = 0; i < 9; i++)
        state[i] = p[i], state[9 + i] = q[i];
    *sweeps = 0;
    return done;
}
