"""The end of a run that cannot go on."""


class Stopped(Exception):
    """The run cannot go on; the text says why, ``t`` where, and ``advice`` what to do."""

    def __init__(self, why: str, t: float | None = None, advice: str | None = None) -> None:
        super().__init__(why)
        self.t, self.advice = t, advice
