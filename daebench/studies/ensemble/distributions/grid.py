"""Starts, parameters and step sizes on a grid."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import prod
from typing import Any

import numpy as np

from daebench.diagnostics.projected_members import project_members, require_projected
from daebench.errors import BadInput, real, unknown
from daebench.runs.ivp import Array, Ivp
from daebench.studies.ensemble.distributions.box import coordinates
from daebench.studies.ensemble.distributions.starts import Starts, casimirs, copies, of_case, require_inside


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
        ivp : InitialValueProblem
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
            raise BadInput(f"the grid has {product} members, not {n}; leave their number out.")
        mesh = dict(zip(axes, (array.ravel() for array in np.meshgrid(*axes.values(), indexing="ij")), strict=True))
        places = coordinates(ivp)
        of_parameters = {name: values for name, values in mesh.items() if name in ivp.parameters}
        if twice := set(of_parameters) & set(parameters or {}):
            raise BadInput(f"{', '.join(sorted(twice))} is in the grid, and given otherwise too; give it once.")
        some = copies(ivp, size, self._step_sizes(mesh, h), {**(parameters or {}), **of_parameters}, seed)
        for name in mesh.keys() & places.keys():
            k, i = places[name]
            some.start[k][:, i] = mesh[name]
        words = " x ".join(f"{len(axis)} of {name} from {np.min(axis):g} to {np.max(axis):g}" for name, axis in axes.items())
        about = f"a grid of {size} members about {of_case(ivp)}, {words}"
        if not ivp.on_manifold:
            ends, measured = casimirs(require_inside(some, "a grid"))
            return Starts(some, f"{about}{ends}.", measured)
        projected = project_members(some)
        measured = {"moved_q": float(np.max(projected.moved_q)), "moved_p": float(np.max(projected.moved_p))}
        some = require_projected(projected, "a grid")
        for name in (name for name in mesh if name in places):
            k, i = places[name]
            measured[f"moved {name}"] = float(np.max(np.abs(some.start[k][:, i] - mesh[name])))
        moved = ", ".join(f"{name[6:]} by at most {value:.2g}" for name, value in measured.items() if name.startswith("moved "))
        ends = f", moved onto the manifold by at most {measured['moved_q']:.2g} in q and {measured['moved_p']:.2g} in p"
        return Starts(some, f"{about}{ends}{f', {moved}' if moved else ''}.", measured)

    def _axes(self, ivp: Ivp) -> dict[str, Array]:
        """Return the values of each name as arrays."""
        if not self.values:
            raise BadInput("a grid needs values of at least one parameter, coordinate or h.")
        axes = {}
        for name, values in self.values.items():
            known = [*ivp.parameters, *coordinates(ivp), "h"]
            if name not in known:
                raise unknown(f"parameter or coordinate of {ivp.problem} in a grid", name, known)
            axis = np.array([real(name, value) for value in np.atleast_1d(np.asarray(values, dtype=object))])
            if not len(axis):
                raise BadInput(f"a grid needs at least one value of {name}.")
            axes[name] = axis
        return axes

    def _step_sizes(self, mesh: Mapping[str, Array], h: Any) -> Any:
        if ("h" in mesh) == (h is not None):
            raise BadInput("give h once: in the grid, or beside it.")
        return mesh.get("h", h)
