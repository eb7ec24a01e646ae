# /// script
# [tool.marimo.display]
# theme = "system"
# ///
"""A mechanism that locks, a spring in the place of a constraint, sums of very many steps, and two pendulums that start almost alike."""

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

    Every method for constrained motion has assumptions that are true most of the time. Here are four places where they are not: where
    $G$ loses rank, where a spring is stiff, where steps are so many that their roundings count, and where the motion itself forgets its
    start.
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

    Whoever computes a multiplier solves, somewhere, a system with this matrix or one close to it:

    $$G(q)\,H_{pp}\,G(q)^T \quad\text{invertible} \tag{HLW VII.1.13}$$

    A crank drives a slider by a rod. With a rod hardly longer than the crank, each turn passes close to a position where both lie on each
    other and the two constraints say the same.
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
    With a rod of two cranks, the energy error of RATTLE is {at_most(facts.energy[2.0])} J at most; with {facts.nearly:g} cranks, it is
    {at_most(facts.energy[facts.nearly])} J. With a rod as long as the crank, the run stops at t = {number(facts.lock[1.0][0].t[-1], 2)} s:
    two branches of motion meet there, and no equation says which to take.

    ## Stiffness

    Why not drop the constraint, and add a strong spring in its place? To H is added g²/(2ε²). As ε goes to 0, the motion becomes the
    constrained one, with an oscillation across the constraint on top.
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
    t = {number(facts.stiff["stiff:rk4"][0].t[-1], 2)} s: its steps are longer than the spring's
    oscillation, and what it does not resolve, it amplifies. The midpoint rule comes to the end.

    ## Round-off

    RATTLE keeps the angular momentum about the vertical. What is left of its error is rounding: one for each addition. Compensated
    summation keeps what an addition loses, and adds it to the next one (HLW VIII.5).
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
    In {count(facts.many)} steps, plain sums lose {number(facts.rounding[False])} J s, compensated ones {number(facts.rounding[True])} J s.

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
    Released {number(facts.delta, 1)} rad apart, they are a tenth of an arm apart after {number(facts.chaos["rattle"], 3)} s, as RATTLE has
    it, and after {number(facts.chaos["lobatto3"], 3)} s, as Lobatto's method with three stages has it. A hundredth of the difference buys
    only {number(facts.nearer - facts.chaos["rattle"], 2)} s more.

    One pair of releases is one pair. The map has {count(facts.releases)} of them, each run anew when a control is moved, several at
    a time on each core.
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
    From {percent(facts.turn)} of the releases the lower arm turns over within {facts.length:g} s. From {percent(facts.cannot)} it never
    can: released at rest, the arms have too little energy for it to stand upright where 2 cos θ₁ + cos θ₂ > 1, and none of these runs does.
    Most neighbours turn over together early, and few late: of the neighbours of releases that turn over within {facts.early:g} s,
    {percent(facts.alike_early)} do so within a tenth of a second of them; of those of releases that turn over after {facts.late:g} s,
    {percent(facts.alike_late)} do.

    ## Questions to try

    **Shorten the rod step by step. Where does a smaller step help, and where not?**

    /// details | Answer
    As long as the rank is lost only nearly, steps small against the time in which the mechanism passes the position resolve it. At a rod
    of exactly one crank no step helps: the question has two answers.
    ///

    **Make the spring so stiff that the midpoint rule does not resolve it. Is its g small? Is the motion right?**

    /// details | Answer
    Look at both panels: the residual of the constraint may be small while the distance from the constrained motion is not. An
    oscillation that is not resolved is not damped by the midpoint rule either.
    ///

    **In the round-off panel, does the error grow like the number of steps, or slower?**

    /// details | Answer
    Slower. Roundings of either sign partly cancel, as the steps of a drunkard do: their sum grows like the square root, unless something
    biases them.
    ///

    **The energy error stays small while the pendulums part. Which of the two runs is wrong?**

    /// details | Answer
    Both, soon. After they have parted, neither follows the motion from its own start: a rounding is a difference of starts, too. What
    such a run can still tell are energies, constraints and statistics.
    ///
    """)
    return


@app.cell
def _(lesson, live):
    live.report(lesson.EXPERIMENTS)
    return


if __name__ == "__main__":
    app.run()
