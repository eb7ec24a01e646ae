"""An animation as a GIF: every program shows it, in up to 256 colours."""

from pathlib import Path
from typing import Any

from daebench.pages.animation.animated_runs import AnimatedRuns
from daebench.pages.animation.raster import frames
from daebench.runs.files import atomic
from daebench.runs.request import Progress

TICKS = 100
"""Frames of a GIF last whole hundredths of a second, and at least two of them."""

MOST_FRAMES = 1500
"""Most frames of a GIF."""

COLORS = 128


def possible(fps: float) -> float:
    """Return the frames a second that a GIF can have, next to those that are asked for."""
    return TICKS / max(2, round(TICKS / fps))


def write(path: Path, animated: AnimatedRuns, progress: Progress) -> None:
    """Write an animation as a GIF that starts again at its end; all frames have the colours of the one in the middle."""
    from PIL import Image

    given = (Image.fromarray(frame) for frame in frames(animated))
    pictures: list[Any] = []
    for n, image in enumerate(given):
        if not pictures:
            palette = image.quantize(COLORS)
        pictures.append(image.quantize(palette=palette, dither=Image.Dither.NONE))
        progress((n + 1) / len(animated.times))
    first, *rest = pictures
    with atomic(path) as scratch:
        first.save(scratch, format="GIF", save_all=True, append_images=rest, duration=round(1000 / animated.fps), loop=0)
