"""Verification of a Poisson system when it is constructed: HLW VII.2.2-VII.2.4, VII.3 and VII.4.2.

Each check writes its identity as expressions that must vanish. ``vanishing.first_nonzero`` decides, by expansion if that is cheap,
otherwise with 50 digits at random points of the domain and random positive parameters: an identity must hold for all parameters.

- skewness: each entry and its mirror image add up to zero;
- the Jacobi identity (2.10): one cyclic sum for each triple i < j < k to which any entry of B contributes, which determines all of them
    by antisymmetry; the other sums are empty, so that the cost of a sparse B is proportional to its entries;
- Casimir functions: every component of B grad C;  integrals: {F, H};
- the flow of a part: y(0) is the state, and y' - B(y) grad H_part(y) vanishes along it at *every* time, which by uniqueness of solutions
  leaves no other map than the flow;
- the parts of a splitting: every component of B grad(sum - H), so that they may differ from H by a Casimir function or a constant;
- canonical coordinates: all brackets (3.13), and the inverse map applied after the map, component by component.
"""

from collections import defaultdict
from collections.abc import Mapping
from itertools import combinations
from typing import Any

import sympy as sp

from daebench.errors import InvalidProblem
from daebench.systems.vanishing import first_nonzero

System = Any
"""A PoissonSystem. Its class calls these functions when it is constructed, so its type cannot be imported here."""

Sparse = dict[int, sp.Expr]
"""A vector, given by its nonzero components."""


def check_skew(system: System) -> None:
    """Verify B^T = -B; InvalidProblem names the coordinates of the first pair of entries that fails."""
    entries = system.B.todok()
    pairs = sorted({(min(pair), max(pair)) for pair in entries})
    sums = {_names(system, i, j): entries.get((i, j), 0) + entries.get((j, i), 0) for i, j in pairs}
    _refuse(
        system,
        sums,
        "the structure matrix B is not skew-symmetric: the entry {where} and its mirror image add up to {what}, not to 0.",
        "not-skew-symmetric",
    )


def check_jacobi(system: System) -> None:
    """Verify the Jacobi identity, HLW (2.10); InvalidProblem names the coordinates of the first triple that fails, and the sum.

    ::

        sum_m  d b_ij/d y_m b_mk + d b_jk/d y_m b_mi + d b_ki/d y_m b_mj = 0        for all i, j, k
    """
    index, entries = _index(system), system.B.todok()
    rows: dict[int, Sparse] = defaultdict(dict)
    for (i, j), entry in entries.items():
        rows[i][j] = entry
    sums: dict[tuple[int, ...], list[sp.Expr]] = defaultdict(list)
    for (i, j), entry in entries.items():
        # Entries with i < j only: the others are their negatives, and would add each term twice.
        for m, slope in gradient(entry, index).items() if i < j else ():
            for k, other in rows[m].items():
                if k not in (i, j):
                    # A cyclic permutation of i, j, k leaves the term as it is, and an odd one changes its sign.
                    sums[tuple(sorted((i, j, k)))].append((-1 if i < k < j else 1) * slope * other)
    claims = {_names(system, *triple): sp.Add(*sums[triple]) for triple in sorted(sums)}
    _refuse(system, claims, "the Jacobi identity (2.10) fails at the triple {where}: its sum is {what}, not 0.", "jacobi-identity-fails")


def check_casimirs(system: System) -> None:
    """Verify grad C^T B = 0 of each Casimir function, HLW Def. 2.5, and {F, H} = 0 of each integral F.

    InvalidProblem names the function, and the component or bracket that does not vanish.
    """
    for name, casimir in system.casimirs.items():
        claims = {_names(system, i): component for i, component in field(system, casimir).items()}
        _refuse(
            system,
            claims,
            f"{name!r} is not a Casimir function: its bracket with {{where}} is {{what}}, not 0.",
            "not-a-casimir-function",
            sign=-1,
        )
    flow = field(system, system.H)
    brackets = {name: _dot(gradient(F, _index(system)), flow) for name, F in system.integrals.items()}
    _refuse(system, brackets, "{where} is not a first integral: its bracket with H is {what}, not 0.", "not-a-first-integral")


def check_splitting(system: System) -> None:
    """Verify the flow of each part, HLW VII.4.2, and that the parts of each splitting add up to H.

    InvalidProblem names the part and the component at which its flow fails, or the splitting whose parts do not add up.
    """
    for name, part in system.parts.items():
        _check_flow(system, name, part)
    for name, parts in system.splittings.items():
        rest = sp.Add(*(system.parts[part].H for part in parts)) - system.H
        claims = {_names(system, i): component for i, component in field(system, rest).items()}
        _refuse(
            system,
            claims,
            f"the parts of splitting {name!r} do not add up to H: the error of {{where}}' is {{what}}.",
            "splitting-does-not-add-up",
        )


