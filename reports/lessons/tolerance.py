# /// script
# [tool.marimo.display]
# theme = "system"
# ///
"""IDA at index 3, 2, 1 and GGL: the error that a tolerance leads to, and the residuals of the constraints."""

import marimo

app = marimo.App(width="medium", app_title="What tolerance buys")


@app.cell
def _():
    import marimo as mo

    from daebench.pages.lesson import live
    from daebench.pages.report import at_most, number
    from daebench.reports.lessons import _tolerance as lesson

    live.style()
    return at_most, lesson, live, mo, number


@app.cell
def _(mo):
    mo.md(r"""
    # What tolerance buys

    IDA, from SUNDIALS, is the best known solver of differential-algebraic equations. The user gives a tolerance, and IDA chooses steps and
    orders such that an estimate of each step's error stays below it. What does the tolerance say about the error at the end? The motion is
    that of a spherical pendulum, and all errors are against a certified reference.
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
    The constraint of the rod can be posed in four ways, [which are below](#four-formulations). On the dashed line the error equals the
    tolerance. The ring is the chosen run; its error and its constraints are in the last two panels. The switch decides whether the
    multipliers are in the error test that controls the steps. By default IDA tests all unknowns, including multipliers.
    """)
    return


@app.cell
def _(lesson, live):
    knobs = live.panel(lesson.ASKED_REACHED)
    live.arranged(knobs)
    return (knobs,)


@app.cell
def _(knobs, lesson, live):
    live.shown(lesson.ASKED_REACHED, knobs)
    return


@app.cell
def _(mo):
    mo.md(r"""
    ## Four formulations

    $$\dot q = v, \qquad M\dot v = -U_q(q) - G(q)^T\lambda, \qquad 0 = g(q) \tag{HLW VII.1.2}$$

    The last equation can be posed in several ways, and each gives a different system for the solver. The *index* is the number of
    differentiations after which every unknown has a differential equation:

    - **index 3**: the constraint $0 = g(q)$ itself;
    - **index 2**: its first derivative, $0 = G(q)\,v$;
    - **index 1**: its second derivative, which gives $\lambda$;
    - **GGL**: $0 = g(q)$ and $0 = G(q)\,v$ together, with a second multiplier, $\dot q = v - G(q)^T\mu$.
    """)
    return


@app.cell
def _(at_most, facts, mo, number):
    mo.md(f"""
    ## What you see

    With a tolerance of {number(facts.tol, 1)}, and multipliers out of the error test, the error after {facts.t_end:g} s is
    {number(facts.more["index3"], 2)} times the tolerance at index 3, {number(facts.more["index2"], 2)} times at index 2,
    {number(facts.more["index1"], 2)} times at index 1 and {number(facts.more["ggl"], 2)} times with GGL. The tolerance is local: it is for
    the error of one step, not for the error at the end.

    The constraints distinguish the formulations. GGL keeps g to {at_most(facts.cured["ggl"].g.max(), 1)}. Index 2 has only the velocity
    constraint, and its g drifts to {number(facts.cured["index2"].g.max(), 1)}. Index 1 has neither constraint:
    {number(facts.cured["index1"].g.max(), 1)}. With its defaults, IDA reaches the end at {facts.came["index3"]} of {facts.n} tolerances at
    index 3, at {facts.came["index2"]} at index 2, at {facts.came["index1"]} at index 1, and at {facts.came["ggl"]} with GGL.
    """)
    return


@app.cell
def _(mo):
    mo.md(r"""
    ## Why

    IDA accepts a step if the mean square of the estimated errors $e_i$ of all unknowns $y_i$, each over its tolerance, is at most one:

    $$\frac1N\sum_i\Bigl(\frac{e_i}{\mathrm{rtol}\,|y_i|+\mathrm{atol}_i}\Bigr)^2\le 1$$

    The estimate of a multiplier's error is much larger than that of a position: the multiplier is a second derivative of the motion, and is
    not smoothed by integration. To pass the test, steps would have to be extremely small. There are two remedies:

    - at index 2 and GGL, multipliers become derivatives of unknowns, $\lambda=\dot\Lambda$, so that
      $M\dot v=-U_q(q)-G(q)^T\dot\Lambda$. The test is of $\Lambda$, which is as smooth as the velocity;
    - at index 1 and 3, the multiplier has $\mathrm{atol}_i=10^{20}$, so that it always passes; at index 3 the velocity has it, too. The
      multiplier is then computed from position and velocity when it is needed.
    """)
    return


@app.cell
def _(mo):
    mo.md(r"""
    ## Questions to try

    **Take index 1 with the multipliers left out of the error test, and use smaller tolerances. What happens to g?**

    /// details | Answer
    It decreases with the tolerance, as the error does. No term of the equations reduces it: drift is an error like others, but it can be
    observed without knowing the solution.
    ///

    **A run with all unknowns in the error test stops at a tight tolerance. Is a looser one safer?**

    /// details | Answer
    It may reach its end, and its result may still be useless. Look at index 1 at the loosest tolerances: the run reaches the end, and the
    error is as large as the motion. Index 2 does better there. The next question is how to tell.
    ///

    **How would you find the error without a reference?**

    /// details | Answer
    Run again with a tenth of the tolerance, and take the difference as the error of the first run. Residuals of the constraints say little:
    a formulation may keep them to many digits while the phase is wrong.
    ///
    """)
    return


@app.cell
def _(lesson, live):
    live.report(lesson.EXPERIMENTS)
    return


if __name__ == "__main__":
    app.run()
