"""The run, or runs that are made together, of a row of a store."""

from collections.abc import Mapping
from typing import Any

from daebench.studies.grid.member_runs import MemberRuns
from daebench.studies.grid.parameter_runs import ParameterRuns
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.start_runs import StartRuns


def specification_of(given: Mapping[str, Any]) -> GridRun:
    """Return a run, or several, with the fields that :meth:`GridRun.plain` gives; raise BadInput if there are others."""
    if "distribution" in given:
        return StartRuns.of_plain(given)
    if "varied" in given:
        return ParameterRuns.of_plain({**given, "values": tuple(map(float, given["values"]))})
    if "numbers" in given:
        return MemberRuns.of_plain({**given, **{name: tuple(given[name]) for name in ("differing", "watch")}})
    return GridRun.of_plain(given)
