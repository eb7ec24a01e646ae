"""What options are where they are left out: the same from the command line as in Python."""

import inspect

from daebench import ensemble, long, work_precision
from daebench.cli.signature import command_of
from daebench.starts.members import Neighbourhood
from daebench.studies.ensemble.run import MEMBERS
from daebench.studies.long.run import STRIDE
from daebench.studies.work_precision.starts import SOLVER_MEMBERS
from daebench.studies.work_precision.study import REPEAT


def numbers(function):
    """Return the numbers that parameters of a function are where they are left out, by name."""
    parameters = inspect.signature(function).parameters.values()
    return {p.name: p.default for p in parameters if isinstance(p.default, int | float) and not isinstance(p.default, bool)}


def help_of(command, name):
    """Return the help of an option."""
    (option,) = inspect.signature(command).parameters[name].annotation.__metadata__
    return option.help


def test_numbers_that_are_left_out_are_the_same_from_the_command_line():
    found = numbers(command_of(ensemble))
    assert (set(found), found) == ({"points", "seed"}, numbers(ensemble))
    assert numbers(command_of(work_precision)) == {"solver_starts": SOLVER_MEMBERS, "seed": 0, "repeat": REPEAT}
    assert numbers(command_of(long))["stride"] == STRIDE


def test_the_help_says_what_is_taken():
    assert f"by default {MEMBERS}, " in help_of(command_of(ensemble), "members")
    assert f" [{Neighbourhood.size:g}]." in help_of(command_of(ensemble), "size")
