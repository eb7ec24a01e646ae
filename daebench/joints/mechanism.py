"""A mechanism as it is declared, and the constrained Hamiltonian system that it is."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import sympy as sp

from daebench.errors import InvalidProblem
from daebench.joints.angles import Angle, Angles, AnyAngle, Coupling, Gear, gauge
from daebench.joints.bodies import AnyBody, Body, QuaternionBody
from daebench.joints.cases import case_of
from daebench.joints.constraints import Labelled, Tie, equations_of, keepers
from daebench.joints.drivers import DrivenAngle, t
from daebench.joints.exact import Values, exact, numbers, vector
from daebench.joints.forces import Force, Spring, damping_force, sides, spring_energy
from daebench.joints.inertia import Terms, mass_terms, moments, require_moments, square_terms
from daebench.joints.parts import dropped_of, forces_of, rows_of
from daebench.joints.picture import drawn
from daebench.joints.placing import GROUND, Guided, Places, places_of
from daebench.joints.rolling import Contact, KnifeEdge, Rolling
from daebench.joints.rows import FEWEST, chain_of
from daebench.joints.starts import Start
from daebench.joints.torques import AnyForce, PDMotor, RotationalSpring, torque_force
from daebench.joints.unit_slips import doubts_of
from daebench.systems.chain import ConstrainedChain
from daebench.systems.constrained import ConstrainedHamiltonian, coordinates
from daebench.systems.parts import Parts
from daebench.systems.picture import Exact, Picture

SINGULAR = 1e-13
"""Least eigenvalue of M with a diagonal of 1 that does not count as 0."""


@dataclass(frozen=True, kw_only=True)
class Mechanism:
    """Bodies in natural coordinates, joints between them, and forces: in the plane or in space, by how many coordinates points have.

    All is declared at one position, the reference position, at which the joints are closed: lengths and angles are those that it has there.

    Parameters
    ----------
    ground : mapping of str to point
        Points that do not move.
    points : mapping of str to point or Guided
        Points that move. Two bodies that name the same point are joined there by a hinge, in space by a ball, at no cost.
    directions : mapping of str to direction
        Directions that are fixed in bodies: two bodies that name a point and a direction are hinged there in space.
    fixed_directions : mapping of str to direction
        Directions that do not move.
    bodies : mapping of str to PointMass, Rod, Plate, Body or QuaternionBody
        Bodies and point masses.
    angles : mapping of str to Angle, Travel or Spin
        Angles between bodies and of wheels, and distances, for torques or forces, couplings and rotors.
    joints : sequence of joint, Distance, driver, Gear, Coupling, Rolling or KnifeEdge
        Other constraints between them.
    forces : sequence of Spring, Damper, Torque, RotationalSpring, RotationalDamper or PDMotor
        Springs and dampers between points, and torques at angles.
    gravity : vector, optional
        Gravitational acceleration, m/s^2.
    parameters : mapping of Symbol to number
        Run-time parameters, which places, masses and all other numbers may contain.
    cases : mapping of str to Start
        Where it starts; by default at rest in the reference position.
    """

    points: Mapping[str, Sequence[Exact] | Guided]
    bodies: Mapping[str, AnyBody]
    ground: Mapping[str, Sequence[Exact]] = field(default_factory=dict)
    directions: Mapping[str, Sequence[Exact]] = field(default_factory=dict)
    fixed_directions: Mapping[str, Sequence[Exact]] = field(default_factory=dict)
    angles: Mapping[str, AnyAngle] = field(default_factory=dict)
    joints: Sequence[Tie] = ()
    forces: Sequence[AnyForce] = ()
    gravity: Sequence[Exact] | None = None
    parameters: Mapping[sp.Symbol, float] = field(default_factory=dict)
    cases: Mapping[str, Start] = field(default_factory=lambda: {"rest": Start(about="released at rest")})

    def problem(self, **more: Any) -> ConstrainedHamiltonian:
        """Return its equations, with M positive definite.

        M is constant without quaternions, and without angles about axes that turn which have no armature and whose value plays a part.

        ::

            H = 1/2 p^T M^-1 p + U(q)      g: distances and products of directions in each body, and the equations of the joints

        Parameters
        ----------
        **more
            What else the problem declares, as integrals and a chart, of :class:`daebench.ConstrainedHamiltonian`.

        Raises
        ------
        InvalidProblem
            If a part contradicts another; the message names them.
        """
        return _problem(self, more)

    def chain(self) -> ConstrainedChain:
        """Return the mechanism as a chain, defined at one node: the cost of a step per body does not depend on their number.

        Its nodes are moving points, one or a few together, in the order in which bodies name them.

        Raises
        ------
        InvalidProblem
            If it is no long row of equal cells, each tied to its neighbours alone, that starts at rest; or as of :meth:`problem`.
        """
        return _chain(self)


@dataclass(frozen=True)
class _Worked:
    """Parts of problems and chains."""

    angles: Angles
    terms: Terms
    energies: list[sp.Expr]
    g: Labelled
    velocity: Labelled
    dropped: list[str]
    signs: Labelled
    picture: Picture


def placed(mechanism: Mechanism) -> Places:
    """Return where all points and bodies of a mechanism are, in its unknowns."""
    places = places_of(mechanism.ground, mechanism.points, mechanism.directions, mechanism.fixed_directions, dict(mechanism.parameters))
    for name, body in mechanism.bodies.items():
        if name == GROUND:
            raise InvalidProblem(f"a body is called {GROUND!r}, which is the name of the ground; rename it.", "body-called-ground")
        places.body(name, body)
    _require_used(mechanism, places)
    return places


def angled(mechanism: Mechanism, places: Places) -> Angles:
    """Return the angles of a mechanism; their unknowns are added to its places."""
    references = {name: column.reference for name, column in (places.declared | places.columns).items()}
    spread = {name: moments(name, body, references, places.values) for name, body in mechanism.bodies.items()}
    angles = Angles(places, spread, mechanism.joints, valued=valued_in(mechanism))
    for name, angle in mechanism.angles.items():
        angles.add(name, angle)
    return angles


def _worked(mechanism: Mechanism) -> _Worked:
    values, places = dict(mechanism.parameters), placed(mechanism)
    angles = angled(mechanism, places)
    angles.squares += [gauge(name, body, angles) for name, body in mechanism.bodies.items() if isinstance(body, QuaternionBody)]
    terms, energies = _inertia_and_weight(mechanism, angles)
    springs = [force for force in mechanism.forces if isinstance(force, Spring) and exact(force.stiffness) != 0]
    energies += [spring_energy(spring, places.columns, values) for spring in springs]
    energies += [force.energy(angles.given(force.angle)) for force in mechanism.forces if isinstance(force, RotationalSpring)]
    tied, signs, groups = equations_of(mechanism.joints, angles, values)
    signs += sides(springs, places.columns, values)
    turned: list[Angle | DrivenAngle] = [
        *(angle for angle in mechanism.angles.values() if isinstance(angle, Angle)),
        *(joint for joint in mechanism.joints if isinstance(joint, DrivenAngle)),
    ]
    picture = drawn(mechanism.bodies, places, mechanism.joints, _between_points(mechanism), turned, list(mechanism.ground))
    by = keepers(tied, places.q)
    g = [equation for k, equation in enumerate(tied) if by[k] == k]
    contacts = [Contact(joint, angles) for joint in mechanism.joints if isinstance(joint, KnifeEdge | Rolling)]
    velocity = [row for contact in contacts for row in contact.rows() if sp.expand(row[1]) != 0]
    return _Worked(angles, terms, energies, g, velocity, dropped_of(tied, groups, by), signs, picture)


def valued_in(mechanism: Mechanism) -> frozenset[str]:
    """Return the names of angles whose value plays a part: of springs, servos, couplings and cases."""
    names = {x.angle for x in mechanism.forces if isinstance(x, RotationalSpring) or (isinstance(x, PDMotor) and exact(x.kp) != 0)}
    names |= {name for x in mechanism.joints if isinstance(x, Coupling | Gear) for name in (x.first, x.second)}
    return frozenset(names.union(*(start.angles for start in mechanism.cases.values())))


def _parts(mechanism: Mechanism, worked: _Worked, values: Values) -> Parts:
    """Return the parts of a mechanism in words."""
    places = worked.angles.places
    columns = places.columns
    rows = rows_of(mechanism.bodies, columns, values)
    return Parts(
        constraints=tuple(words for words, _ in (*worked.g, *worked.velocity)),
        dropped=tuple(worked.dropped),
        forces=tuple(forces_of(mechanism.forces, mechanism.joints, mechanism.angles)),
        bodies=tuple(row.words for row in rows),
        doubts=tuple(doubts_of(rows, columns, values)),
        coordinates=tuple(f"{part} of {name}" for name in places.owners for part in places.named(name)),
        places={name: column.now for name, column in columns.items()},
        turning={name: [now for _, now in frame.directions] for name, frame in places.frames.items()},
        mechanism=mechanism,
    )


def _problem(mechanism: Mechanism, more: Mapping[str, Any]) -> ConstrainedHamiltonian:
    worked, values = _worked(mechanism), dict(mechanism.parameters)
    places, g = worked.angles.places, worked.g
    q, p = coordinates(len(places.q))
    M = matrix_of(worked.terms, len(q))
    _require_mass(mechanism, M, places, values)
    U = sp.Add(*worked.energies)
    forced = _forced(mechanism, worked.angles, values)
    if worked.velocity:
        forced |= {"velocity": [x for _, x in worked.velocity], "v": list(places.v)}
    time = {"t": t} if any(t in x.free_symbols for x in (U, *(x for _, x in g), *forced.get("force", ()))) else {}
    known = (worked.angles, M, g, worked.velocity, worked.signs, values)
    cases = {name: case_of(name, start, *known) for name, start in mechanism.cases.items()}
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=M,
        U=U,
        g=[x for _, x in g],
        parameters=values,
        cases=cases,
        **{"picture": worked.picture, "parts": _parts(mechanism, worked, values), **more, **time},
        **forced,
    )


def _chain(mechanism: Mechanism) -> ConstrainedChain:
    worked = _worked(mechanism)
    others = any(t in x.free_symbols for x in (*worked.energies, *(x for _, x in worked.g))) or mechanism.angles or worked.velocity
    chain = None
    # A chain has neither time nor forces without potential.
    if not others and all(exact(force.damping) == 0 for force in _between_points(mechanism)):
        more = {"parameters": dict(mechanism.parameters), "drawn": lambda _: worked.picture}
        chain = chain_of(worked.angles.places, worked.terms, worked.energies, worked.g, mechanism.cases, **more)
    if chain is None:
        raise InvalidProblem(
            f"the mechanism is not a row of {FEWEST} or more equal cells, each tied only to its neighbours, at rest and without drivers or "
            "dampers; call problem() instead of chain().",
            "mechanism-not-a-chain",
        )
    return chain


def _inertia_and_weight(mechanism: Mechanism, angles: Angles) -> tuple[Terms, list[sp.Expr]]:
    """Return the entries of M, and the potential of gravity body by body."""
    places = angles.places
    index = {symbol: k for k, symbol in enumerate(places.q)}
    entries = square_terms(angles.squares, index)
    energies: list[sp.Expr] = []
    pull = None if mechanism.gravity is None else vector("gravity", mechanism.gravity)
    if pull is not None and len(pull) != places.dimension:
        raise InvalidProblem(
            f"gravity has {len(pull)} components, but the mechanism has {places.dimension} dimensions; give as many components as "
            f"dimensions.",
            "gravity-dimension",
        )
    for name, J in angles.moments.items():
        frame = places.frames[name]
        for place, entry in mass_terms(name, J, frame, index).items():
            entries[place] = entries.get(place, sp.S.Zero) + entry
        if pull is not None:
            mass = J[-1, -1]
            energies.append(-mass * pull.dot(frame.at((J[:-1, -1] / mass).applyfunc(sp.cancel))))
    return entries, energies


def matrix_of(terms: Terms, d: int) -> sp.Matrix:
    """Return a matrix, shape(d, d), of its entries."""
    return sp.Matrix(sp.SparseMatrix(d, d, {place: sp.factor_terms(entry) for place, entry in terms.items()}))


def _require_used(mechanism: Mechanism, places: Places) -> None:
    """Refuse points that no body has, and forces at points that there are not."""
    # A dot is in the names of directions that a body was given besides its own, see Places._completed.
    left = [name for name in places.declared if name not in places.columns and "." not in name]
    if left:
        raise InvalidProblem(
            f"{', '.join(left)} belongs to no body, so it has no mass; name it in one, or add a PointMass there.", "point-of-no-body"
        )
    for force in _between_points(mechanism):
        if places.given(force.first) is places.given(force.second):
            what = f"the {type(force).__name__} of {force.first} and {force.second}"
            raise InvalidProblem(f"{what} ties {force.first} to itself; name two points.", "force-ties-to-itself")


def _require_mass(mechanism: Mechanism, M: sp.Matrix, places: Places, values: Values) -> None:
    """Refuse a mass matrix that is not positive definite."""
    entries = numbers(M.xreplace(dict(zip(places.q, places.reference, strict=True))), values)
    # Each row and column in its own unit: masses and moments of inertia cannot be compared.
    scale = np.sqrt(np.diag(entries))
    if np.all(scale > 0) and np.linalg.eigvalsh(entries / np.outer(scale, scale))[0] > SINGULAR:
        return
    for name, body in mechanism.bodies.items():
        if isinstance(body, Body):
            require_moments(name, body, values)
    # The unknown that moves most in the direction of least inertia.
    at = places.q[int(np.abs(np.linalg.eigh(entries)[1][:, 0]).argmax())]
    name = next(name for name, unknowns in places.owners.items() if at in unknowns)
    raise InvalidProblem(f"the mass matrix is singular: {name} has no inertia in some direction; give it mass.", "mechanism-mass-singular")


def _forced(mechanism: Mechanism, angles: Angles, values: Values) -> dict[str, Any]:
    """Return the forces without potential, and the symbols of velocities in them, where there are some."""
    places, v = angles.places, list(angles.places.v)
    torques = [force for force in mechanism.forces if not isinstance(force, Force)]
    damping = damping_force(_between_points(mechanism), places.columns, places.q, v, values)
    forces = [x for x in (damping, torque_force(torques, angles, v, values)) if x is not None]
    return {"force": [sp.Add(*x) for x in zip(*forces, strict=True)], "v": v} if forces else {}


def _between_points(mechanism: Mechanism) -> list[Force]:
    return [force for force in mechanism.forces if isinstance(force, Force)]
