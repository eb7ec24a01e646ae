"""``daebench.modes``: small oscillations about an equilibrium in each formulation."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Unpack

import numpy as np

from daebench.draw.figures import QUIET, VERMILION, curve, drawing, grid_of_axes
from daebench.draw.orthographic import projected
from daebench.draw.scene import layout_of
from daebench.draw.springs import draw_springs
from daebench.errors import BadInput, positive
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.no_constraint import nothing_to
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.make_ivp import require_positions
from daebench.runs.own_start import OwnStart
from daebench.runs.result import Result, Table
from daebench.studies.modes.equilibrium import Equilibrium, equilibrium, largest
from daebench.studies.modes.frozen import damping_at, frozen
from daebench.studies.modes.spectrum import DEPENDENT, ZERO, Linear, Spectra, largest_real, natural, spectra, zeros
from daebench.studies.modes.step_limit import Oscillations, require_usable, usable_methods, usable_steps
from daebench.systems.lazily import pandas as pd

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from daebench.runs.ivp import InitialValueProblem
    from daebench.systems.constrained import ConstrainedHamiltonian

BAUMGARTE = 10.0
"""alpha and beta where none are given, 1/s, as of ``ida:baumgarte``."""

STIFFER = 1e4
"""The penalty's stiffness where none is given makes its slowest frequency about a hundred times the fastest natural one."""


SHOWN = ("index3", "index2", "index1", "baumgarte")
"""Formulations that have a panel; GGL has the spectrum of index 3, and the reduced ODE that of index 1."""

SHAPES = 4
"""Modes whose shapes are drawn, the slowest."""

SWING = 0.25
"""Amplitude of a shape, in parts of the extent of the system."""

LIGHTER = {0.0: 0.6, 1.0: 1.0, -1.0: 0.4}
"""Opacity of the system at rest, and moved to either side: what is moved together has the same."""


@dataclass(frozen=True)
class Modes(Result):
    """Small oscillations about an equilibrium.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem.
    rest : Equilibrium
        The equilibrium.
    squares : ndarray, shape(n,)
        Squares of the natural frequencies, 1/s^2, in ascending order; a negative one grows, and one that is zero is a free direction.
    shapes : ndarray, shape(n, d)
        dq of each, largest entry 1.
    damping : ndarray, shape(d, d)
        C = -dF/dv; frequencies, shapes and step limits are without it.
    spectra : mapping of str to ndarray
        Eigenvalues of each formulation, 1/s.
    alpha, beta, stiff : float
        Baumgarte's numbers, 1/s, and the stiffness of the penalty.
    steps : mapping of str to float
        Largest step size that can be made and with which no oscillation grows, s, by method.
    left_out : mapping of str to str
        Why there is none of the others that were named.
    """

    stem: ClassVar[str] = "modes"

    ivp: ConstrainedIvp
    rest: Equilibrium
    squares: Array
    shapes: Array
    damping: Array
    spectra: Spectra
    alpha: float
    beta: float
    stiff: float
    steps: Mapping[str, float]
    left_out: Mapping[str, str]

    @property
    def frequencies(self) -> Array:
        """Natural frequencies, rad/s: imaginary parts of the eigenvalues; 0 where the square is not positive."""
        return np.sqrt(np.maximum(self.squares, 0.0))

    @property
    def damped(self) -> "np.typing.NDArray[np.complex128]":
        """Eigenvalues of the damped motion, 1/s, one of each pair, the slowest first; none without damping."""
        eigenvalues = self.spectra["index3" if "index3" in self.spectra else "ode"]
        # A pair has one eigenvalue above the real axis; on it, up to round-off, are those of motions that creep.
        above = eigenvalues[eigenvalues.imag > -ZERO * largest(eigenvalues)]
        return above[np.argsort(np.abs(above), kind="stable")] if self.damping.any() else above[:0]

    def summary(self) -> dict[str, Any]:
        """Return all numbers, for JSON."""
        formulations = {
            name: {
                "eigenvalues": [[float(x.real), float(x.imag)] for x in eigenvalues],
                "zeros": zeros(eigenvalues),
                "largest_real": largest_real(eigenvalues),
                "fastest": largest(eigenvalues),
            }
            for name, eigenvalues in self.spectra.items()
        }
        return {
            **self.posed,
            **{name: getattr(self.rest, name) for name in ("q", "lam", "residual")},
            **{name: getattr(self, name) for name in ("frequencies", "squares", "shapes")},
            "formulations": formulations,
            **{name: getattr(self, name) for name in ("alpha", "beta", "stiff")},
            "steps": {name: None if h == float("inf") else h for name, h in self.steps.items()},
            "left_out": dict(self.left_out),
        }

    @property
    def table(self) -> "pd.DataFrame":
        """All eigenvalues, a row each: formulation, real, imaginary."""
        rows = [{"formulation": name, "real": x.real, "imaginary": x.imag} for name, some in self.spectra.items() for x in some]
        return pd.DataFrame(rows)

    def printed(self) -> Iterator[str | Table]:
        """Yield the equilibrium, frequencies, formulations, and step limits."""
        summary = self.summary()
        yield f"{self.ivp.problem} at rest: q = {', '.join(f'{x:.6g}' for x in self.rest.q)}"
        frequencies = [[f"{k + 1}", *_frequency(square)] for k, square in enumerate(map(float, self.squares))]
        yield Table(["mode", "rad/s", "Hz", "period s"], frequencies)
        if len(self.damped):
            damped = [[f"{abs(x):.6g}", f"{-x.real / (abs(x) or 1.0):.6g}", f"{x.imag:.6g}", f"{-x.real:.6g}"] for x in self.damped]
            yield Table(["damped: modulus 1/s", "damping ratio", "rad/s", "decay 1/s"], damped)
        rows = [
            [name, str(len(row["eigenvalues"])), str(row["zeros"]), f"{row['largest_real']:.3g}", f"{row['fastest']:.6g}"]
            for name, row in summary["formulations"].items()
        ]
        yield Table(["formulation", "eigenvalues", "zeros", "largest real part", "largest modulus 1/s"], rows)
        limits = [[name, "none" if h is None else f"{h:.4g}"] for name, h in summary["steps"].items()]
        yield Table(["method", "step limit s"], limits)
        for name, why in self.left_out.items():
            yield f"no limit of {name}: {why}"

    def plot(self) -> "Figure":
        """Return a figure of the eigenvalues of each formulation, and of the shapes of the slowest modes."""
        layout = layout_of(self.ivp)
        rows = 1 if layout is None else 2
        with drawing():
            figure, axes = grid_of_axes(rows, len(SHOWN), 0.9 + 2.6 * rows)
            shown = [name for name in SHOWN if name in self.spectra] or list(self.spectra)
            for k, axis in enumerate(axes[0]):
                axis.set_visible(k < len(shown))
                if k < len(shown):
                    _spectrum(axis, self, shown[k])
            axes[0, 0].set_ylabel("imaginary part [1/s]")
            if layout is not None:
                _shapes(list(axes[1]), self, layout)
            figure.suptitle(self.title, fontsize="medium", x=0.02, ha="left")
        return figure

    @property
    def title(self) -> str:
        """The answer in two lines; one without constraints."""
        if not self.ivp.m:
            return f"{self.ivp.problem} at rest: without constraints the motion has the natural frequencies alone."
        zeros_of = {name: zeros(self.spectra[name]) for name in ("index2", "index1")}
        drifts = f"index 2 has {zeros_of['index2']} zeros, index 1 {zeros_of['index1']} (m = {len(self.rest.lam)})"
        one = f"{self.ivp.problem} at rest: {drifts}: in these directions a run drifts."
        return f"{one}\nIndex 3 and GGL have the {'damped' if self.damping.any() else 'natural'} frequencies alone."


