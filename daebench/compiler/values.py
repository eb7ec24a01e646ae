"""Vectors and matrices in the files of schemes: values whose operators are operations of an algebra.

A weight is held separately until its factor appears in a sum, so that ``y + w * x`` is one operation, and a transpose until its matrix
appears in a product. A value that is bound to a name, handed to a function or returned is whole.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Any, TypeVar, get_args, get_origin

from daebench.compiler import shapes
from daebench.compiler.shapes import HALF_MATRIX, IDENTITY, MATRIX, MULTIPLIER, NUMBER, ROWS, VECTOR, Kind, Pack, Stages, said, wider

Algebra = Callable[..., Any]
"""Carries out an operation: takes its name, then what the algebra holds its arguments as."""


class Misfit(TypeError):
    """Values that no operation takes, or that are not what a function takes."""


class Element:
    """An element of a space."""

    __array_ufunc__ = None  # NumPy's numbers leave operators to elements
    __slots__ = ("algebra", "held", "kind", "outer", "turned", "weight")

    def __init__(self, algebra: Algebra, kind: str, held: Any, weight: Any = None, turned: bool = False, outer: Any = None) -> None:
        self.algebra, self.kind, self.held = algebra, kind, held
        self.weight, self.turned, self.outer = weight, turned, outer

    @property
    def whole(self) -> "Element":
        """The same with weight and transpose applied."""
        if self.outer is not None or (self.turned and wider(self.kind) != MATRIX):
            raise Misfit(f"the transpose of {said(self.kind)} may only appear in a product")
        if self.weight is None and not self.turned:
            return self
        kind, held = (MATRIX, self.algebra("transpose", self.held)) if self.turned else (wider(self.kind), self.held)
        if self.weight is None:
            return Element(self.algebra, kind, held)
        if kind not in shapes.SCALE:
            raise Misfit(f"{said(self.kind)} cannot be multiplied by a number")
        return Element(self.algebra, kind, self.algebra(shapes.SCALE[kind], self.weight, held))

    def _weighted(self, weight: Any) -> "Element":
        return Element(self.algebra, self.kind, self.held, weight, self.turned, self.outer)

    @property
    def T(self) -> "Element":
        """Its transpose."""
        if wider(self.kind) not in (ROWS, MATRIX, VECTOR):
            raise Misfit(f"{said(self.kind)} has no transpose")
        return Element(self.algebra, self.kind, self.held, self.weight, not self.turned, self.outer)

    def __neg__(self) -> "Element":
        return self._weighted(-1.0 if self.weight is None else -self.weight)

    def __mul__(self, w: Any) -> "Element":
        w = number(w)
        return self._weighted(w if self.weight is None else w * self.weight)

    __rmul__ = __mul__

    def __truediv__(self, w: Any) -> "Element":
        return self._weighted(self._factor / number(w))

    def __add__(self, other: Any) -> "Element":
        return self._sum(other, subtracted=False)

    def __sub__(self, other: Any) -> "Element":
        return self._sum(other, subtracted=True)

    def __radd__(self, other: Any) -> "Element":
        raise Misfit(f"{named(other)} and {said(self.kind)} have different shapes")

    __rsub__ = __radd__

    def _sum(self, other: Any, *, subtracted: bool) -> "Element":
        """Return self + other or self - other as one operation w x + y."""
        if type(other) is not Element:
            raise Misfit(f"{said(self.kind)} and {named(other)} have different shapes")
        weight = (-other if subtracted else other).weight
        if self.kind == IDENTITY and self.weight is None:
            return self._plus_identity(other._weighted(weight))
        if other.outer is not None and weight is None and self.outer is None:
            return Element(self.algebra, ROWS, self.algebra("outer_md", other.held, other.outer, self.whole.held))
        kind = wider(self.kind)
        if kind != wider(other.kind):
            raise Misfit(f"{said(self.kind)} and {said(other.kind)} have different shapes")
        if operation := shapes.PLAIN_SUMS.get((kind, subtracted)):
            return Element(self.algebra, kind, self.algebra(operation, self.whole.held, other.whole.held))
        operation = shapes.ADD.get(kind)
        if operation is None:
            raise Misfit(f"{said(self.kind)} and {said(other.kind)} have no such sum")
        if self.weight is not None and weight is None and not self.turned:
            return Element(self.algebra, kind, self.algebra(operation, self.weight, self.held, other.whole.held))
        plain = other._weighted(None).whole.held
        return Element(self.algebra, kind, self.algebra(operation, 1.0 if weight is None else weight, plain, self.whole.held))

    @property
    def _factor(self) -> Any:
        return 1.0 if self.weight is None else self.weight

    def _plus_identity(self, X: "Element") -> "Element":
        """Return I + w X."""
        if X.kind == HALF_MATRIX:
            return Element(X.algebra, HALF_MATRIX, X.algebra("identity_minus", -X._factor, X.held))
        if wider(X.kind) != MATRIX:
            raise Misfit(f"the identity and {said(X.kind)} have different shapes")
        return Element(X.algebra, MATRIX, X.algebra("identity_plus", X._factor, X._weighted(None).whole.held))

    @property
    def _shape(self) -> str:
        return f"{self.kind}{'.T' * self.turned}"

    def __matmul__(self, other: Any) -> "Element":
        if not isinstance(other, Element):
            raise Misfit(f"there is no product of {self._shape} and {named(other)}")
        weight = other.weight if self.weight is None else self.weight if other.weight is None else self.weight * other.weight
        if self.kind == MULTIPLIER and other._shape == "Vector.T" and weight is None:
            return Element(self.algebra, ROWS, self.held, outer=other.held)
        way = _product(self._shape, other._shape) if self.outer is None and other.outer is None else None
        if way is None:
            raise Misfit(f"there is no product of {self._shape} and {other._shape}")
        one, two, rule = way
        factors = self._turned(one), other._turned(two)
        held = self.algebra(rule.call, *(factors[::-1] if rule.swapped else factors))
        return Element(self.algebra, rule.kind, held, weight, rule.turned)

    def _turned(self, turn: bool) -> Any:
        """Return S for the transpose of S^T, or S^T as a new matrix for that of S."""
        return self.algebra("transpose", self.held) if turn else self.held

    def __pow__(self, exponent: Any) -> "Element":
        raise Misfit(f"{said(self.kind)} and {named(exponent)} have no such operation")

    def __getitem__(self, i: Any) -> Any:
        entry = shapes.ENTRY.get(self.kind)
        if entry is None:
            raise Misfit(f"{said(self.kind)} has no entries")
        part = self.whole.held[i]
        return part if entry == NUMBER else Element(self.algebra, entry, part)

    def __len__(self) -> int:
        return len(self.held)

    def __iter__(self) -> Iterator[Any]:
        return (self[i] for i in range(len(self)))

    def __bool__(self) -> bool:
        raise Misfit(f"{said(self.kind)} is neither true nor false")

    def merged(self, other: Any, select: Callable[[Any, Any], Any]) -> "Element":
        """Return a choice between two elements, made by ``select`` of what they are held as."""
        if not isinstance(other, Element) or wider(self.kind) != wider(other.kind):
            raise Misfit(f"it is {said(self.kind)} or {named(other)}")
        kind = self.kind if self.kind == other.kind else wider(self.kind)
        return Element(self.algebra, kind, select(self.whole.held, other.whole.held))


@cache
def _product(left: str, right: str) -> tuple[bool, bool, shapes.Product] | None:
    """Return whether the factors of a product, given by their shapes, are transposed as new matrices, and how it is then written."""
    turned = [(left, right), (_other(left), right), (left, _other(right))]
    for k, shape in enumerate(turned):
        if rule := shapes.product_of(*shape):
            return k == 1 and shape[0] != left, k == 2 and shape[1] != right, rule
    return None


def _other(shape: str) -> str:
    """Return the shape of a square matrix that is transposed as a new one; that of anything else unchanged."""
    kind, dot, _ = shape.partition(".")
    return shape if wider(kind) != MATRIX else MATRIX if dot else f"{MATRIX}.T"


def named(x: Any) -> str:
    """Return the name of the kind of a value, for messages."""
    return said(x.kind) if isinstance(x, Element) else "a tuple" if isinstance(x, tuple) else "a function" if callable(x) else "a number"


def number(w: Any) -> Any:
    """Return a number by which an element is multiplied; an integer as a number of the run's type."""
    if isinstance(w, Element | tuple) or callable(w):
        raise Misfit(f"{named(w)} stands where a number is needed; such values have no such operation")
    return float(w) if type(w) is int else w


