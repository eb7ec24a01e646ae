"""Names for the parts of a model: those that it has, in letters that a mechanism's names may have, each once."""

import re
from typing import Any

from daebench.joints.placing import GROUND
from daebench.systems.lazily import mujoco


class Names:
    """Names of a model's parts, each given once."""

    def __init__(self, model: Any) -> None:
        self.model = model
        self.taken = {GROUND}

    def body(self, number: int) -> str:
        """Return a new name for a body."""
        return self.new(self._text("mjOBJ_BODY", number, "body"))

    def joint(self, number: int) -> str:
        """Return the name of a joint, which points and directions of it begin with."""
        return self._text("mjOBJ_JOINT", number, "joint")

    def actuator(self, number: int) -> str:
        """Return the name of an actuator."""
        return self._text("mjOBJ_ACTUATOR", number, "actuator")

    def _text(self, kind: str, number: int, what: str) -> str:
        return mujoco.mj_id2name(self.model, getattr(mujoco.mjtObj, kind), number) or f"{what}{number}"

    def new(self, text: str) -> str:
        """Return a name that no other part has: letters, digits and underscores of a text, and a number where that is needed."""
        plain = re.sub(r"\W+", "_", text).strip("_") or "part"
        name, k = plain, 2
        while name in self.taken:
            name, k = f"{plain}_{k}", k + 1
        self.taken.add(name)
        return name
