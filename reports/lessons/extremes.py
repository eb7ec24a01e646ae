# /// script
# [tool.marimo.display]
# theme = "system"
# ///
"""Where methods break: a mechanism that locks, a stiff spring, sums over very many steps, and two pendulums with nearly equal starts."""

import marimo

app = marimo.App(width="medium", app_title="The extremes")


@app.cell
def _():
    import marimo as mo

    from daebench.pages.lesson import live
    from daebench.pages.report import at_most, count, number, percent
    from daebench.reports.lessons import _extremes as lesson

    live.style()
    return at_most, count, lesson, live, mo, number, percent


@app.cell
def _(mo):
    mo.md(r"""
    # The extremes

    Every method for constrained motion makes assumptions that usually hold. Here are four situations in which they do not hold: $G$ loses
    rank, a spring is stiff, a run has so many steps that their round-off matters, and the motion is chaotic.
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
    ## Lock-up

    To compute a multiplier, a method has to solve a system with this matrix or a similar one:

    $$G(q)\,H_{pp}\,G(q)^T \quad\text{invertible} \tag{HLW VII.1.13}$$

    A crank drives a slider by a rod. With a rod hardly longer than the crank, each turn passes close to a position where both lie on each
    other and the two constraints are dependent.
    """)
    return


@app.cell
def _(lesson, live):
    lock_knobs = live.panel(lesson.LOCK)
    live.arranged(lock_knobs)
    return (lock_knobs,)


@app.cell
def _(lesson, live, lock_knobs):
    live.shown(lesson.LOCK, lock_knobs)
    return


@app.cell
def _(at_most, facts, mo, number):
    mo.md(f"""
    With a rod of two crank lengths, the energy error of RATTLE is at most {at_most(facts.energy[2.0])} J; with {facts.nearly:g} crank
    lengths, it is {at_most(facts.energy[facts.nearly])} J. With a rod as long as the crank, the run stops at t =
    {number(facts.lock[1.0][0].t[-1], 2)} s: two branches of motion meet there, and no equation selects one.

    ## Stiffness

    The constraint can be replaced by a stiff spring: g²/(2ε²) is added to H. As ε goes to 0, the motion becomes the constrained one, with
    an additional oscillation across the constraint.
    """)
    return


@app.cell
def _(lesson, live):
    stiff_knobs = live.panel(lesson.STIFF)
    live.arranged(stiff_knobs)
    return (stiff_knobs,)


@app.cell
def _(lesson, live, stiff_knobs):
    live.shown(lesson.STIFF, stiff_knobs)
    return


@app.cell
def _(facts, mo, number):
    mo.md(f"""
    With ε = {facts.tight:g} and steps of 0.005 s, the method of Runge and Kutta ends at
    t = {number(facts.stiff["stiff:rk4"][0].t[-1], 2)} s: its steps are longer than the spring's oscillation, and it amplifies an
    oscillation that it does not resolve. The midpoint rule reaches the end.

    ## Round-off

    RATTLE keeps the angular momentum about the vertical. Its remaining error is round-off: one rounding for each addition. Compensated
    summation stores the rounding error of an addition, and adds it to the next one (HLW VIII.5).
    """)
    return


@app.cell
def _(lesson, live):
    rounding_knobs = live.panel(lesson.ROUNDING)
    live.arranged(rounding_knobs)
    return (rounding_knobs,)


@app.cell
def _(lesson, live, rounding_knobs):
    live.shown(lesson.ROUNDING, rounding_knobs)
    return


@app.cell
def _(count, facts, mo, number):
    mo.md(f"""
    In {count(facts.many)} steps, the error is {number(facts.rounding[False])} J s with plain sums, and {number(facts.rounding[True])} J s
    with compensated ones.

    ## Chaos

    Two double pendulums are released from the horizontal, one a little lower than the other.
    """)
    return


@app.cell
def _(lesson, live):
    chaos_knobs = live.panel(lesson.CHAOS)
    live.arranged(chaos_knobs)
    return (chaos_knobs,)


@app.cell
def _(chaos_knobs, lesson, live):
    live.shown(lesson.CHAOS, chaos_knobs)
    return


@app.cell
def _(count, facts, mo, number):
    mo.md(f"""
    Released {number(facts.delta, 1)} rad apart, they are a tenth of an arm apart after {number(facts.chaos["rattle"], 3)} s according to
    RATTLE, and after {number(facts.chaos["lobatto3"], 3)} s according to Lobatto's method with three stages. A hundredth of the difference
    delays this by only {number(facts.nearer - facts.chaos["rattle"], 2)} s.

    This is a single pair of releases. The map has {count(facts.releases)} releases. All are run again when a control is moved, several at a
    time on each core.
    """)
    return


@app.cell
def _(lesson, live):
    map_knobs = live.panel(lesson.MAP)
    live.arranged(map_knobs)
    return (map_knobs,)


@app.cell
def _(lesson, live, map_knobs):
    live.shown(lesson.MAP, map_knobs)
    return


@app.cell
def _(facts, mo, percent):
    mo.md(f"""
    From {percent(facts.turn)} of the releases the lower arm turns over within {facts.length:g} s. From {percent(facts.cannot)} it cannot:
    arms released at rest with 2 cos θ₁ + cos θ₂ > 1 have too little energy for the lower arm to stand upright, and in none of these runs it
    turns over. Neighbouring releases that turn over early mostly do so together, late ones rarely. Of the neighbours of releases that turn
    over within {facts.early:g} s, {percent(facts.alike_early)} do so within a tenth of a second of each other; after {facts.late:g} s, only
    {percent(facts.alike_late)} do.

    ## Questions to try

    **Shorten the rod gradually. When does a smaller step size help, and when not?**

    /// details | Answer
    If G only comes close to losing rank, steps that are small compared with the time of the passage resolve it. With a rod of exactly one
    crank length no step helps: the motion is not unique.
    ///

    **Make the spring so stiff that the midpoint rule does not resolve it. Is its g small? Is the motion right?**

    /// details | Answer
    Look at both panels: the residual of the constraint may be small while the distance from the constrained motion is not. The midpoint
    rule does not damp an oscillation that it does not resolve.
    ///

    **In the round-off panel, does the error grow like the number of steps, or slower?**

    /// details | Answer
    Slower. Roundings of both signs partly cancel, as in a random walk: their sum grows like the square root of the number of steps, unless
    they are biased.
    ///

    **The energy error stays small while the pendulums separate. Which of the two runs is wrong?**

    /// details | Answer
    Both, soon. After they have separated, neither follows the motion from its own start: a rounding acts like a difference of starts. Such
    a run can still give energies, constraints and statistics.
    ///
    """)
    return


@app.cell
def _(lesson, live):
    live.report(lesson.EXPERIMENTS)
    return


if __name__ == "__main__":
    app.run()