def whole(x: Any) -> Any:
    """Return a value in which all weights and transposes are applied."""
    if type(x) is Element:
        return x if x.weight is None and not x.turned and x.outer is None else x.whole
    return tuple(map(whole, x)) if type(x) is tuple else x


def held(x: Any) -> Any:
    """Return the numbers and tuples that a value is held as, in tuples of any depth."""
    if type(x) is Element:
        return x.held if x.weight is None and not x.turned and x.outer is None else x.whole.held
    return tuple(map(held, x)) if type(x) is tuple else x


def mapped(function: Callable[[Any], Any], x: Any) -> Any:
    """Return nested tuples, and elements in them, with a function of each number in its place."""
    if isinstance(x, Element):
        return Element(x.algebra, x.kind, mapped(function, x.whole.held))
    return tuple([mapped(function, part) for part in x]) if isinstance(x, tuple) else function(x)


def flat(x: Any) -> list[Any]:
    """Return the numbers of nested tuples, and of elements in them, side by side."""
    x = x.whole.held if isinstance(x, Element) else x
    return [number for part in x for number in flat(part)] if isinstance(x, tuple) else [x]


def like(x: Any, value: Any) -> Any:
    """Return ``value`` with elements where ``x`` has elements, of the same kinds."""
    if isinstance(x, Element):
        return value if isinstance(value, Element) else Element(x.algebra, x.kind, value)
    return tuple(map(like, x, value)) if isinstance(x, tuple) else value


