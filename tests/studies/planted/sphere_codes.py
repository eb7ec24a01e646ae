"""Two bodies of 2 kg and 1 kg on the unit sphere: rows are bodies, the multipliers come from a quadratic equation each."""

import numpy as np

mass = np.array([[2.0], [1.0]])


def pull(x):
    """-dU/dx, shape(2, 3)."""
    c = x[0] @ x[1]
    f = 1.0 / (np.sqrt(1 - c * c) * np.arccos(c) ** 2)
    return f * x[::-1]


def dots(a, b):
    return np.sum(a * b, axis=1, keepdims=True)


def fall_back(a, n):
    """c with |a - c n| = 1, the small root."""
    nn, an, e = dots(n, n), dots(a, n), dots(a, a) - 1
    return e / (an + np.sqrt(an * an - nn * e))


def flat(p, x):
    return p.ravel().copy(), x.ravel().copy()


def begin(p, q):
    return p.reshape(2, 3), q.reshape(2, 3)


def correct_closed_form(p, q, h):
    p, x = begin(p, q)
    p = p + h / 2 * pull(x)
    free = x + h * p / mass
    c = fall_back(free, x)
    y = free - c * x
    p = p - mass * c * x / h + h / 2 * pull(y)
    p = p - y * dots(y, p) / dots(y, y)
    return flat(p, y)


def end_normal(p, q, h):
    """The end of the step lies where the radius through the free end meets the sphere."""
    p, x = begin(p, q)
    p = p + h / 2 * pull(x)
    free = x + h * p / mass
    y = free / np.sqrt(dots(free, free))
    p = mass * (y - x) / h
    p = p + h / 2 * pull(y)
    p = p - y * dots(y, p) / dots(y, y)
    return flat(p, y)


def no_impulse(p, q, h):
    p, x = begin(p, q)
    p = p + h / 2 * pull(x)
    free = x + h * p / mass
    y = free - fall_back(free, x) * x
    p = p + h / 2 * pull(y)
    p = p - y * dots(y, p) / dots(y, y)
    return flat(p, y)


def shake_only(p, q, h):
    p, x = begin(p, q)
    p = p + h / 2 * pull(x)
    free = x + h * p / mass
    c = fall_back(free, x)
    y = free - c * x
    return flat(p - mass * c * x / h + h / 2 * pull(y), y)


def first_kick_full(p, q, h):
    """h in place of h/2, in the first of the two kicks."""
    p, x = begin(p, q)
    p = p + h * pull(x)
    free = x + h * p / mass
    c = fall_back(free, x)
    y = free - c * x
    p = p - mass * c * x / h + h / 2 * pull(y)
    p = p - y * dots(y, p) / dots(y, y)
    return flat(p, y)


def force_of_the_start(p, q, h):
    p, x = begin(p, q)
    kick = h / 2 * pull(x)
    p = p + kick
    free = x + h * p / mass
    c = fall_back(free, x)
    y = free - c * x
    p = p - mass * c * x / h + kick
    p = p - y * dots(y, p) / dots(y, y)
    return flat(p, y)


def one_newton(p, q, h):
    """One Newton step for each multiplier."""
    p, x = begin(p, q)
    p = p + h / 2 * pull(x)
    free = x + h * p / mass
    c = (dots(free, free) - 1) / (2 * dots(free, x))
    y = free - c * x
    p = p - mass * c * x / h + h / 2 * pull(y)
    p = p - y * dots(y, p) / dots(y, y)
    return flat(p, y)


def forgets_mass_in_shift(p, q, h):
    """The position is shifted by the impulse times h, not divided by the mass."""
    p, x = begin(p, q)
    p = p + h / 2 * pull(x)
    free = x + h * p / mass
    c = fall_back(free, x)
    y = free - c * x
    p = p - c * x / h + h / 2 * pull(y)
    p = p - y * dots(y, p) / dots(y, y)
    return flat(p, y)


def p_for_v(p, q, h):
    v, x = begin(p, q)
    v = v + h / 2 * pull(x) / mass
    free = x + h * v
    c = fall_back(free, x)
    y = free - c * x
    v = v - c * x / h + h / 2 * pull(y) / mass
    v = v - y * dots(y, v) / dots(y, y)
    return flat(v, y)


def v_for_p(p, q, h):
    """Divides by the mass at the start, and gives back velocities."""
    p, x = begin(p, q)
    v = p / mass
    v = v + h / 2 * pull(x) / mass
    free = x + h * v
    c = fall_back(free, x)
    y = free - c * x
    v = v - c * x / h + h / 2 * pull(y) / mass
    v = v - y * dots(y, v) / dots(y, y)
    return flat(v, y)


def half_multiplier(p, q, h):
    p, x = begin(p, q)
    p = p + h / 2 * pull(x)
    free = x + h * p / mass
    c = fall_back(free, x)
    y = free - c * x
    p = p - 0.5 * mass * c * x / h + h / 2 * pull(y)
    p = p - y * dots(y, p) / dots(y, y)
    return flat(p, y)


def reflected(p, q, h):
    """The velocity stage puts its multiplier in with the wrong sign."""
    p, x = begin(p, q)
    p = p + h / 2 * pull(x)
    free = x + h * p / mass
    c = fall_back(free, x)
    y = free - c * x
    p = p - mass * c * x / h + h / 2 * pull(y)
    p = p + y * dots(y, p) / dots(y, y)
    return flat(p, y)


def normalised(p, q, h):
    """Velocity Verlet in space to its end, then both points back on the sphere and both momenta into its tangent planes."""
    p, x = begin(p, q)
    p = p + h / 2 * pull(x)
    y = x + h * p / mass
    p = p + h / 2 * pull(y)
    y = y / np.sqrt(dots(y, y))
    p = p - y * dots(y, p)
    return flat(p, y)


def midpoint_reduced(p, q, h):
    """Implicit midpoint with the centripetal force written out."""

    def rhs(p, x):
        f = pull(x)
        lam = (dots(p, p) / mass + dots(x, f)) / dots(x, x)
        return f - lam * x, p / mass

    p, x = begin(p, q)
    P, X = p, x
    for _ in range(200):
        dp, dx = rhs((p + P) / 2, (x + X) / 2)
        Pn, Xn = p + h * dp, x + h * dx
        moved = max(np.max(np.abs(Pn - P)), np.max(np.abs(Xn - X)))
        P, X = Pn, Xn
        if moved < 1e-15:
            break
    return flat(P, X)


def solve_late(p, q, h, t):
    """Fills the rows first and steps afterwards: row k is the state at time k h, from 0, where t begins with h."""
    n = int(np.rint(np.max(t) / h))
    P, Q = np.empty((n + 1, 6)), np.empty((n + 1, 6))
    P[0], Q[0] = p, q
    for k in range(n):
        P[k + 1], Q[k + 1] = correct_closed_form(P[k], Q[k], h)
    rows = np.rint(np.asarray(t) / h).astype(int) - 1
    return P[rows], Q[rows]
