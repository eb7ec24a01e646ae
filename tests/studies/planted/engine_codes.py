"""Rods between particles as game engines and molecular codes step them: objects, velocities, one rod after the other, any precision.

``World(model, habit)`` is a code whose author has one bad habit, or none; the step is written from scratch, in velocities.
"""

import copy

import numpy as np

MODELS = {}
"""Masses, rods (i, j, length) with the pivot -1 at the origin, dimensions, and the accelerations of the particles."""


def model(masses, rods, dim):
    def register(acceleration):
        MODELS[acceleration.__name__] = (np.array(masses), rods, dim, acceleration)
        return acceleration

    return register


@model([2.5], [(-1, 0, 1.0)], 2)
def single(x):
    return np.array([[0.0, -3.0]])


@model([1.0, 3.0], [(-1, 0, 1.0), (0, 1, 1.0)], 2)
def double(x):
    return np.array([[0.0, -9.81], [0.0, -9.81]])


@model([2.0, 0.5], [(-1, 0, 1.0), (0, 1, 1.0)], 3)
def double_in_space(x):
    return np.array([[0.0, 0.0, -9.81], [0.0, 0.0, -9.81]])


@model([1.5, 0.4], [(-1, 0, 1.0), (0, 1, 0.7)], 3)
def sprung(x):
    one, two = x[0] - np.array([0.0, 0.0, 2.0]), x[1] - np.array([1.0, -1.0, 0.5])
    return np.stack([-30.0 / 1.5 * one, -9.0 / 0.4 * (two @ two) * two]) - np.array([0.0, 0.0, 3.0])


@model([1.0, 1.0, 1.0], [(-1, 0, 1.0), (0, 1, 1.0), (1, 2, 1.0)], 2)
def three(x):
    return np.array([[0.0, -9.81]] * 3)


ROUNDS = 3000


