"""The declarations of a problem, checked in its cases."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

from daebench.diagnostics.problem.check import Held, held
from daebench.errors import BadInput
from daebench.methods.initial_value_problem import declared_ivps
from daebench.runs.mechanism import parts_as_json, parts_printed
from daebench.runs.request import Told
from daebench.runs.result import Table
from daebench.studies.claims.bench import Checked
from daebench.systems.lazily import pandas as pd
from daebench.systems.parts import Parts


@dataclass(frozen=True)
class Declarations(Checked):
    """The declarations of a problem, and whether they hold."""

    problem: str
    """Its name, or the path of its file."""
    checks: tuple[Held, ...]
    """One for each check of each case."""
    parts: Parts | None
    """The parts of a mechanism."""

    @property
    def table(self) -> "pd.DataFrame":
        """One row a check."""
        return pd.DataFrame([asdict(check) for check in self.checks])

    @property
    def faults(self) -> list[str]:
        """Mistakes, as sentences."""
        return [check.fault for check in self.checks if check.fault]

    @property
    def status(self) -> int:
        """1 if there is a mistake."""
        return int(bool(self.faults))

    def summary(self) -> dict[str, Any]:
        """Return the checks, for JSON."""
        checks = [asdict(check) for check in self.checks]
        return {"problem": self.problem, "checks": checks, "ok": not self.faults} | parts_as_json(self.parts)

    def printed(self) -> Iterator[str | Table]:
        """Yield the checks, a row each, the parts of a mechanism, further results, and the mistakes."""
        rows = [[check.case, check.what, "FAILS" if check.fault else "ok"] for check in self.checks]
        yield Table(["case", "checked", ""], rows, self.problem)
        yield from parts_printed(self.parts)
        yield from (f"case {check.case}: {check.note}" for check in self.checks if check.note)
        yield from self.faults


def declarations(problem: Any, case: str | None, parameters: Mapping[str, float] | None, progress: Told) -> Declarations:
    """Return the checks of a problem with these values of parameters, in all its cases or in one."""
    if not isinstance(problem, str):
        raise BadInput(
            "the declarations of a problem are checked in its file; give its name or path, or a method.", "declarations-not-from-file"
        )
    ivps, checks = declared_ivps(problem, case, parameters), list[Held]()
    for k, ivp in enumerate(ivps):
        where = f"check {problem}, case {ivp.case}"
        checks += held(ivp, partial(_tell, progress, k / len(ivps), where))
    parts = getattr(ivps[0].source.derivation.definition, "parts", None) if ivps else None
    return Declarations(problem, tuple(checks), parts if isinstance(parts, Parts) else None)


def _tell(progress: Told, part: float, where: str, what: str) -> None:
    progress(part, f"{where}: {what}")