def _frequency(square: float) -> list[str]:
    """Return a frequency as text; if its square is not positive, there is no oscillation."""
    if square <= 0:
        return ["free" if square == 0 else f"grows by e in {1 / (-square) ** 0.5:.3g} s", "", ""]
    w = square**0.5
    return [f"{w:.10g}", f"{w / (2 * np.pi):.6g}", f"{2 * np.pi / w:.6g}"]


def modes(
    problem: "str | ConstrainedHamiltonian | InitialValueProblem",
    *,
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    alpha: float | None = None,
    beta: float | None = None,
    stiff: float | None = None,
    methods: Sequence[str] | None = None,
    on_singular: str | None = None,
    **start: Unpack[OwnStart],
) -> Modes:
    """Find an equilibrium, the small oscillations of each formulation about it, and the step limits of schemes there.

    The equilibrium is found by a descent of the potential energy on the manifold. The spectrum of index 3 and of GGL has only the natural
    frequencies. Index 2 has m zeros in addition, index 1 and the reduced ODE 2 m: these are the directions in which they drift. Baumgarte's
    stabilisation moves each pair to the roots of s^2 + 2 alpha s + beta^2, and a penalty turns it into fast oscillations. Drivers and
    targets of motors are held as they are at t = 0; with dampers, eigenvalues are those of the damped motion::

        >>> import daebench
        >>> found = daebench.modes("planar_pendulum", parameters={"gravity": 4.0}, methods=["rattle"])
        >>> [float(round(x, 9)) for x in found.frequencies], round(float(found.steps["rattle"]), 3)
        ([2.0], 1.0)

    Parameters
    ----------
    problem : str, ConstrainedHamiltonian or InitialValueProblem
        Name in the catalogue, the path of a problem file, which is executed, a definition, or an initial value problem.
    case : str, optional
        Named initial values, from which the search begins; by default the problem's first.
    parameters : mapping of str to float, optional
        Values of the problem's parameters.
    alpha : float, optional
        alpha of Baumgarte's stabilisation, 1/s; by default 10, as in ``ida:baumgarte``.
    beta : float, optional
        beta of it, 1/s; by default 10.
    stiff : float, optional
        Stiffness k of the penalty k |g|^2 / 2; by default one that makes oscillations a hundred times as fast as the fastest natural one.
    methods : sequence of str, optional
        Fixed-step methods whose step limit is computed; by default some that are for the problem.
    on_singular : str, optional
        What to do where G loses rank: "stop", "continue" or "least-squares"; by default what the case declares.
    **start : OwnStart
        A start of one's own in place of the case's: q0, p0, v0, y0 and project, as for :func:`daebench.initial_value_problem`.

    Returns
    -------
    Modes

    Raises
    ------
    BadInput
        If there is no equilibrium, or the problem has forces without a potential at rest, is a Poisson system, or has arrays as vectors,
        or a method chooses its steps itself or is not for the problem.
    """
    ivp = initial_value_problem(problem, case, parameters, on_singular=on_singular, consistent=False, **start)
    if not ivp.on_manifold or ivp.arrays:
        what = "held as arrays" if ivp.on_manifold else "a Poisson system"
        raise BadInput(f"modes need a constrained problem with few positions, and {ivp.problem} is {what}.", "modes-of-few-positions")
    require_positions(ivp, "along which it may rest elsewhere than at a minimum of its potential; modes are of constraints on positions")
    moving, ivp = ivp, frozen(ivp) if ivp.facts.EXTENDED else ivp
    for name, value in (("alpha", alpha), ("beta", beta), ("stiff", stiff)):
        if value is not None and (why := nothing_to("stabilise or penalise", name, ivp, "leave it out")):
            raise BadInput(why, "modes-nothing-to-stabilise")
        if value is not None:
            positive(name, value)
    names = usable_methods(ivp) if methods is None else tuple(methods)
    require_usable(ivp, names)
    rest = equilibrium(ivp)
    system = Linear.at(ivp, rest, damping_at(moving, rest.q))
    squares, shapes, momenta = natural(system)
    oscillates = squares > 0
    about = Oscillations(ivp, rest.q, np.sqrt(squares[oscillates]), shapes[oscillates], momenta[oscillates])
    fastest = float(np.sqrt(largest(squares))) or 1.0
    alpha, beta = alpha or BAUMGARTE, beta or BAUMGARTE
    pulls = np.linalg.eigvalsh(system.G @ system.H_pp @ system.G.T)
    stiff = stiff or STIFFER * fastest**2 / float(np.min(pulls[pulls > DEPENDENT * largest(pulls)], initial=np.inf))
    eigenvalues = spectra(system, alpha=alpha, beta=beta, stiff=stiff)
    steps, left_out = usable_steps(about, names)
    return Modes(ivp, rest, squares, shapes, system.C, eigenvalues, alpha, beta, stiff, steps, left_out)


