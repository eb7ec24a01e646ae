"""Animations of any problem with a picture: several methods side by side, as a page, a drawing, a GIF or a video."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Unpack

import numpy as np

from daebench.draw.figures import save_table
from daebench.draw.scene import Layout, layout_of
from daebench.errors import BadInput, positive
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import methods_of
from daebench.pages.animation import film, page, smil
from daebench.pages.animation.animated_runs import AnimatedRuns
from daebench.pages.animation.recorded_run import recorded_run, requested
from daebench.runs.files import check_place
from daebench.runs.ivp import Ivp
from daebench.runs.option import Option
from daebench.runs.outputs import described, require_own, writing
from daebench.runs.own_start import OwnStart
from daebench.runs.provenance import definition
from daebench.runs.request import Progress, Told, resolution_value, silent
from daebench.runs.result import Result
from daebench.runs.texts import sides
from daebench.studies.comparison.table import TOLERANCE

if TYPE_CHECKING:
    from daebench.systems.constrained import ConstrainedHamiltonian
    from daebench.systems.poisson import PoissonSystem


def pixels_in(text: str) -> tuple[int, int]:
    """Return width and height of a text such as 1920x1080."""
    if (size := sides(text, int)) is None:
        raise BadInput(f"--size {text!r} must be width x height in pixels, for example 1920x1080.", "size-in-pixels-malformed")
    return size


FPS, SECONDS = 25.0, 12.0
"""Frames a second, and how long an animation lasts, where neither is asked for."""

LIMITS = {"fps": (1.0, 60.0), "seconds": (0.2, 600.0)}
"""What may be asked for."""

PIXELS = (200, 4096)
"""Fewest and most pixels of a side."""

ERRORS = 4
"""Most kinds of errors that are shown."""

DRAWING = 0.5
"""Part of the work that drawing frames as pixels is held for, in the progress that is told."""


@dataclass(frozen=True)
class Animated(Result):
    """The files that an animation wrote, and the failures of its methods.

    Parameters
    ----------
    paths : tuple of Path
        The file, and the numbers beside it.
    failures : tuple of str
        Why methods stopped early, each a sentence.
    """

    paths: tuple[Path, ...]
    failures: tuple[str, ...]

    fails_if: ClassVar[str] = "a method stops early"

    @property
    def status(self) -> int:
        """1 if a method stopped early."""
        return int(bool(self.failures))

    def summary(self) -> dict[str, Any]:
        """Return the failures and the paths."""
        return {"failures": self.failures, "written": [*map(str, self.paths)]}

    def printed(self) -> Iterator[str]:
        """Yield the failures and the paths."""
        yield from (*self.failures, f"written: {', '.join(map(str, self.paths))}")


MAKER = "daebench animate"
"""Who made a file, as the text beside it says."""


@dataclass(frozen=True)
class Format:
    """A kind of file: how many frames it may have of so many points, methods and errors, and what writes it."""

    most_frames: Callable[[int, int, int], int]
    write: Callable[[Path, AnimatedRuns, Progress], None]
    pixels: bool = False


FORMATS = {
    ".html": Format(page.most_frames, lambda path, animated, _: page.write(path, animated)),
    ".svg": Format(smil.most_frames, lambda path, animated, _: smil.write(path, animated)),
    ".gif": Format(lambda *_: film.MOST_GIF_FRAMES, film.write_gif, pixels=True),
    ".mp4": Format(lambda *_: film.MOST_VIDEO_FRAMES, film.write_video, pixels=True),
}
"""The kinds of files, by ending."""


def animation(
    problem: "str | ConstrainedHamiltonian | PoissonSystem",
    *,
    methods: Sequence[str],
    t_end: float,
    out: Path | str,
    h: float | None = None,
    case: str | None = None,
    tol: float = TOLERANCE,
    fps: float = FPS,
    seconds: float | None = None,
    speed: float | None = None,
    parameters: Mapping[str, float] | None = None,
    options: Mapping[str, float] | None = None,
    anyway: bool = False,
    on_singular: str | None = None,
    algebra: str = "",
    title: str = "",
    size: Annotated[tuple[int, int] | None, Option(read=pixels_in)] = None,
    overwrite: bool = False,
    progress: Told | None = None,
    **start: Unpack[OwnStart],
) -> Animated:
    """Animate methods on one problem: the motion of each above its energy error and conserved quantities.

    The numbers that it shows are written beside it, as FILE.frames.csv.

    Parameters
    ----------
    problem : str, ConstrainedHamiltonian or PoissonSystem
        Name in the catalogue, the path of a problem file, which is executed, or a definition; it declares a picture.
    methods : sequence of str
        Names of methods, each of which has a picture; FILE.py:NAME, LIBRARY.so:NAME and exec:PROGRAM are executed.
    t_end : float
        End time of the runs.
    out : path
        File: .html (a page that plays), .svg, .gif or .mp4.
    h : float
        Step size of the fixed-step methods, s.
    tol : float
        Tolerance of the others.
    case : str, optional
        Named initial values; by default the problem's first.
    fps : float
        Frames a second, 1 to 60; fewer where the file would become too large.
    seconds : float, optional
        Length of the animation, s; by default 12.
    speed : float, optional
        Units of physical time per second, in place of ``seconds``.
    parameters, options : mapping of str to float, optional
        Values of the problem's parameters, and free numbers of the methods.
    anyway, on_singular, algebra
        As for :func:`daebench.run`.
    title : str
        Title above the animation; a page has problem and case there by default, a .gif or .mp4 nothing.
    size : tuple of int, optional
        Width and height of a .gif or .mp4 in pixels, even numbers, for example 1920x1080; by default as the scenes need.
    overwrite : bool
        Whether files may be replaced that no animation wrote.
    progress : callable, optional
        Called with the fraction done and a label of the current task.
    **start : OwnStart
        A start of one's own in place of the case's: q0, p0, v0, y0 and project, as for :func:`daebench.initial_value_problem`.

    Raises
    ------
    BadInput
        If the request cannot be met; nothing was run then.

    Examples
    --------
    >>> import tempfile
    >>> import daebench
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     animation = daebench.animation(
    ...         "planar_pendulum", case="horizontal", methods=["rattle"], h=0.01, t_end=2, seconds=2, out=f"{folder}/swing.svg"
    ...     )
    ...     sorted(path.name for path in animation.paths)
    ['swing.frames.csv', 'swing.svg']
    """
    path = Path(out)
    form, length = _form(path, title, size, overwrite=overwrite), _seconds(positive("t_end", t_end), seconds, speed)
    ivp = initial_value_problem(problem, case, parameters, algebra=algebra, on_singular=on_singular, **start)
    layout = _layout(ivp)
    if not methods:
        raise BadInput("an animation needs at least one method, for example rattle.", "animation-without-method")
    chosen, rate = methods_of(ivp, methods, options, anyway=anyway), _rate(path, fps)
    frames = 1 + max(1, min(round(rate * length), form.most_frames(layout.at(ivp.start[-1][None]).shape[1], len(chosen), ERRORS) - 1))
    times = np.linspace(0.0, t_end, frames)
    values = [resolution_value(method, h=h if method.knob == "h" else None, tol=tol if method.knob == "tol" else None) for method in chosen]
    for method, value in zip(chosen, values, strict=True):
        method.check(ivp, requested(ivp, method, value, times))
    callback = progress or silent
    share = DRAWING if form.pixels else 1.0
    parts = [_part(callback, share * k / len(chosen), share / len(chosen), method.name) for k, method in enumerate(chosen)]
    runs = [recorded_run(ivp, method, value, times, part) for method, value, part in zip(chosen, values, parts, strict=True)]
    animated = AnimatedRuns(ivp.problem, ivp.case, dict(ivp.parameters), layout, runs, times, length, title, size)
    beside = _numbers(path)
    with writing(MAKER, overwrite=overwrite), described([path, beside], definition(ivp)):
        form.write(path, animated, _part(callback, share, 1 - share, f"drawing {path.name}"))
        save_table(beside, animated.table())
    return Animated((path, beside), tuple(run.failure for run in runs if run.failure))


def _rate(path: Path, fps: float) -> float:
    """Return the frames a second that a file can have, next to those that are asked for."""
    return film.gif_rate(_within("fps", fps)) if path.suffix.lower() == ".gif" else _within("fps", fps)


def _part(callback: Told, start: float, share: float, label: str) -> Progress:
    """Return a callback that reports the progress of a part of the work as that of the whole."""
    callback(start, label)
    return lambda fraction: callback(start + share * fraction, label)


def _numbers(path: Path) -> Path:
    """Return where the numbers of an animation go: not to FILE.csv, which may be a trajectory."""
    return path.with_suffix(".frames.csv")


def _form(path: Path, title: str, size: tuple[int, int] | None, *, overwrite: bool) -> Format:
    """Return the kind of a file; refuse one that cannot be written, cannot have this title or size, or is another's."""
    form = FORMATS.get(path.suffix.lower())
    if form is None:
        raise BadInput(
            f"--out {path}: the file must end in {', '.join(list(FORMATS)[:-1])} or {list(FORMATS)[-1]}.", "animation-file-ending"
        )
    if size is not None:
        _check_size(path, size, form)
    if title and path.suffix.lower() == ".svg":
        raise BadInput(f"--out {path}: a drawing has no title; leave out the title, or write .html, .gif or .mp4.", "drawing-has-no-title")
    if path.suffix.lower() == ".mp4":
        film.require_ffmpeg()
    with writing(MAKER, overwrite=overwrite):
        for target in (path, _numbers(path)):
            check_place(target)
            require_own(target)
    return form


