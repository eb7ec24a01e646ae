"""Members of an ensemble with their starts: beside that of the problem, or on a grid."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import prod
from typing import Any, Protocol

import numpy as np

from daebench.diagnostics.consistency import projected
from daebench.diagnostics.projected_members import project_members, require_projected
from daebench.errors import BadInput, positive, real, unknown, whole
from daebench.runs.ivp import Array, Ivp
from daebench.runs.members import Members, members
from daebench.starts.box import coordinates


@dataclass(frozen=True)
class Starts:
    """Members whose starts are drawn.

    Parameters
    ----------
    members : Members
        The members.
    about : str
        A sentence: which measure, box, size and seed, and what was measured when they were drawn.
    measured : mapping of str to float
        The numbers in that sentence, by name.
    """

    members: Members
    about: str
    measured: Mapping[str, float] = field(default_factory=dict)


class Distribution(Protocol):
    """A distribution of starts."""

    def draw(self, ivp: Ivp, n: int | None, h: Any, parameters: Mapping[str, Any] | None = None, seed: int = 0) -> Starts:
        """Return n members, each the same however many there are.

        Shapes: h (n,); parameters (n,).
        """


def copies(ivp: Ivp, n: int | None, h: Any, parameters: Mapping[str, Any] | None, seed: int) -> Members:
    """Return n members at the start of the problem."""
    if n is None:
        raise BadInput("say how many members the ensemble is to have.", "members-number-missing")
    whole("members", n, 1)
    whole("seed", seed, 0)
    some = members(ivp, tuple(np.repeat(vector[None], n, axis=0) for vector in ivp.start), h, parameters or {})
    for name, values in some.parameters.items():
        if name in ivp.facts.POSITIVE and not np.all(values > 0):
            raise BadInput(
                f"{name} of {ivp.problem} must be greater than 0 in every member; the least is {np.min(values):g}.",
                "varied-value-not-positive",
            )
    return some


def require_inside(some: Members, what: str) -> Members:
    """Return members of a Poisson system, all of which start within its domain."""
    domain = " and ".join(f"{expression} > 0" for expression in some.ivp.facts.DOMAIN)
    if domain:
        outside = np.flatnonzero(~some.along("inside", some.start[0]).astype(bool))
        if len(outside):
            raise BadInput(
                f"{len(outside)} of {len(some)} starts of {what} of {some.ivp.problem} are outside its domain {domain}, the first of "
                f"them that of member {outside[0]}; stay inside.",
                "starts-outside-domain",
            )
    return some


def consistent(some: Members, what: str) -> tuple[Members, str, dict[str, float]]:
    """Return members moved onto the manifold, with how far as the end of a sentence, and the numbers in it by name.

    States of a Poisson system stay, and are to be inside of its domain; the sentence is on their Casimir functions.
    """
    if not some.ivp.on_manifold:
        return some, *casimirs(require_inside(some, what))
    if not some.ivp.m:
        return some, "", {}
    projected = project_members(some)
    moved = {"moved_q": float(np.max(projected.moved_q)), "moved_p": float(np.max(projected.moved_p))}
    ends = f", moved onto the manifold by at most {moved['moved_q']:.2g} in q and {moved['moved_p']:.2g} in p"
    return require_projected(projected, what), ends, moved


def of_case(ivp: Ivp) -> str:
    """Return the problem and its case as words."""
    return f"{ivp.problem}, case {ivp.case}" if ivp.case else ivp.problem


def differing(some: Members) -> str:
    """Return which parameters differ from member to member, as the end of a sentence."""
    return f"; {', '.join(some.parameters)} differ from member to member" if some.parameters else ""


def casimirs(some: Members) -> tuple[str, dict[str, float]]:
    """Return between which values the Casimir functions of members lie, as the end of a sentence, and these values by name."""
    names = some.ivp.facts.CASIMIRS
    if not names:
        return "", {}
    values: Array = some.along("casimirs", *some.start)
    least, most = np.min(values, axis=0), np.max(values, axis=0)
    words = ", ".join(f"{name} from {lo:.6g} to {hi:.6g}" for name, lo, hi in zip(names, least, most, strict=True))
    measured = {f"{name} {end}": float(x) for end, row in (("least", least), ("most", most)) for name, x in zip(names, row, strict=True)}
    return f"; Casimir functions differ with the start, {words}", measured


def neighbour(ivp: Ivp, size: float, seed: int | list[int]) -> Ivp:
    """Return the initial value problem at a random start nearby, on the manifold.

    Each coordinate is changed by size xi s, those that are zero among them, and the start projected back onto the manifold: xi is random
    in [-1, 1], and s the largest modulus of the positions or that of the momenta, or 1 where all of them are zero.

    Parameters
    ----------
    ivp : ConstrainedIvp, PoissonIvp
        The initial value problem.
    size : float
        Relative size of the change, before it is projected.
    seed : int or list of int
        Seeds the change.

    Raises
    ------
    BadInput
        If the start cannot be projected, as where vectors are arrays.

    Examples
    --------
    >>> from daebench import initial_value_problem
    >>> near = neighbour(initial_value_problem("planar_pendulum"), 0.01, seed=1)
    >>> bool(abs(near.q0 @ near.q0 - 1) < 1e-15), bool(abs(near.q0 @ near.p0) < 1e-15)
    (True, True)
    """
    moved = beside(ivp, size, np.random.default_rng(seed).uniform(-1, 1, (1, ivp.size)))
    start = ivp.at(*(rows[0] for rows in moved))
    return projected(start)[0] if start.on_manifold else start


def beside(ivp: Ivp, size: float, xi: Array) -> tuple[Array, ...]:
    """Return initial values beside that of a problem, off the manifold: each coordinate changed by size xi s, as :func:`neighbour` has it.

    Shapes: xi (n, N).
    """
    n, moved = ivp.moving, []
    for x, part in zip(ivp.start, ivp.vectors(xi), strict=True):
        shift = np.zeros(part.shape)  # none of the time, and of the energy received: drivers would be out of step
        shift[:, :n] = size * (float(np.max(np.abs(x[:n]))) or 1.0) * part[:, :n]
        moved.append(x + shift)
    return tuple(moved)


@dataclass(frozen=True)
class Neighbourhood:
    """Random starts beside that of the problem, each projected onto its manifold.

    Each coordinate is changed by size xi s, xi uniform in [-1, 1], s the largest modulus of positions or of momenta, see
    :func:`daebench.starts.members.neighbour`, and the start then moved to the nearest consistent one in the metric M, by
    :func:`daebench.diagnostics.projected_members.project_members`. It is no measure that the flow preserves. Where parameters differ from
    member to member, the problem's start is moved onto the manifold of each. A start that cannot be projected is an error, and is not drawn
    again: what is left would be another distribution. States of a Poisson system are not projected; their Casimir functions then differ.

    Parameters
    ----------
    size : float
        Relative size of the change, before it is projected.
    """

    size: float = 0.01

    def draw(self, ivp: Ivp, n: int | None, h: Any, parameters: Mapping[str, Any] | None = None, seed: int = 0) -> Starts:
        """Return n members with such starts, each the same however many there are.

        Raises
        ------
        BadInput
            If starts cannot be projected, or are outside of the domain of a Poisson system.
        """
        size = positive("size", self.size)
        some = copies(ivp, n, h, parameters, seed)
        xi = np.random.default_rng(seed).uniform(-1, 1, (len(some), ivp.size))
        some = replace(some, start=beside(ivp, size, xi))
        what = f"a neighbourhood of size {size:g}"
        some, ends, measured = consistent(some, what)
        return Starts(some, f"{what} of {of_case(ivp)}, uniform in every coordinate{ends}{differing(some)}; seed {seed}.", measured)


@dataclass(frozen=True)
class Grid:
    """Every combination of values of parameters, of h, and of coordinates of the start.

    The last name varies fastest. A coordinate that is named replaces that of the problem's start, which is then moved to the nearest
    consistent one, see :func:`daebench.diagnostics.projected_members.project_members`; how far is stated, and how far the coordinates that
    are named were moved by it. Where only parameters are named starts are moved too, if these change the manifold.

    Parameters
    ----------
    values : mapping of str to sequence of float
        Values by the names of parameters, of coordinates (p1, q2 or y1), and by ``h``.
    """

    values: Mapping[str, Sequence[float]] = field(default_factory=dict)

    @property
    def size(self) -> int:
        """Number of members."""
        return prod(np.size(values) for values in self.values.values())

    def draw(self, ivp: Ivp, n: int | None = None, h: Any = None, parameters: Mapping[str, Any] | None = None, seed: int = 0) -> Starts:
        """Return the members of the grid.

        Parameters
        ----------
        ivp : Ivp
            The problem.
        n : int, optional
            Number of members, if it is compared with that of the grid.
        h : float, optional
            Step size, where it is not in the grid.
        parameters : mapping of str to array_like, shape(n,), optional
            Other parameters that differ from member to member.
        seed : int
            Not used.

        Raises
        ------
        BadInput
            If a name is unknown, a value is not a finite number, or a start cannot be projected.
        """
        axes, size = self._axes(ivp), self.size
        if n is not None and n != size:
            shape = " x ".join(str(len(axis)) for axis in axes.values())
            product = f"{shape} = {size}" if len(axes) > 1 else shape
            raise BadInput(f"the grid has {product} members, not {n}; leave their number out.", "grid-of-other-number")
        mesh = dict(zip(axes, (array.ravel() for array in np.meshgrid(*axes.values(), indexing="ij")), strict=True))
        places = coordinates(ivp)
        of_parameters = {name: values for name, values in mesh.items() if name in ivp.parameters}
        if twice := set(of_parameters) & set(parameters or {}):
            raise BadInput(f"{', '.join(sorted(twice))} is in the grid, and given otherwise too; give it once.", "grid-and-given")
        some = copies(ivp, size, self._step_sizes(mesh, h), {**(parameters or {}), **of_parameters}, seed)
        of_start = {name: (places[name], values) for name, values in mesh.items() if name in places}
        for (k, i), values in of_start.values():
            some.start[k][:, i] = values
        words = " x ".join(f"{len(axis)} of {name} from {np.min(axis):g} to {np.max(axis):g}" for name, axis in axes.items())
        about = f"a grid of {size} members about {of_case(ivp)}, {words}"
        some, ends, measured = consistent(some, "a grid")
        if not ivp.on_manifold:
            return Starts(some, f"{about}{ends}.", measured)
        moved = {name: float(np.max(np.abs(some.start[k][:, i] - values))) for name, ((k, i), values) in of_start.items()}
        ends += "".join(f", {name} by at most {value:.2g}" for name, value in moved.items())
        return Starts(some, f"{about}{ends}.", {**measured, **{f"moved {name}": value for name, value in moved.items()}})

    def _axes(self, ivp: Ivp) -> dict[str, Array]:
        """Return the values of each name as arrays."""
        if not self.values:
            raise BadInput("a grid needs values of at least one parameter, coordinate or h.", "grid-empty")
        axes = {}
        for name, values in self.values.items():
            known = [*ivp.parameters, *coordinates(ivp), "h"]
            if name not in known:
                raise unknown(f"parameter or coordinate of {ivp.problem} in a grid", name, known)
            axis = np.array([real(name, value) for value in np.atleast_1d(np.asarray(values, dtype=object))])
            if not len(axis):
                raise BadInput(f"a grid needs at least one value of {name}.", "grid-axis-empty")
            axes[name] = axis
        return axes

    def _step_sizes(self, mesh: Mapping[str, Array], h: Any) -> Any:
        if ("h" in mesh) == (h is not None):
            raise BadInput("give h once: in the grid, or beside it.", "grid-h-given-twice")
        return mesh.get("h", h)
