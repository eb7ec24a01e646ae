"""Where a definition comes from, and the quantities derived from it, each when first asked for."""

import contextlib
import hashlib
import io
import re
import types
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from daebench.compiler.cache import generated
from daebench.compiler.facts import facts
from daebench.compiler.syntax import LANGUAGE
from daebench.compiler.written import Wrapper
from daebench.errors import BadInput, InvalidProblem, unknown
from daebench.schemes.kernels.claims import MAPPED
from daebench.systems.files.read import Problem

if TYPE_CHECKING:
    import sympy as sp

    from daebench.compiler.constrained.local import LocalDerivation
    from daebench.compiler.link import Linker
    from daebench.systems.files.read import Definition, Problem


ALGEBRAS = ("values", "arrays")
"""How vectors are held: as values in straight-line code, for few unknowns, or as arrays in loops over the nodes of a chain."""


@dataclass(frozen=True, eq=False)
class Source:
    """Where a definition comes from. The definition is made, and SymPy imported, only when something is derived."""

    problem: str
    """Name of the problem."""
    key: str = field(repr=False)
    """Text that determines the definition. It is hashed before anything is imported."""
    define: Callable[[], "Definition"] = field(repr=False)
    """Returns the definition."""
    defaults: Mapping[str, float] | None = None
    """Values of parameters that replace the defaults of the definition."""
    algebra: str = ""
    """How a chain's vectors are held: one of :data:`ALGEBRAS`, see ``chain.derivation``; "" as its size suggests."""
    outside: bool = False
    """Whether it is in a file outside of the package, of which name, place and text are in ``key`` and do not decide a motion."""

    def __post_init__(self) -> None:
        if self.algebra and self.algebra not in ALGEBRAS:
            raise unknown("algebra", self.algebra, ALGEBRAS)

    @cached_property
    def derivation(self) -> Any:
        """The derivation: all quantities derived from the definition, shared by all users."""
        return _derivation(self.define(), self.algebra)

    def form(self, name: str) -> Any:
        """Return the derivation in a form of the system; most forms use the system's own coordinates."""
        return getattr(self, f"_{name}") if name in MAPPED else self.derivation

    def split(self, splitting: str) -> Any:
        """Return the derivation of a Poisson system with this splitting; "" for its first."""
        return self.derivation.split(splitting) if splitting else self.derivation

    def combined(self, shares: Mapping[int, Mapping[int, "sp.Rational"]]) -> "Source":
        """Return the source of the same definition with other constraints: g_i + sum_j shares[i][j] g_j, for each given i."""

        def define() -> Any:
            problem = self.derivation.definition
            rows, first = [*problem.g, *problem.velocity], len(problem.g)
            if any(min(i, *row) < first <= max(i, *row) for i, row in shares.items() if row):
                raise BadInput(
                    "a constraint on velocities follows from constraints on positions; leave it out.", "redundant-velocity-constraint"
                )
            combined = [sum((c * rows[j] for j, c in row.items()), rows[i]) for i, row in shares.items()]
            count = sum(i < first for i in shares)
            return replace(problem, g=combined[:count], velocity=combined[count:])

        return replace(self, key=f"{self.key} constraints {shares}", define=define)

    @cached_property
    def _local(self) -> "LocalDerivation":
        from daebench.compiler.constrained.local import LocalDerivation

        return LocalDerivation(self.derivation)

    @cached_property
    def _canonical(self) -> "LocalDerivation":
        from daebench.compiler.constrained.canonical import CanonicalDerivation

        return CanonicalDerivation(self.derivation)

    @cached_property
    def _darboux(self) -> Any:
        if self.facts.SITES:
            from daebench.compiler.poisson.lattice import DarbouxLattice

            return DarbouxLattice(self.derivation)
        from daebench.compiler.poisson.derivation import DarbouxDerivation

        return DarbouxDerivation(self.derivation)

    @cached_property
    def facts(self) -> types.ModuleType:
        """Facts of the problem: sizes, names and initial values, see :func:`daebench.compiler.facts.facts`."""

        def build() -> str:
            definition = self.derivation.definition
            fingerprint = hashlib.sha256(definition.fingerprint.encode()).hexdigest()
            return f"{facts(self.problem, self.derivation)}FINGERPRINT = {fingerprint!r}\nMATHEMATICS = {digest_of(definition)!r}\n"

        return generated(f"{self.problem}_facts", self.key, build)

    def linked(
        self,
        stem: str,
        title: str,
        roots: Sequence[str | tuple[str, str]],
        *,
        form: str = "",
        wrapper: Wrapper | None = None,
        **options: Any,
    ) -> types.ModuleType:
        """Return a generated module of functions of the problem."""
        asked = f"functions {roots} {form} {wrapper} {sorted(options.items())}"

        def build() -> str:
            return self.text(title, roots, form=form, wrapper=wrapper, **options)

        return generated(f"{self.problem}_{stem}", f"{self.key} {asked}", build)

    def text(
        self, title: str, roots: Sequence[str | tuple[str, str]], *, form: str = "", wrapper: Wrapper | None = None, **options: Any
    ) -> str:
        """Return the text of such a module."""
        named = [(LANGUAGE, root) if isinstance(root, str) else root for root in roots]
        return linker(self.form(form), form=form, **options).module(title, named, wrapper)


