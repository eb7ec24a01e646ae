"""An animation as a video: H.264 in an MP4 file, by ffmpeg."""

from importlib.util import find_spec
from pathlib import Path

from daebench.errors import BadInput
from daebench.pages.animation.animated_runs import AnimatedRuns
from daebench.pages.animation.raster import frames
from daebench.runs.files import atomic
from daebench.runs.request import Progress

MOST_FRAMES = 20_000
"""Most frames of a video."""


def require() -> None:
    """Raise :class:`BadInput` if ffmpeg is not available."""
    if find_spec("imageio_ffmpeg") is None:
        raise BadInput("a video .mp4 needs the package imageio-ffmpeg; install daebench[video], or ask for .gif, .svg or .html.")


def write(path: Path, animated: AnimatedRuns, progress: Progress) -> None:
    """Write an animation as a video."""
    import imageio_ffmpeg

    pictures = frames(animated)
    first = next(pictures)
    height, width, _ = first.shape
    with atomic(path) as scratch:
        # By default pictures are scaled to multiples of 16 pixels. The index comes first, so that a browser plays before it has all.
        film = imageio_ffmpeg.write_frames(
            str(scratch), (width, height), fps=animated.fps, codec="libx264", macro_block_size=2, output_params=["-movflags", "+faststart"]
        )
        film.send(None)  # a generator takes frames once it has been started
        film.send(first.tobytes())
        for n, frame in enumerate(pictures, start=2):
            film.send(frame.tobytes())
            progress(n / len(animated.times))
        film.close()
