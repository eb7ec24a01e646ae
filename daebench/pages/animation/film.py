"""An animation as a film: a GIF, which every program shows, in up to 256 colours; or a video, H.264 in an MP4 file, by ffmpeg."""

from importlib.util import find_spec
from pathlib import Path
from typing import Any

from daebench.errors import BadInput
from daebench.pages.animation.animated_runs import AnimatedRuns
from daebench.pages.animation.raster import frames
from daebench.runs.files import atomic
from daebench.runs.request import Progress

TICKS = 100
"""Frames of a GIF last whole hundredths of a second, and at least two of them."""

MOST_GIF_FRAMES, MOST_VIDEO_FRAMES = 1500, 20_000
"""Most frames of a GIF, and of a video."""

COLORS = 128


def gif_rate(fps: float) -> float:
    """Return the frames a second that a GIF can have, next to those that are asked for."""
    return TICKS / max(2, round(TICKS / fps))


def write_gif(path: Path, animated: AnimatedRuns, progress: Progress) -> None:
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


def require_ffmpeg() -> None:
    """Raise :class:`BadInput` if ffmpeg is not available."""
    if find_spec("imageio_ffmpeg") is None:
        raise BadInput(
            "a video .mp4 needs the package imageio-ffmpeg; install daebench[video], or ask for .gif, .svg or .html.", "video-needs-ffmpeg"
        )


def write_video(path: Path, animated: AnimatedRuns, progress: Progress) -> None:
    """Write an animation as a video."""
    import imageio_ffmpeg

    pictures = frames(animated)
    first = next(pictures)
    height, width, _ = first.shape
    with atomic(path) as scratch:
        # By default pictures are scaled to multiples of 16 pixels. The index comes first, so that a browser plays before it has all.
        video = imageio_ffmpeg.write_frames(
            str(scratch), (width, height), fps=animated.fps, codec="libx264", macro_block_size=2, output_params=["-movflags", "+faststart"]
        )
        video.send(None)  # a generator takes frames once it has been started
        video.send(first.tobytes())
        for n, frame in enumerate(pictures, start=2):
            video.send(frame.tobytes())
            progress(n / len(animated.times))
        video.close()