def linker(derivation: Any, scheme: str = "", **options: Any) -> "Linker":
    """Return a linker; ``options`` are those of :class:`daebench.compiler.link.Options`."""
    from daebench.compiler.link import Linker, Options  # which imports SymPy; a module from the cache needs neither

    return Linker(derivation, Options(**options), scheme or None)


def _derivation(problem: "Definition", algebra: str) -> Any:
    from daebench.systems.chain import ConstrainedChain
    from daebench.systems.constrained import ConstrainedHamiltonian

    if isinstance(problem, ConstrainedChain):
        from daebench.compiler.chain.derivation import derived

        return derived(problem, algebra)
    if algebra == "arrays":
        raise BadInput(
            "the problem is not written as a chain of nodes, so its vectors cannot be arrays; leave out the algebra.",
            "not-a-chain-of-nodes",
        )
    if isinstance(problem, ConstrainedHamiltonian):
        from daebench.compiler.constrained.extended import derived as derived_in_time

        return derived_in_time(problem)
    from daebench.systems.lattice import PoissonLattice

    if isinstance(problem, PoissonLattice):
        from daebench.compiler.poisson.lattice import LatticeDerivation

        return LatticeDerivation(problem)
    from daebench.compiler.poisson.derivation import PoissonDerivation

    return PoissonDerivation(problem)


def source_of(problem: "Definition", name: str = "problem", algebra: str = "") -> Source:
    """Return the source of a definition made in this process; ``algebra`` as for :class:`Source`."""
    from daebench.systems.chain import ConstrainedChain

    if isinstance(problem, ConstrainedChain):
        from daebench.compiler.chain.derivation import held

        problem = held(problem, algebra)  # so that its fingerprint covers everything in the kernels
    defaults = {str(symbol): float(value) for symbol, value in problem.parameters.items()}
    return Source(name, f"{problem.fingerprint} {algebra}".rstrip(), lambda: problem, defaults, algebra)


def source_in(file: "Problem", structure: Mapping[str, int], algebra: str = "") -> Source:
    """Return the source of the definition in a problem file with these structural parameters."""
    values = dict(file.structure) | dict(structure)
    key = f"{file.name} {file.digest} {sorted(values.items())} {algebra}".rstrip()
    return Source(file.name, key, lambda: file.define(**values), algebra=algebra, outside=not file.own)


DUMMY = re.compile(r"dummy_index=\d+")
"""Number that SymPy gives to a symbol to make it unique; it differs between two readings of the same text."""


def require_same(
    problem: Problem, structure: Mapping[str, int], definition: "Definition", again: "Callable[[], Iterable[Definition]]"
) -> None:
    """Check that a definition is the same whenever its file is read: several times at first, then once in each process."""
    digest = digest_of(definition)

    def build() -> str:
        with contextlib.redirect_stderr(io.StringIO()):  # its messages have been shown once
            for other in again():
                _require_equal(problem, digest, digest_of(other))
        return f'"""Definition of {problem.path.stem}."""\n\nDIGEST = {digest!r}'

    key = f"definition {problem.digest} {sorted(structure.items())}"
    _require_equal(problem, digest, generated(f"{problem.path.stem}_definition", key, build).DIGEST)


def digest_of(definition: "Definition") -> str:
    """Return the content hash of the mathematics of a definition and of the values of its parameters."""
    numbers: dict[str, str] = {}
    text = DUMMY.sub(lambda match: numbers.setdefault(match[0], f"dummy{len(numbers)}"), definition.mathematics)
    return hashlib.sha256(text.encode()).hexdigest()


def _require_equal(problem: Problem, one: str, other: str) -> None:
    if one != other:
        raise InvalidProblem(
            f"{problem.name} defines another system each time it is read, so two methods would not run on the same one; let problem() "
            "depend only on its arguments, not on a clock, the environment, another file, or a random number without a seed.",
            "definition-changes-on-reading",
        )
