# /// script
# [tool.marimo.display]
# theme = "system"
# ///
"""Predators and prey, and which methods keep the Poisson volume of a cat; and a rigid body on its sphere."""

import marimo

app = marimo.App(width="medium", app_title="Poisson maps")


@app.cell
def _():
    import marimo as mo

    from daebench.pages.lesson import live
    from daebench.pages.report import at_most, number
    from daebench.reports.lessons import _poisson_maps as lesson

    live.style()
    return at_most, lesson, live, mo, number


@app.cell
def _(mo):
    mo.md(r"""
    # Poisson maps

    A Hamiltonian system has an energy $H$ and a structure. In canonical coordinates the structure is the constant matrix $J^{-1}$. In other
    coordinates it is a matrix that depends on the state:

    $$\dot y = B(y)\,\nabla H(y), \qquad B(y)^T = -B(y) \tag{HLW VII.2.12}$$

    and $B$ satisfies the Jacobi identity (HLW VII.2.10). Predators $u$ and prey $v$ are such a system: predators multiply if there is prey,
    and die out if there is none.

    $$\dot u = u\,(v - 2), \quad \dot v = v\,(1 - u), \qquad B = \begin{pmatrix} 0 & uv \\ -uv & 0 \end{pmatrix}, \quad
    H = u - \ln u + v - 2\ln v \tag{HLW VII.2.13}$$

    The flow keeps $H$, so orbits are closed curves. It also preserves $B$: it is a *Poisson map*,

    $$\varphi'(y)\,B(y)\,\varphi'(y)^T = B(\varphi(y)) \tag{HLW VII.4.2}$$

    In the plane this means that the *Poisson volume* $du\,dv/(uv)$ of any set of states is constant. The set here is a cat.
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
    ## Orbits close or spiral

    The cat is a set of starts, drawn green, and red after each quarter of the run. In the logarithms of $u$ and $v$, its Poisson volume
    is its plain area.
    """)
    return


@app.cell
def _(lesson, live):
    orbit_knobs = live.panel(lesson.ORBITS)
    live.arranged(orbit_knobs)
    return (orbit_knobs,)


@app.cell
def _(lesson, live, orbit_knobs):
    live.shown(lesson.ORBITS, orbit_knobs)
    return


@app.cell
def _(at_most, facts, mo, number):
    mo.md(f"""
    With h = {facts.h} s, after {facts.t_end:g} s the explicit Euler method has spiralled outwards, and the cat has grown to
    {number(facts.share["euler"], 3)} of its volume. The orbit of Runge and Kutta's method looks closed; the error of the volume along it is
    at most {at_most(facts.change["rk4"], 1)}. It is at most {at_most(facts.change["midpoint"], 1)} with the midpoint rule, which is a
    Poisson map for constant B, but not for this B. Symplectic Euler and the splitting change it by
    {at_most(facts.change["symplectic_euler_adjoint"], 1)} and {at_most(facts.change["strang"], 1)}: they are Poisson maps.

    ## A body on its sphere

    Some structures have functions that every motion keeps, for any energy. They are called Casimir functions. For the angular momentum y of
    a free rigid body the length of y is a Casimir function: all motion is on a sphere. A Poisson map need not keep them: (4.2) does not
    require it. A *Poisson integrator* is a Poisson map that keeps them (HLW VII, Definition 4.6).
    """)
    return


@app.cell
def _(lesson, live):
    body_knobs = live.panel(lesson.BODY)
    live.arranged(body_knobs)
    return (body_knobs,)


@app.cell
def _(body_knobs, lesson, live):
    live.shown(lesson.BODY, body_knobs)
    return


@app.cell
def _(at_most, facts, mo, number):
    mo.md(f"""
    With h = 1 s the method of Runge and Kutta leaves the sphere by {number(facts.casimir["rk4"])} in 400 steps. The splittings rotate y:
    each part is a rotation, and the length is kept to {at_most(facts.casimir["strang@123"], 1)}. The midpoint rule keeps both the length
    and the energy, as it keeps all quadratic invariants ({number(facts.energy["midpoint"], 1)}), but it is not a Poisson map.

    ## Questions to try

    **Symplectic Euler with a large step: the orbit is not the exact one. Does it close?**

    /// details | Answer
    It is close to a closed curve: a level curve of a modified energy, which a Poisson integrator keeps up to exponentially small terms (HLW
    IX.3). Its energy error oscillates and does not grow.
    ///

    **Which of the two is more important: the energy, or the volume?**

    /// details | Answer
    The midpoint rule on the rigid body keeps the energy but is not a Poisson map; the splitting is a Poisson map, and its energy error is
    {number(facts.energy["strang@123"])}, bounded. For single orbits of a small system both are adequate. For ensembles of states, in
    statistics, the volume is essential.
    ///

    **Start the body near its middle axis. In which respect do methods agree?**

    /// details | Answer
    They stay on the sphere, if they keep it. The motion about the middle axis is unstable: the body turns over repeatedly, and a small
    change of the method shifts the times of the turns.
    ///
    """)
    return


@app.cell
def _(lesson, live):
    live.report(lesson.EXPERIMENTS)
    return


if __name__ == "__main__":
    app.run()