class World:
    """Particles and rods."""

    def __init__(self, name, habit="", real=np.float64):
        masses, self.rods, self.dim, self.acceleration = MODELS[name]
        self.habit, self.real = habit, real
        self.mass = masses.astype(real)[:, None]
        self.w = (1 / masses).astype(real)

    # ---- small tools

    def a(self, x):
        scale = {"force_scaled": 0.75, "force_sign": -1.0}.get(self.habit, 1.0)
        return (scale * self.acceleration(x.astype(float))).astype(self.real)

    def along(self, x):
        return [x[j] - x[i] if i >= 0 else x[j].copy() for i, j, _ in self.rods]

    def weights(self, i, j):
        wi = self.w[i] if i >= 0 else self.real(0)
        wj = self.w[j]
        if self.habit == "reaction_missing" and i >= 0:
            wi = self.real(0)
        return wi, wj

    def length(self, k):
        return self.real(self.rods[k][2] * (1.03 if self.habit == "constraint_shifted" and k == len(self.rods) - 1 else 1.0))

    def used(self, which):
        n = len(self.rods)
        if self.habit == which or (self.habit == "constraint_missing" and n > 1):
            n -= 1
        return range(n)

    def pull(self, y, k, amount, direction, ones=False):
        i, j, _ = self.rods[k]
        wi, wj = (self.real(i >= 0), self.real(1)) if ones else self.weights(i, j)
        y[j] -= wj * amount * direction
        if i >= 0:
            y[i] += wi * amount * direction

    # ---- positions

    def put_back(self, x, v, h, reference=None, rounds=ROUNDS, stop=0.0, ones=False, share=1.0):
        """Move x onto the rods, one after the other, along reference or along where the rods point now, and v with it."""
        total = [self.real(0)] * len(self.rods)
        before = np.inf
        for count in range(rounds):
            worst = 0.0
            for k in self.used("constraint_missing_in_position"):
                i, j, _ = self.rods[k]
                s = self.along(x)[k]
                r = s if reference is None else reference[k]
                gap = s @ s - self.length(k) ** 2
                worst = max(worst, abs(float(gap)))
                wi, wj = (self.real(i >= 0), self.real(1)) if ones else self.weights(i, j)
                amount = gap / (2 * (wi + wj) * (s @ r))
                if self.habit == "rope" and total[k] + amount < 0:
                    amount = -total[k]
                total[k] += amount
                self.pull(x, k, amount, r, ones)
                self.pull(v, k, share * amount / h, r, ones)
            if worst <= stop or (count > 3 and worst >= before and worst < 1e3 * np.finfo(self.real).eps):
                break
            before = worst
        return total

    # ---- velocities

    def make_rigid(self, v, x, rounds=ROUNDS, share=1.0, ones=False, stop=0.0):
        r = self.along(x)
        goal = v.copy()
        before = np.inf
        for count in range(rounds):
            worst = 0.0
            for k in self.used("constraint_missing_in_velocity"):
                i, j, _ = self.rods[k]
                rate = r[k] @ (self.along(goal)[k])
                worst = max(worst, abs(float(rate)))
                wi, wj = (self.real(i >= 0), self.real(1)) if ones else self.weights(i, j)
                self.pull(goal, k, rate / ((wi + wj) * (r[k] @ r[k])), r[k], ones)
            if worst <= stop or (count > 3 and worst >= before and worst < 1e4 * np.finfo(self.real).eps):
                break
            before = worst
        v += share * (goal - v)

    # ---- steps

    def step(self, p, q, h):
        """The interface: momenta and positions, flat."""
        x = q.reshape(-1, self.dim).astype(self.real)
        v = p.reshape(-1, self.dim).astype(self.real)
        if self.habit != "velocity_for_momentum":
            v = v / self.mass
        h = self.real(0.02 if self.habit == "step_size_ignored" else h)
        v, x = getattr(self, "step_" + self.habit, self.usual)(v, x, h)
        if self.habit != "velocity_for_momentum":
            v = v * self.mass
        return v.ravel(), x.ravel()

    def usual(self, v, x0, h):
        """RATTLE, but for the habit."""
        habit = self.habit
        old, before = self.along(x0), v.copy()
        if habit == "momentum_damped":
            v = v * self.real(0.98)
        first = {"full_kick": 1.0, "no_first_kick": 0.0, "no_kick": 0.0}.get(habit, 0.5)
        second = {"full_kick": 1.0, "no_second_kick": 0.0, "no_kick": 0.0, "momentum_at_half_step": 0.0}.get(habit, 0.5)
        if habit == "momentum_at_half_step":
            first = 1.0
        force = self.a(x0)
        v = v + self.real(first) * h * force
        x = x0 + h * (before if habit == "position_without_force" else v)
        free = x.copy()
        reference = old
        if habit == "reference_gradient_each_sweep":
            reference = None
        elif habit == "reference_gradient_after_drift":
            reference = self.along(x)
        elif habit == "reference_gradient_after_free_drift":
            reference = self.along(x0 + h * before)
        rounds = {"one_sweep": 1}.get(habit, ROUNDS)
        stop = {"loose_tolerance": 1e-3, "loose_tolerance_fine": 1e-9, "shake_to_a_tolerance": 1e-6}.get(habit, 0.0)
        share = {"momentum_not_corrected": 0.0, "multiplier_sign": -1.0, "multiplier_half": 0.5, "multiplier_double": 2.0}.get(habit, 1.0)
        if habit == "multiplier_times_h":
            share = h
        if habit in ("reference_gradient_at_q1", "reference_gradient_at_midpoint"):
            v, x = self.implicit(v, x0, h, 1.0 if habit.endswith("q1") else 0.5)
        else:
            self.put_back(x, v, h, reference, rounds, stop, habit == "mass_missing_in_position", share)
        if habit == "velocity_projected_before_kick":
            self.make_rigid(v, x)
        at = {"old_force": x0, "force_before_correction": free}.get(habit, x)
        v = v + self.real(second) * h * self.a(at)
        if habit not in ("velocity_not_projected", "shake_to_a_tolerance", "momentum_at_half_step", "velocity_projected_before_kick"):
            place = {"velocity_projected_at_q0": x0, "velocity_projected_at_free": free}.get(habit, x)
            part = {"half_of_velocity": 0.5}.get(habit, 1.0)
            loose = 1e-4 if habit == "loose_velocity" else 0.0
            self.make_rigid(v, place, share=self.real(part), ones=habit == "mass_missing_in_velocity", stop=loose)
        if habit == "damped_after":
            v = v * self.real(0.995)
        return v, x

    def implicit(self, v, x0, h, part):
        x = x0 + h * v
        for _ in range(200):
            reference = self.along(x0 + self.real(part) * (x - x0))
            y, u = x0 + h * v, v.copy()
            self.put_back(y, u, h, reference)
            done = np.abs(y - x).max() < 4 * np.finfo(self.real).eps
            x = y
            if done:
                break
        return u, x

    def step_step_off_by_one(self, v, x, h):
        self = copy.copy(self)
        self.habit = ""
        return self.usual(*self.usual(v, x, h), h)

    def step_position_based(self, v, x0, h):
        x = x0 + h * (v + h * self.a(x0))
        self.put_back(x, v.copy(), h)
        return (x - x0) / h, x

    def step_position_based_few(self, v, x0, h):
        """Four rounds, and the velocities a little damped."""
        x = x0 + h * (v + h * self.a(x0))
        self.put_back(x, v.copy(), h, rounds=4)
        return self.real(0.99) * (x - x0) / h, x

    def step_projected_after(self, v, x0, h):
        v = v + h / 2 * self.a(x0)
        x = x0 + h * v
        v = v + h / 2 * self.a(x)
        self.put_back(x, v.copy(), h)
        self.make_rigid(v, x)
        return v, x

    # ---- accelerations with the rods' forces in them

    def bound_acceleration(self, x, v, damping=0.0, stiffness=0.0):
        n = len(self.rods)
        A, b = np.zeros((n, n)), np.zeros(n)
        J = np.zeros((n, x.size))
        a = self.a(x).astype(float)
        for k, (i, j, length) in enumerate(self.rods):
            s, u = self.along(x)[k], self.along(v)[k]
            J[k, j * self.dim : (j + 1) * self.dim] = s
            if i >= 0:
                J[k, i * self.dim : (i + 1) * self.dim] = -s
            b[k] = u @ u + J[k] @ a.ravel() + damping * (s @ u) + stiffness * (s @ s - length**2) / 2
        w = np.repeat(self.w, self.dim).astype(float)
        A = (J * w) @ J.T
        return (a - (w * (J.T @ np.linalg.solve(A, b))).reshape(x.shape)).astype(self.real)

    def runge_kutta(self, v, x, h, **feedback):
        def f(x, v):
            return self.bound_acceleration(x, v, **feedback)

        k1, l1 = v, f(x, v)
        k2, l2 = v + h / 2 * l1, f(x + h / 2 * k1, v + h / 2 * l1)
        k3, l3 = v + h / 2 * l2, f(x + h / 2 * k2, v + h / 2 * l2)
        k4, l4 = v + h * l3, f(x + h * k3, v + h * l3)
        return v + h / 6 * (l1 + 2 * l2 + 2 * l3 + l4), x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)

    def step_index_reduced(self, v, x, h):
        return self.runge_kutta(v, x, h)

    feedback = 14.0, 60.0

    def step_baumgarte(self, v, x, h):
        damping, stiffness = self.feedback
        return self.runge_kutta(v, x, h, damping=damping, stiffness=stiffness)


