"""All that an animation shows: the runs of all methods, where their points are in the plane of the picture, and how long it lasts."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from daebench.diagnostics.along import LABELS
from daebench.draw.figures import STROKES, Stroke
from daebench.draw.methods import name_of, stroke_of
from daebench.draw.orthographic import projected
from daebench.draw.scene import AMPLITUDE, Layout, moving
from daebench.draw.svg.axis import Axis, around
from daebench.pages.animation.recorded_run import RecordedRun
from daebench.runs.trajectory import Array
from daebench.systems.lazily import pandas as pd

APART = 3.0
"""A method whose parts get so many times as far from the middle as those of the others may leave the picture."""

MOST_TRAILS = 4
"""Most masses of which each leaves a trail; of more, the last alone does."""

TRAIL_SECONDS = 2.0
"""How long a trail is, in time that is shown."""

DISC, FEW = 9.0, 8
"""Diameter of a mass, pixels, where there are no more than so many."""

FLOOR = 1e-18
"""Errors below this count as none."""


@dataclass(frozen=True)
class AnimatedRuns:
    """All that an animation shows."""

    problem: str
    case: str
    """Names."""
    parameters: Mapping[str, float]
    """The problem's parameters."""
    layout: Layout
    """What is drawn of a state."""
    runs: Sequence[RecordedRun]
    """One a method."""
    times: Array
    """The times that are shown, equidistant from 0 to the end; shape (frames,)."""
    seconds: float
    """How long the animation lasts."""
    title: str = ""
    """What stands above it, where it is not problem and case."""
    size: tuple[int, int] | None = None
    """Width and height in pixels, of what is drawn as pixels; by default as the scenes take."""

    @property
    def heading(self) -> str:
        """The title of the animation; by default the problem and its case."""
        return self.title or f"{self.problem}, case {self.case}"

    @property
    def t_end(self) -> float:
        """End of the runs."""
        return float(self.times[-1])

    @property
    def fps(self) -> float:
        """Frames a second."""
        return (len(self.times) - 1) / self.seconds

    @property
    def trail(self) -> int:
        """Frames that a trail goes back."""
        return max(1, round(TRAIL_SECONDS * self.fps))

    @cached_property
    def points(self) -> list[Array]:
        """Points of each run, shape(n, k, dimension)."""
        return [self.layout.at(run.states) for run in self.runs]

    @cached_property
    def flat(self) -> list[Array]:
        """Points of each run in the plane of the picture, shape(n, k, 2)."""
        return [projected(points) for points in self.points]

    @cached_property
    def trails(self) -> list[int]:
        """Points that leave a trail."""
        indices = moving(np.concatenate([np.nan_to_num(positions) for positions in self.points]), self.layout.masses)
        return indices if len(indices) <= MOST_TRAILS else indices[-1:]

    @property
    def disc(self) -> float:
        """Diameter of a mass in pixels: the smaller, the more there are."""
        return DISC * min(1.0, math.sqrt(FEW / max(1, len(self.layout.masses))))

    @cached_property
    def columns(self) -> list[str]:
        """Names of the errors that are shown."""
        return [name for name in LABELS if any(name in run.errors for run in self.runs)]

    @cached_property
    def box(self) -> tuple[Axis, Axis]:
        """Axes of all scenes: they hold all points, but for methods far :data:`APART` from the others."""
        rest = projected(self.layout.surface).reshape(-1, 2)
        clouds = [positions.reshape(-1, 2)[np.isfinite(positions.reshape(-1, 2)).all(axis=1)] for positions in self.flat]
        middle = np.concatenate([rest, *(cloud[: self.flat[0].shape[1]] for cloud in clouds)]).mean(axis=0)
        reach = [float(np.abs(cloud - middle).max()) for cloud in clouds]
        near = [cloud for cloud, far in zip(clouds, reach, strict=True) if far <= APART * min(reach)]
        names = self.layout.axes if self.layout.dimension == 2 and self.layout.axes else ("x", "y")
        x, y = (around(name, rest[:, i], *(cloud[:, i] for cloud in near), margin=0.08) for i, name in enumerate(names))
        return x, y

    @property
    def square(self) -> tuple[Axis, Axis]:
        """The axes of all scenes, the shorter made as long as the longer."""
        x, y = self.box
        long = max(x.high - x.low, y.high - y.low)
        return x.widened(long / (x.high - x.low)), y.widened(long / (y.high - y.low))

    def leaves(self, k: int) -> bool:
        """Return whether parts of a run leave the picture, or are nowhere."""
        shares = np.stack([axis.share(self.flat[k][..., i]) for i, axis in enumerate(self.box)])
        return not bool(np.all((shares >= 0) & (shares <= 1)))

    @property
    def amplitude(self) -> float:
        """Half the width of springs, in units of the scene."""
        return AMPLITUDE * max(axis.high - axis.low for axis in self.box)

    @property
    def corner(self) -> tuple[Array, float]:
        """Where the three directions of space are drawn, in the lower left of a scene, and how long they are."""
        x, y = self.box
        size = 0.09 * max(x.high - x.low, y.high - y.low)
        return np.array([x.low + size, y.low + size]), size

    @property
    def equal(self) -> bool:
        """Whether a unit is as long along both axes of a scene: in space, and where the coordinates are lengths."""
        return self.layout.dimension == 3 or not self.layout.axes

    @cached_property
    def time_axis(self) -> Axis:
        """The axis of time."""
        return Axis("time t", 0.0, self.t_end)

    def error_axis(self, column: str) -> Axis:
        """Return the axis of an error."""
        return around(LABELS[column], *(run.errors[column] for run in self.runs if column in run.errors), log=True, floor=FLOOR)

    @property
    def pace(self) -> str:
        """How physical time and the time that is shown go together."""
        return f"t = 0 to {self.t_end:g} in {self.seconds:.3g} s: {self.t_end / self.seconds:.3g} units of time a second"

    @property
    def monitored(self) -> str:
        """A sentence on the errors that the curves show."""
        sampled = [run.method for run in self.runs if run.over == "outputs"]
        steps = "The curves show the largest error of all steps since the previous state shown"
        return steps + (f"; of {', '.join(sampled)}, that of all outputs." if sampled else ".")

    def scene_title(self, k: int) -> str:
        """Return the name of a scene's method, and after it that it stopped, and that it leaves the picture, if so."""
        run = self.runs[k]
        remarks = [f"stopped at t = {run.t[-1]:.4g}"] * (run.failure is not None) + ["leaves the picture"] * self.leaves(k)
        return ", ".join([name_of(run.method), *remarks])

    def stroke(self, k: int) -> Stroke:
        """Return the stroke of the k-th run: that of its method, or where methods look alike, that of its place."""
        strokes = [stroke_of(run.method) for run in self.runs]
        return strokes[k] if len({stroke.color for stroke in strokes}) == len(strokes) else STROKES[k % len(STROKES)]

    def table(self) -> "pd.DataFrame":
        """Return the states shown, a row a method and state: method, t, errors since the state before, and each moving point once."""
        everything = np.concatenate([np.nan_to_num(positions) for positions in self.points])
        indices = moving(everything, range(everything.shape[1]))
        frames = []
        for run, points in zip(self.runs, self.points, strict=True):
            columns = {"method": run.method, "t": run.t, **run.errors}
            columns |= {
                f"{axis}{n}": points[:, k, i] for n, k in enumerate(indices, 1) for i, axis in enumerate("xyz"[: self.layout.dimension])
            }
            frames.append(pd.DataFrame(columns))
        return pd.concat(frames, ignore_index=True)
