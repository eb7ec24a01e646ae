"""A model file as MuJoCo compiles it: its bodies, joints and equality constraints in one place, with inertia that geoms imply."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from daebench.errors import BadInput, foreign
from daebench.systems.files.execute import existing
from daebench.systems.lazily import mujoco

READ = "MJCF (.xml) and URDF (.urdf) files are read"
OTHERS = {
    ".sdf": f"SDF is not read; {READ}, so export the model as one of these.",
    ".mo": f"Modelica is not read; {READ}, or write its bodies and joints with daebench.joints in a .py file.",
    ".xacro": f"xacro is a program that writes URDF; {READ}, so call xacro first and give the .urdf file that it writes.",
}
"""What to do with the files of other programs."""


@dataclass(frozen=True)
class Compiled:
    """A model file, compiled."""

    path: Path
    model: Any
    """The ``mujoco.MjModel``."""
    remarks: tuple[str, ...]
    """Sentences on what had to be changed to read it."""


def compiled(path: str | Path) -> Compiled:
    """Return the model of an MJCF or URDF file; raise BadInput with one sentence if it cannot be read."""
    file = existing(str(path), "model (MJCF or URDF)", "its folder")
    if file.suffix in OTHERS:
        raise BadInput(f"{file}: {OTHERS[file.suffix]}", "model-format-unread")
    root = _root(file)
    if root.tag == "robot":
        model, remarks = _urdf(file, root)
        _require_mimics(file, root, model)
        return Compiled(file, model, remarks)
    return Compiled(file, _called(file, mujoco.MjModel.from_xml_path, str(file)), ())


def _root(file: Path) -> ElementTree.Element:
    try:
        root = ElementTree.parse(file).getroot()
    except (ElementTree.ParseError, OSError, ValueError, LookupError) as error:
        raise BadInput(f"{file}: this is not XML that can be read ({foreign(str(error))}); {READ}.", "model-not-xml") from error
    if root.tag == "sdf":
        raise BadInput(f"{file}: {OTHERS['.sdf']}", "model-format-unread")
    if root.tag not in ("mujoco", "mujocoinclude", "robot"):
        raise BadInput(
            f"{file}: its first element is <{foreign(root.tag, 40)}>, neither <mujoco> nor <robot>; {READ}.", "model-root-element"
        )
    return root


def _called(file: Path, reader: Any, *arguments: Any) -> Any:
    """Return the model that a reader of MuJoCo returns; its error becomes a sentence."""
    try:
        return reader(*arguments)
    except (ValueError, mujoco.FatalError) as error:
        raise BadInput(
            f"{file}: MuJoCo {mujoco.mj_versionString()} cannot read it: {foreign(str(error)).rstrip('.')}; correct the model.",
            "model-refused-by-mujoco",
        ) from error


def _urdf(file: Path, root: ElementTree.Element) -> tuple[Any, tuple[str, ...]]:
    """Return the model of a URDF file, without its geometry where that is not there."""
    try:
        return _called(file, mujoco.MjModel.from_xml_path, str(file)), ()
    except BadInput:
        shapes = [(link, shape) for link in root.iter("link") for shape in link if shape.tag in ("visual", "collision")]
        for link, shape in shapes:
            link.remove(shape)
        if not shapes:
            raise
        # Where masses come from the geometry, this error says that they are missing.
        model = _called(file, mujoco.MjModel.from_xml_string, ElementTree.tostring(root, encoding="unicode"))
    return model, (f"its geometry is left out ({len(shapes)} elements), because MuJoCo cannot read all of it",)


def _require_mimics(file: Path, root: ElementTree.Element, model: Any) -> None:
    """Refuse a URDF whose mimic elements MuJoCo skips: versions before 4 do so without a word."""
    given = sum(joint.find("mimic") is not None for joint in root.iter("joint"))
    read = int((model.eq_type == mujoco.mjtEq.mjEQ_JOINT).sum())
    if read < given:
        raise BadInput(
            f"{file}: MuJoCo {mujoco.mj_versionString()} reads {read} of its {given} mimic elements, and without them the mechanism is "
            "another. Install mujoco>=4.0, or give each mimic a joint that moves.",
            "mimic-elements-unread",
        )
