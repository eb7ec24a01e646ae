"""Long runs to their ends, and the bits of their statistics."""

import numpy as np

from daebench.studies.long import run
from daebench.studies.long.checkpoint import identity, load, resumed, save
from daebench.studies.long.run import Stream


def finished(stream):
    """Return a stream after its last step."""
    while stream.going:
        stream.advance()
    return stream


def marched(spec, steps):
    """Return the stream of a long run by itself after so many steps."""
    return finished(Stream(spec, steps))


def bits(windows, blocks, waiting):
    """Return all of the statistics of a run and of the samples that are in none of them yet, to the bit."""
    numbers = windows.table, blocks.means, np.float64(blocks.total), np.ascontiguousarray(waiting)
    return [each.tobytes() for each in numbers], blocks.length, blocks.pieces


def bits_of_stream(stream):
    """Return the bits of a run that is by itself."""
    return bits(stream.windows, stream.blocks, stream.run.state_rows[: stream.run.row, 0])


def bits_of_checkpoint(kept):
    """Return the bits of a run that is kept."""
    return bits(kept.windows, kept.blocks, kept.waiting)


def everything(stream):
    """Return all numbers of a run that is by itself, to the bit."""
    return stream.numbers().tobytes(), stream.run.done, stream.run.left, bits_of_stream(stream)


def require_going_on(spec, steps, monkeypatch, random, file):
    """Require that a run that is left after random pieces, several times, and taken up again from a file ends with the same bits."""
    whole = marched(spec, steps)
    assert (whole.run.failure, whole.run.done) == (None, steps)
    assert whole.windows.samples + whole.run.row == steps // spec.stride
    monkeypatch.setattr(run, "next_piece", lambda *_: int(random.integers(1, 60)))
    stream, left = Stream(spec, steps), 0
    while stream.going:
        stream.advance()
        if random.random() < 0.3:
            save(file, identity(spec), stream)
            stream, left = taken_up(spec, steps, file), left + 1
    assert left > 3
    assert everything(stream) == everything(whole)


def taken_up(spec, steps, file):
    """Return the stream of a run as it was left in a file."""
    stream = Stream(spec, steps)
    resumed(stream, load(file, identity(spec)))
    return stream