def _check_size(path: Path, size: tuple[int, int], form: Format) -> None:
    """Refuse a size that a file cannot have."""
    if not form.pixels:
        raise BadInput(f"--out {path}: only a .gif or .mp4 has a size in pixels; leave it out.", "drawing-has-no-pixels")
    least, most = PIXELS
    if any(number % 2 or not least <= number <= most for number in size):
        raise BadInput(
            f"size = {size[0]}x{size[1]} must be two even numbers of pixels from {least} to {most}, for example 1920x1080.",
            "pixels-out-of-range",
        )


def _seconds(t_end: float, seconds: float | None, speed: float | None) -> float:
    """Return how long the animation lasts."""
    if seconds is not None and speed is not None:
        raise BadInput("seconds and speed both say how long the animation lasts; leave out one of them.", "seconds-beside-speed")
    if speed is not None:
        length, (least, most) = t_end / positive("speed", speed), LIMITS["seconds"]
        if not least <= length <= most:
            raise BadInput(
                f"speed = {speed:g} would show t = 0 to {t_end:g} in {length:.3g} s; between {least:g} and {most:g} s are possible.",
                "speed-out-of-range",
            )
        return length
    return _within("seconds", SECONDS if seconds is None else seconds)


def _within(name: str, value: float) -> float:
    """Return a number that is within its limits."""
    least, most = LIMITS[name]
    if not least <= positive(name, value) <= most:
        raise BadInput(f"{name} = {value:g} must be between {least:g} and {most:g}.", "animation-value-out-of-range")
    return float(value)


def _layout(ivp: Ivp) -> Layout:
    """Return the layout of an initial value problem; refuse one that declares no picture."""
    layout = layout_of(ivp)
    if layout is None:
        raise BadInput(
            f"{ivp.problem} declares no picture to animate; add picture=Picture(rods=..., masses=..., fixed=...) "
            f"with points in {ivp.state.position} to its definition, see daebench.Picture. All problems of daebench have one.",
            "problem-without-picture",
        )
    return layout
