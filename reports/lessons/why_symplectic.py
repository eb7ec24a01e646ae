# /// script
# [tool.marimo.display]
# theme = "system"
# ///
"""The symplectic area of a parallelogram of tangent vectors under the steps of a method."""

import marimo

app = marimo.App(width="medium", app_title="Why index reduction breaks symplecticity")


@app.cell
def _():
    import marimo as mo

    from daebench.pages.lesson import live
    from daebench.pages.report import at_most, number
    from daebench.reports.lessons import _why_symplectic as lesson

    live.style()
    return at_most, lesson, live, mo, number


@app.cell
def _(mo):
    mo.md(r"""
    # Why index reduction breaks symplecticity

    A point of mass swings on a rod: a spherical pendulum. In Cartesian coordinates its equations have a constraint, the length of the
    rod, and a multiplier $\lambda$: the rod exerts the force $-G(q)^T\lambda$.

    $$\dot q = H_p(p,q), \qquad \dot p = -H_q(p,q) - G(q)^T\lambda, \qquad 0 = g(q) = q^Tq - 1 \tag{HLW VII.1.9}$$

    with $G = g_q$. No equation for $\lambda$ is given. One remedy is to differentiate the constraint until there is such an equation. The
    first derivative is $0 = G(q)H_p(p,q)$: the velocity is tangent to the sphere. The second derivative gives $\lambda = \lambda(p,q)$. The
    result is an ordinary differential equation: the index is *reduced*.

    $$\dot q = H_p(p,q), \qquad \dot p = -H_q(p,q) - G(q)^T\lambda(p,q) \tag{HLW VII.1.18}$$

    On the manifold $\mathcal M$ of states with $g = 0$ and $GH_p = 0$ both systems have the same solutions. So it should not matter to
    which of the two a method is applied. It does.
    """)
    return


@app.cell
def _(facts, mo, number):
    torus, pendulum = facts.fair.torus, facts.fair.pendulum
    mo.md(f"""
    ## A fair comparison

    A bead slides through the hole of a torus, again and again. All methods take the step h = 0.1 s, up to t = 10 000 s. Gauss's method with
    two stages is symplectic for every Hamiltonian system and has order four. Its largest energy error depends on the equations that it
    solves:

    | method | equations | largest energy error, J | |
    |---|---|---|---|
    | RATTLE, order 2 | with the constraint | {number(torus["rattle"], 3)} | level |
    | Lobatto 3, order 4 | with the constraint | {number(torus["lobatto3"], 3)} | level |
    | Gauss 2 | in angles and momenta, without constraints | {number(torus["canonical:gauss2"], 3)} | level |
    | Gauss 2 | in angles and rates (HLW VII.2.22): a Poisson system with B(y) | {number(torus["local:gauss2"], 3)} | grows linearly |
    | Gauss 2 | reduced (1.18) | {number(torus["gauss2"], 3)} | passes RATTLE at t = {facts.fair.crossing:.0f} s |

    The loss in the last row is due to index reduction: the same method loses nothing in angles and momenta. (RK4 on the reduced equations
    overflows at t = {facts.fair.gone:.0f} s. It is no symplectic method, so its end says nothing about index reduction.)

    **An exception.** A pendulum moves, in reverse, along the mirror image of its path. A symmetric method with a small step then has no
    drift, symplectic or not (HLW XI.2 and XI.3). From one radian and a push sideways, with h = 0.05 s up to t = 5000 s, the midpoint rule
    on (1.18) has a largest energy error of {number(pendulum["midpoint"], 2)} J, as RATTLE has ({number(pendulum["rattle"], 2)} J), and
    Gauss 2 on (1.18) one of {number(pendulum["gauss2"], 2)} J. The bead on the torus goes the other way through the hole in reverse, and
    no mirror undoes that.
    """)
    return


@app.cell
def _(mo):
    mo.md(r"""
    ## What to look at

    Take two tangent vectors of $\mathcal M$: two small changes of the start that respect the rod. They span a parallelogram. Its
    *symplectic area* is the sum of the oriented areas of its shadows in the three planes of a position and its momentum,

    $$dq\wedge dp \,=\, \sum_{i=1}^{3} ( dq_i\,\delta p_i - dp_i\,\delta q_i ), \tag{HLW VI.2}$$

    and the exact motion never changes it: the flow on $\mathcal M$ is symplectic. A method is a map too, and its linearised steps transform
    the parallelogram. Here the derivative is exact to the last digit: it is taken by a complex step.
    """)
    return


