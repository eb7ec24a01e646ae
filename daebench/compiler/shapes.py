"""Kinds of expressions in scheme files, and the operation of the algebra for each sum, multiple and product of them.

The named kinds are the classes of ``kernels/language.py``. ``None`` is the kind of an expression about which nothing is known; no
operator accepts it.
"""

from collections.abc import Mapping
from dataclasses import dataclass

NUMBER, INDEX, DATA, IDENTITY = "Number", "int", "Data", "Identity"
VECTOR, MULTIPLIER, HALF = "Vector", "Multiplier", "Half"
JACOBIAN, ROWS, INVERSE_MASS, MATRIX, GRAM, HALF_MATRIX = "Jacobian", "Rows", "InverseMass", "Matrix", "Gram", "HalfMatrix"


@dataclass(frozen=True)
class Pack:
    """A tuple whose entries have kinds of their own."""

    kinds: tuple["Kind", ...]


@dataclass(frozen=True)
class Stages:
    """A tuple of any length whose entries are of one kind, such as values at the stages."""

    kind: "Kind"


Kind = str | Pack | Stages | None

SPACES = (VECTOR, MULTIPLIER, HALF, JACOBIAN, ROWS, INVERSE_MASS, MATRIX, GRAM, HALF_MATRIX)
"""Kinds of vectors and matrices."""

NAMED: Mapping[str, Kind] = {name: name for name in (*SPACES, NUMBER, INDEX, DATA, IDENTITY)} | {"float": NUMBER}
"""Kinds by their names in annotations; any other name means none."""

WIDER = {JACOBIAN: ROWS, INVERSE_MASS: MATRIX}
"""Kinds with a pattern of zeros, and the dense kinds that replace them in sums, multiples and wherever the zeros do not matter."""

ENTRY = {VECTOR: NUMBER, MULTIPLIER: NUMBER, HALF: NUMBER, ROWS: VECTOR, JACOBIAN: VECTOR, GRAM: MULTIPLIER, DATA: DATA}
ENTRY |= {MATRIX: VECTOR, INVERSE_MASS: VECTOR}
"""Kinds of ``x[i]``."""

ADD = {VECTOR: "axpy", MULTIPLIER: "axpy_m", HALF: "axpy_m", MATRIX: "axpy_dd"}
"""Operations w x + y."""

PLAIN_SUMS = {(GRAM, False): "plus_mm", (ROWS, True): "minus_md"}
"""Operations x + y, or x - y where the second part is true, of kinds that have no other sum."""

SCALE = {VECTOR: "scale", MULTIPLIER: "scale_m", HALF: "scale_m", ROWS: "scale_md", MATRIX: "scale_dd", GRAM: "scale_mm"}
"""Operations w x."""


@dataclass(frozen=True)
class Product:
    """How a product is written: the operation, whether it takes its factors in the opposite order, and the kind of the result."""

    call: str
    kind: str
    swapped: bool = False
    turned: bool = False


PRODUCTS = {
    (JACOBIAN, VECTOR): Product("mul", MULTIPLIER),
    (ROWS, VECTOR): Product("mul_full", MULTIPLIER),
    (MATRIX, VECTOR): Product("apply", VECTOR),
    ("Jacobian.T", MULTIPLIER): Product("mul_T", VECTOR),
    ("Rows.T", MULTIPLIER): Product("mul_full_T", VECTOR),
    (JACOBIAN, "Rows.T"): Product("gram", GRAM),
    (ROWS, "Rows.T"): Product("gram_full", GRAM),
    (JACOBIAN, INVERSE_MASS): Product("jacobian_times", ROWS),
    (ROWS, "Matrix.T"): Product("apply_md", ROWS, swapped=True),
    (MATRIX, "Rows.T"): Product("apply_md", ROWS, turned=True),
    (MATRIX, MATRIX): Product("product", MATRIX),
    ("Rows.T", ROWS): Product("product_T", MATRIX),
}
"""Products by the kinds of their factors; a factor with a pattern of zeros may replace a dense one."""

_OF_VECTOR, _OF_ROWS, _OF_MATRIX = (Pack((VECTOR, NUMBER)), Pack((VECTOR, ROWS, NUMBER)), Pack((VECTOR, MATRIX, NUMBER)))
OVERLOADS: Mapping[str, Mapping[tuple[Kind, ...], tuple[str, Kind]]] = {
    "norm": {(VECTOR,): ("norm", NUMBER), (MULTIPLIER,): ("norm_m", NUMBER), (HALF,): ("norm_m", NUMBER)},
    "zero": {(VECTOR,): ("zero_m", MULTIPLIER)},
    "solve": {
        (GRAM, MULTIPLIER): ("solve", Pack((MULTIPLIER, NUMBER))),
        (HALF_MATRIX, HALF): ("solve", Pack((HALF, NUMBER))),
        (MATRIX, VECTOR): ("solve_d", _OF_VECTOR),
        (MATRIX, VECTOR, ROWS): ("solve_dm", _OF_ROWS),
        (MATRIX, VECTOR, MATRIX): ("solve_dd", _OF_MATRIX),
    },
    "solve_mass": {
        (MATRIX, VECTOR): ("solve_mass", _OF_VECTOR),
        (MATRIX, VECTOR, ROWS): ("solve_mass_m", _OF_ROWS),
        (MATRIX, VECTOR, MATRIX): ("solve_mass_d", _OF_MATRIX),
    },
    "solve_2s": {
        (Stages(Stages(GRAM)), Stages(MULTIPLIER)): ("solve_stages_twice", Pack((Stages(MULTIPLIER), NUMBER))),
        (Stages(Stages(MATRIX)), Stages(VECTOR)): ("solve_stages_twice_d", Pack((Stages(VECTOR), NUMBER))),
    },
}
"""Overloaded functions, by the kinds of their arguments: the operation, and the kind of its result."""


def wider(kind: str) -> str:
    """Return the kind without its pattern of zeros."""
    return WIDER.get(kind, kind)


def product_of(left: str, right: str) -> Product | None:
    """Return how the product of two kinds is written, where ".T" marks a transpose; None if there is none."""
    pairs = [(a, b) for a in (left, _widened(left)) for b in (right, _widened(right))]
    return next((PRODUCTS[pair] for pair in pairs if pair in PRODUCTS), None)


def _widened(shape: str) -> str:
    kind, dot, turned = shape.partition(".")
    return WIDER.get(kind, kind) + dot + turned


def said(kind: Kind) -> str:
    """Return a kind in words."""
    if isinstance(kind, str):
        return {NUMBER: "a number", INDEX: "an integer", DATA: "run-time data", IDENTITY: "the identity"}.get(kind, f"a {kind}")
    return "a tuple" if isinstance(kind, Pack | Stages) else "a value of unknown kind"
