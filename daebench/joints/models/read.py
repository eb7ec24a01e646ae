"""``daebench.read_model``: a model file as a mechanism, and as the text of a Python file."""

import hashlib
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daebench.joints.models.compiled import compiled
from daebench.joints.models.left_out import LeftOut, left_out, sentence
from daebench.joints.models.mechanism import mechanism_of
from daebench.joints.models.text import text_of
from daebench.systems.files.read import Problem

if TYPE_CHECKING:
    from daebench.joints.mechanism import Mechanism
    from daebench.systems.constrained import ConstrainedHamiltonian


@dataclass(frozen=True)
class Model:
    """A model file, read as a mechanism."""

    path: Path
    """The file."""
    mechanism: "Mechanism"
    """The mechanism."""
    left_out: Mapping[str, int]
    """Numbers of parts that it has not, such as joint limits, by what they are."""
    remarks: tuple[str, ...]
    """Sentences on what was changed, such as keyframes whose loops were closed."""

    @property
    def summary(self) -> str:
        """The first line of the docstring of its file."""
        return f"{self.path.stem}, a mechanism read from {self.path.name}."

    @cached_property
    def text(self) -> str:
        """The text of a Python file that defines the mechanism."""
        return text_of(
            self.mechanism, self.summary, [f"Left out: {sentence(self.left_out)}.", *(f"Note: {remark}." for remark in self.remarks)]
        )

    def problem(self) -> "ConstrainedHamiltonian":
        """Return its equations, see :meth:`daebench.joints.Mechanism.problem`."""
        return self.mechanism.problem()


def read_model(path: str | Path) -> Model:
    """Return the mechanism of an MJCF or URDF file, with hard constraints.

    MuJoCo reads the file, see the extra ``models``. Bodies, their inertia, hinges, slides, balls and free joints, and the equality
    constraints connect, weld and joint become parts of :mod:`daebench.joints`, and so do springs, dampers, rotors, motors and servos of
    joints; keyframes become cases. What is left out, such as contacts and limits, is counted, and a warning says so::

        >>> import daebench, pathlib, tempfile
        >>> file = pathlib.Path(tempfile.mkdtemp()) / "pendulum.xml"
        >>> inertia = '<inertial pos="0 0 -1" mass="1" diaginertia="0.1 0.1 0.1"/>'
        >>> body = f'<body name="rod"><joint name="pivot" axis="0 1 0"/>{inertia}</body>'
        >>> _ = file.write_text(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
        >>> daebench.read_model(file).mechanism.bodies["rod"].names
        ('pivot', 'rod_centre')

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    Model
        With ``mechanism``, ``text``, ``left_out``, ``remarks`` and :meth:`Model.problem`.

    Raises
    ------
    BadInput
        If MuJoCo is not installed or cannot read the file, or a part of it has no counterpart in ``daebench.joints``.
    """
    source = compiled(path)
    mechanism, remarks = mechanism_of(source)
    model = Model(source.path, mechanism, left_out(source.model), (*source.remarks, *remarks))
    said = [f"left out of the mechanism: {sentence(model.left_out)}"] * bool(model.left_out)
    for words in [*said, *model.remarks]:
        warnings.warn(f"{source.path}: {words}.", LeftOut, stacklevel=2)
    return model


@dataclass(frozen=True)
class ModelFile(Problem):
    """A model file that is named where a problem is."""

    model: "Model" = None  # type: ignore[assignment]

    @cached_property
    def digest(self) -> str:
        """Content hash of the mechanism, whatever files it was read from."""
        return hashlib.sha256(self.model.text.encode()).hexdigest()


def find(name: str) -> Problem:
    """Return the problem of a model file."""
    model = read_model(name)
    parameters = {str(symbol): value for symbol, value in model.mechanism.parameters.items()}

    def run(_: Problem, structure: Mapping[str, int]) -> Any:
        return model.problem()

    place = model.path.absolute()
    return ModelFile(name, model.summary, parameters, {}, "constrained", place, "", lambda problem: [problem.path], run, model=model)