@app.cell
def _(lesson, live):
    live.prepare(lesson.preparations())
    facts = lesson.facts()
    return (facts,)


@app.cell
def _(mo):
    mo.md(r"""
    ## Try it

    Green is the parallelogram at the start, with area 1; red is its image at the end of the run. The shadows may grow long and thin. The
    question is whether their areas still add up to 1.
    """)
    return


@app.cell
def _(lesson, live):
    knobs = live.panel(lesson.PARALLELOGRAM)
    live.arranged(knobs)
    return (knobs,)


@app.cell
def _(knobs, lesson, live):
    live.shown(lesson.PARALLELOGRAM, knobs)
    return


@app.cell
def _(at_most, facts, mo, number):
    mo.md(f"""
    ## What you see

    With h = {facts.h} s, after {facts.t_end:g} s the area is {number(facts.runs["se"].area[-1], 3)} with symplectic Euler on the reduced
    equations, {number(facts.runs["rk4"].area[-1], 6)} with the method of Runge and Kutta on the same equations, and with RATTLE it
    differs from 1 by {number(facts.runs["rattle"].change, 1)}. RATTLE has only order two, and yet keeps the area to round-off. The method
    of order four comes close, but does not keep it.

    Projection of each step of symplectic Euler onto the manifold removes the distance from it: |g| is then at most
    {at_most(max(facts.projected.g), 1)}. But the area becomes {number(facts.projected.area[-1], 3)}: the projection is a further map, and
    it is not symplectic.
    """)
    return


@app.cell
def _(mo):
    mo.md(r"""
    ## Why

    Let $x = (p,q)$, and let two vectors $\xi_1(t)$, $\xi_2(t)$ satisfy the variational equation of the reduced system. Their two-form
    changes by

    $$\frac{d}{dt}\,\xi_1^TJ\,\xi_2 = \sum_{i=1}^m \big(\,(\nabla g_i^T\xi_1)(\nabla\lambda_i^T\xi_2)
    - (\nabla\lambda_i^T\xi_1)(\nabla g_i^T\xi_2)\big) \tag{HLW VII.1.17}$$

    On vectors that are tangent to $\mathcal M$ it is zero, since $\nabla g_i^T\xi = 0$ and $d(GH_p)\,\xi = 0$, and the flow keeps both.
    A step that leaves $\mathcal M$ maps tangent vectors to vectors for which it is in general not zero: in all of space the reduced system
    is *not Hamiltonian*. Symplectic Euler is symplectic for Hamiltonian systems only, and its first step already leaves $\mathcal M$.

    RATTLE does not use the reduced system. It takes $\lambda$ as an unknown of each step, and solves for it such that the constraint holds
    at the *end* of the step:

    $$p_{1/2} = p_0 - \tfrac h2(U_q(q_0) + G(q_0)^T\lambda_0), \qquad q_1 = q_0 + hM^{-1}p_{1/2}, \qquad 0 = g(q_1)
    \tag{HLW VII.1.24}$$

    The forces of constraint then add to $dq\wedge dp$ a term with $d g(q_1)$ and one with $d g(q_0)$, and both vanish for vectors that
    are tangent to the manifold.
    """)
    return


@app.cell
def _(facts, mo, number):
    mo.md(f"""
    ## Questions to try

    **Take symplectic Euler (se) and a run of a single step. Is the area kept?**

    /// details | Answer
    From the manifold, one step is symplectic to round-off: the defect of its two-form is {number(facts.one, 1)}. After {facts.few} steps it
    is {number(facts.several)}: the second step begins off the manifold, where the equations are not Hamiltonian. A test of a single step
    therefore finds no defect.
    ///

    **Halve the step size of rk4. How does the change of the area depend on it? Does it ever vanish?**

    /// details | Answer
    It decreases like a power of h, as errors do, and vanishes only below round-off. With RATTLE it is round-off for every h for which the
    step has a solution, however inaccurate the path is.
    ///

    **Implicit Euler for the constrained equations stays on the manifold. Is that enough?**

    /// details | Answer
    No. Its area shrinks towards zero, and so does the energy above the lowest point: it is dissipative. To be on the manifold and to be
    symplectic are two different properties.
    ///

    **With RATTLE, take the largest step and the fast start. What happens, and what does the area show?**

    /// details | Answer
    Newton's iteration finds no solution of the equations of the step, and the run ends at once. Symplecticity does not allow every step: it
    says nothing about a step that has no solution.
    ///
    """)
    return


@app.cell
def _(lesson, live):
    live.report(lesson.EXPERIMENTS)
    return


if __name__ == "__main__":
    app.run()