def _spectrum(axis: Any, modes: Modes, name: str) -> None:
    some = modes.spectra[name]
    still = np.abs(some) <= ZERO * max(largest(some), 1e-300)
    axis.plot(some.real[~still], some.imag[~still], **curve(0) | {"linestyle": "none", "markersize": 5})
    if still.any():
        axis.plot([0], [0], marker="o", color=VERMILION, markersize=9, linestyle="none")
        axis.annotate(f"{int(still.sum())} zeros", (0, 0), xytext=(8, 4), textcoords="offset points", color=VERMILION)
    axis.axvline(0, color=QUIET, linewidth=0.6)
    reach = 1.15 * max(largest(some.real), 0.3 * largest(some.imag), 1e-12)
    axis.set(title=name if name != "baumgarte" else f"baumgarte {modes.alpha:g}, {modes.beta:g} /s", xlabel="real part [1/s]")
    axis.set_xlim(-reach, reach)


def _shapes(axes: list[Any], modes: Modes, layout: Any) -> None:
    """Draw the slowest modes, each as the system at rest, in grey, and moved to either side; one in space as seen from outside."""
    at_rest = layout.at(modes.rest.q[None])[0]
    extent = float(np.max(np.ptp(at_rest, axis=0))) or 1.0
    for k, axis in enumerate(axes):
        if k >= min(SHAPES, len(modes.squares)):
            axis.set_visible(False)
            continue
        for side, style in ((0.0, {"color": QUIET, "linewidth": 2.0}), (1.0, curve(0)), (-1.0, curve(0))):
            moved = projected(layout.at((modes.rest.q + side * SWING * extent * modes.shapes[k])[None])[0])
            draw_springs(axis, layout, moved, extent, color=style["color"], linewidth=0.8, alpha=LIGHTER[side])
            for rod in layout.rods:
                axis.plot(*moved[rod].T, color=style["color"], linewidth=1.6 if side else 2.4, alpha=LIGHTER[side])
            axis.plot(*moved[layout.masses].T, "o", color=style["color"], markersize=4, alpha=LIGHTER[side])
        axis.set_aspect("equal", adjustable="datalim")
        axis.set_axis_off()
        square = modes.squares[k]
        axis.set_title(f"{np.sqrt(square):.4g} rad/s" if square > 0 else "free or growing", fontsize="medium")
