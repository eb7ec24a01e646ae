# /// script
# [tool.marimo.display]
# theme = "system"
# ///
"""From SHAKE to RATTLE to Lobatto: the constraints that a scheme satisfies, its multipliers, its order and its cost."""

import marimo

app = marimo.App(width="medium", app_title="From SHAKE to RATTLE to Lobatto")


@app.cell
def _():
    import marimo as mo

    from daebench.pages.lesson import live
    from daebench.pages.report import at_most, count, number
    from daebench.reports.lessons import _shake_to_lobatto as lesson

    live.style()
    return at_most, count, lesson, live, mo, number


@app.cell
def _(mo):
    mo.md(r"""
    # From SHAKE to RATTLE to Lobatto

    A constraint $0 = g(q)$ implies a second, hidden one. If a motion satisfies it, its velocity is tangent to it:

    $$0 = G(q)\,H_p(p,q), \qquad G = g_q \tag{HLW VII.1.11}$$

    Three generations of schemes differ in which of the two constraints they satisfy, and in the number of multipliers per step.

    **SHAKE** (1977) is the leapfrog method with one multiplier, chosen such that the next position is on the constraint:

    $$q_{n+1} - 2q_n + q_{n-1} = -h^2M^{-1}(U_q(q_n) + G(q_n)^T\lambda_n), \qquad 0 = g(q_{n+1}) \tag{HLW VII.1.23}$$

    Its momenta are differences of positions, $p_n = M(q_{n+1}-q_{n-1})/2h$. They need not satisfy the hidden constraint. The recursion is
    symmetric: from $q_{n+1}$ and $q_n$ it leads back to $q_{n-1}$. The map of $(p, q)$ is not symmetric: it begins with a tangent momentum
    and ends with one that is not tangent.

    **RATTLE** (1983) is the same recursion as a one-step map, with a second multiplier that makes the momentum tangent at the end of the
    step:

    $$p_{n+1} = p_{n+1/2} - \tfrac h2(U_q(q_{n+1}) + G(q_{n+1})^T\mu_n), \qquad 0 = G(q_{n+1})M^{-1}p_{n+1}
    \tag{HLW VII.1.25}$$

    **Lobatto IIIA-IIIB** pairs have $s$ stages, and the constraint at each of them: order $2s-2$. With $s = 2$ the pair *is* RATTLE.
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
    ## The hidden constraint

    SHAKE and RATTLE with the same step. Project SHAKE's momenta onto the tangent space of the sphere, and see what changes.
    """)
    return


@app.cell
def _(lesson, live):
    hidden_knobs = live.panel(lesson.HIDDEN)
    live.arranged(hidden_knobs)
    return (hidden_knobs,)


@app.cell
def _(hidden_knobs, lesson, live):
    live.shown(lesson.HIDDEN, hidden_knobs)
    return


@app.cell
def _(at_most, facts, mo, number):
    mo.md(f"""
    The positions of both agree to {at_most(facts.hidden.positions, 1)}: both are the same recursion. The momenta of SHAKE are off the
    manifold by {number(max(facts.hidden.shake))}, an error of order two like all other errors of the scheme. After projection they agree
    with those of RATTLE to {at_most(facts.hidden.momenta, 1)}. One projection at the times of output thus corrects SHAKE. RATTLE includes
    the projection, and is a map of the manifold that can be restarted at any step. Both are symplectic: ten steps of SHAKE change the
    two-form of tangents of the manifold by {at_most(facts.form, 1)}, which is round-off.
    """)
    return


@app.cell
def _(facts, mo):
    rows = "\n".join(
        f"    | {row['scheme']} | {row['order']} | {'yes' if row['g'] else 'no'} | {'yes' if row['Gv'] else 'no'} | {row['force']:.1f} |"
        for row in facts.table.to_dict("records")
    )
    mo.md(f"""
    ## Order and cost

    | scheme | order | positions on the constraint | momenta on the hidden one | forces in a step |
    |---|---|---|---|---|
{rows}

    Forces are counted in ten steps from the slow start, including those of the iteration within a step. RATTLE is counted with both of its
    half-steps in the momentum. The force at the end of a step equals the force at the start of the next one: a program that stores it needs
    one force per step for RATTLE, as for SHAKE.
    """)
    return


@app.cell
def _(lesson, live):
    order_knobs = live.panel(lesson.ORDERS)
    live.arranged(order_knobs)
    return (order_knobs,)


@app.cell
def _(lesson, live, order_knobs):
    live.shown(lesson.ORDERS, order_knobs)
    return


@app.cell
def _(count, facts, mo, number):
    mo.md(f"""
    On the left, the slope of a line is the order: RATTLE has {facts.orders["rattle"]:.2f}, Lobatto with three stages
    {facts.orders["lobatto3"]:.2f}, with four {facts.orders["lobatto4"]:.2f}. On the right, the same errors against their cost. For an error
    of {number(facts.error, 1)} in the position of the fast motion after one second, Lobatto with three stages needs
    {count(facts.fine["lobatto3"])} evaluations of the force, SHAKE {count(facts.fine["shake"])}, RATTLE {count(facts.fine["rattle"])}, or
    {count(facts.kept)} if the force at the end of a step is stored for the next, and symplectic Euler does not reach this error with any of
    these steps.

    ## Questions to try

    **For a rough answer, say an error of {number(facts.large, 1)} after one second, which scheme is cheapest?**

    /// details | Answer
    One of order two. SHAKE needs {count(facts.rough["shake"])} evaluations and RATTLE {count(facts.rough["rattle"])}; Lobatto with three
    stages needs {count(facts.rough["lobatto3"])} even with the largest of these steps, and is then far more accurate than required. A high
    order is cheaper only if high accuracy is required.
    ///

    **Add step sizes until a line bends. Where does it bend, and why does this not affect the fitted order?**

    /// details | Answer
    At some multiple of round-off, earlier for the schemes of high order. Smaller steps then only add round-off. The fit omits points on
    that plateau, and points that are not yet on a straight line.
    ///

    **Look at momenta in place of positions. Does SHAKE lose an order?**

    /// details | Answer
    No: the distance from the manifold is an error of second order, too. SHAKE and RATTLE have the same order in both.
    ///

    **Four stages or RATTLE composed with itself: both go beyond order two. What is the difference?**

    /// details | Answer
    A composition takes steps of RATTLE forwards and backwards, each explicit except for its multipliers; it needs no new solver. Lobatto
    solves for all its stages at once, which costs more per step but allows larger steps.
    ///
    """)
    return


@app.cell
def _(lesson, live):
    live.report(lesson.EXPERIMENTS)
    return


if __name__ == "__main__":
    app.run()