def summed(terms: Any) -> Any:
    """Return a sum of numbers, from the first on."""
    first, *others = terms
    if isinstance(first, Element | tuple):
        raise Misfit(f"sum adds numbers, but a term is {named(first)}; add the terms in a loop")
    for term in others:
        first = first + term
    return first


def kind_of(annotation: Any) -> Kind:
    """Return the kind that an annotation means; None if it means none."""
    if isinstance(annotation, TypeVar) or annotation is None:
        return None
    if get_origin(annotation) is tuple:
        entries = get_args(annotation)
        return Stages(kind_of(entries[0])) if entries[-1] is ... else Pack(tuple(map(kind_of, entries)))
    return shapes.NAMED.get(getattr(annotation, "__name__", ""))


def kinds_of(function: Any) -> tuple[list[Kind], Kind]:
    """Return the kinds of the parameters and of the result of a function."""
    annotations = function.__annotations__
    return [kind_of(annotation) for name, annotation in annotations.items() if name != "return"], kind_of(annotations.get("return"))


def as_kind(algebra: Algebra, kind: Kind, x: Any, *, vouched: bool = False) -> Any:
    """Return a value as one of a kind; ``vouched``, a dense matrix is one with the zeros of its kind, as what a function returns."""
    if isinstance(kind, Pack | Stages):
        if hasattr(x, "of_any_form"):
            return x
        kinds = _kinds_of_entries(kind, x)
        return tuple([as_kind(algebra, part, entry, vouched=vouched) for part, entry in zip(kinds, x, strict=True)])
    if kind in shapes.SPACES:
        return _in_space(algebra, str(kind), x, vouched=vouched)
    if kind != NUMBER:
        return whole(x)
    if isinstance(x, Element | tuple):
        raise Misfit(f"{named(x)} stands for {said(kind)}")
    return float(x) if type(x) is int else x


def _in_space(algebra: Algebra, kind: str, x: Any, *, vouched: bool) -> Element:
    if isinstance(x, int | float | complex):
        raise Misfit(f"{named(x)} stands for {said(kind)}")
    element = x.whole if isinstance(x, Element) else Element(algebra, kind, x)
    if vouched and wider(kind) == element.kind:
        return Element(algebra, kind, element.held)
    if kind not in (element.kind, wider(element.kind)):
        raise Misfit(f"{named(x)} stands for {said(kind)}")
    return element


def _kinds_of_entries(kind: Pack | Stages, x: Any) -> Sequence[Kind]:
    if not isinstance(x, tuple):
        raise Misfit(f"{named(x)} stands for a tuple")
    kinds = kind.kinds if isinstance(kind, Pack) else (kind.kind,) * len(x)
    if len(kinds) != len(x):
        raise Misfit(f"a tuple of {len(x)} values stands for one of {len(kinds)}")
    return kinds


def overloaded(name: str, args: Sequence[Any]) -> tuple[str, Kind]:
    """Return the operation that a name means for these arguments, and the kind of its result."""
    # The kinds as they are come first, so that a pattern of zeros is given up only where no operation makes use of it.
    for exact in (True, False):
        for kinds, rule in shapes.OVERLOADS[name].items():
            if len(kinds) == len(args) and all(_matches(kind, x, exact=exact) for kind, x in zip(kinds, args, strict=True)):
                return rule
    raise Misfit(f"there is no {name} of {', '.join(map(named, args))}")


def _matches(kind: Kind, x: Any, *, exact: bool) -> bool:
    if isinstance(kind, Stages):
        return isinstance(x, tuple) and all(_matches(kind.kind, entry, exact=exact) for entry in x)
    return isinstance(x, Element) and kind == (x.whole.kind if exact else wider(x.whole.kind))