EXPECTED = {
    "": "correct",
    "force_sign": "force_scaled",
    "rope": "multiplier_clamped",
    "constraint_missing_in_position": "constraint_missing",
    "constraint_missing_in_velocity": "constraint_missing",
    "reference_gradient_after_free_drift": "reference_gradient_after_drift",
    "no_first_kick": "kick_missing",
    "no_second_kick": "kick_missing",
    "no_kick": "kick_missing",
    "loose_tolerance_fine": "loose_tolerance",
    "loose_velocity": "loose_tolerance",
    "shake_to_a_tolerance": "velocity_not_projected",
    "multiplier_double": "multiplier_half",
    "half_of_velocity": "multiplier_half",
    "velocity_projected_at_free": "velocity_projected_at_q0",
    "damped_after": "momentum_damped",
    "position_based_few": "position_based",
}
"""The fault that a habit is, where it has another name."""

HABITS = (
    "",
    "reference_gradient_at_q1",
    "reference_gradient_each_sweep",
    "reference_gradient_after_drift",
    "reference_gradient_after_free_drift",
    "reference_gradient_at_midpoint",
    "momentum_not_corrected",
    "velocity_not_projected",
    "shake_to_a_tolerance",
    "full_kick",
    "old_force",
    "one_sweep",
    "loose_tolerance",
    "loose_tolerance_fine",
    "loose_velocity",
    "mass_missing_in_position",
    "mass_missing_in_velocity",
    "velocity_for_momentum",
    "multiplier_sign",
    "multiplier_half",
    "multiplier_double",
    "half_of_velocity",
    "index_reduced",
    "projected_after",
    "baumgarte",
    "position_based",
    "position_based_few",
    "momentum_at_half_step",
    "velocity_projected_at_q0",
    "velocity_projected_at_free",
    "velocity_projected_before_kick",
    "force_before_correction",
    "no_first_kick",
    "no_second_kick",
    "no_kick",
    "position_without_force",
    "multiplier_times_h",
    "rope",
    "constraint_missing",
    "constraint_missing_in_position",
    "constraint_missing_in_velocity",
    "constraint_shifted",
    "reaction_missing",
    "force_scaled",
    "force_sign",
    "momentum_damped",
    "damped_after",
    "step_size_ignored",
    "step_off_by_one",
)
"""All habits."""