def check_darboux(system: System) -> None:
    """Verify that canonical coordinates are canonical, HLW (3.13) with the signs of (2.3), and that their inverse gives the state.

    InvalidProblem names the two coordinates whose bracket is wrong, or the component of the state that the inverse does not give.
    """
    if (map_ := system.darboux) is None:
        return
    brackets = _canonical_brackets(system, map_)
    _refuse(
        system,
        brackets,
        "the canonical coordinates are not canonical: the bracket of {where} is wrong by {what}.",
        "coordinates-not-canonical",
    )
    z = dict(zip([*map_.q, *map_.p, *map_.c], [*map_.Q, *map_.P, *map_.C], strict=True))
    misses = {str(coordinate): sp.sympify(back).xreplace(z) - coordinate for coordinate, back in zip(system.y, map_.y, strict=True)}
    _refuse(system, misses, "the inverse of the canonical coordinates gives {where} with an error of {what}.", "canonical-inverse-wrong")


def gradient(F: sp.Expr, index: Mapping[sp.Symbol, int]) -> Sparse:
    """Return grad F. Each term is differentiated only with respect to its own coordinates, so that long sums take linear time."""
    slopes: dict[int, list[sp.Expr]] = defaultdict(list)
    for term in sp.Add.make_args(sp.sympify(F)):
        for symbol in term.free_symbols & index.keys():
            slopes[index[symbol]].append(term.diff(symbol))
    return {i: sp.Add(*slopes[i]) for i in sorted(slopes)}


def field(system: System, F: sp.Expr) -> Sparse:
    """Return the vector field B(y) grad F(y)."""
    slopes = gradient(F, _index(system))
    terms: dict[int, list[sp.Expr]] = defaultdict(list)
    for (i, j), entry in system.B.todok().items():
        if j in slopes:
            terms[i].append(entry * slopes[j])
    return {i: sp.Add(*terms[i]) for i in sorted(terms)}


def _check_flow(system: System, name: str, part: Any) -> None:
    if part.t in {*system.y, *system.parameters}:
        raise InvalidProblem(f"the time {part.t} of part {name!r} is a coordinate or parameter too; rename one.", "flow-time-taken")
    after, right = [sp.sympify(y) for y in part.y], field(system, part.H)
    start = {str(coordinate): y.xreplace({part.t: sp.Integer(0)}) - coordinate for coordinate, y in zip(system.y, after, strict=True)}
    _refuse(
        system,
        start,
        f"the flow of part {name!r} does not start at the state: at time 0 the error of {{where}} is {{what}}.",
        "flow-starts-elsewhere",
    )
    along = dict(zip(system.y, after, strict=True))
    rates = {str(coordinate): y.diff(part.t) - right.get(i, sp.S.Zero).xreplace(along) for i, (coordinate, y) in enumerate(along.items())}
    _refuse(
        system,
        rates,
        f"the flow of part {name!r} is not that of B grad H: the error of {{where}}' is {{what}}.",
        "flow-of-another-field",
        time=[part.t],
    )


def _canonical_brackets(system: System, map_: Any) -> dict[str, sp.Expr]:
    """Return the differences between the brackets of the coordinates and those of (3.13), {Q_i, P_i} = 1 and all others 0."""
    index = _index(system)
    symbols, functions = [*map_.q, *map_.p, *map_.c], [*map_.Q, *map_.P, *map_.C]
    slopes, fields = [gradient(F, index) for F in functions], [field(system, F) for F in functions]
    pairs = {(i, i + len(map_.q)) for i in range(len(map_.q))}
    return {
        f"{symbols[a]} with {symbols[b]}": _dot(slopes[a], fields[b]) - int((a, b) in pairs)
        for a, b in combinations(range(len(symbols)), 2)
    }


def _refuse(
    system: System, claims: Mapping[str, sp.Expr], sentence: str, code: str, *, sign: int = 1, time: list[sp.Symbol] | None = None
) -> None:
    """Raise InvalidProblem for the first claim that does not vanish, with its name and value inserted in the sentence."""
    symbols = [*system.y, *system.parameters, *(time or [])]
    if violation := first_nonzero({name: sign * sp.sympify(claim) for name, claim in claims.items()}, symbols, system.domain):
        raise InvalidProblem(sentence.format(where=violation[0], what=violation[1]), code, where=violation[0], what=violation[1])


def _index(system: System) -> dict[sp.Symbol, int]:
    return {symbol: i for i, symbol in enumerate(system.y)}


def _names(system: System, *indices: int) -> str:
    """Return coordinates by name: a single one as it is, several in parentheses."""
    names = ", ".join(str(system.y[i]) for i in indices)
    return names if len(indices) == 1 else f"({names})"


def _dot(a: Sparse, b: Sparse) -> sp.Expr:
    return sp.Add(*(a[i] * b[i] for i in a.keys() & b.keys()))
