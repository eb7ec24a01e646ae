"""What became of a run, in one word: what the colours of an outcome map stand for."""

from daebench.diagnostics.manifold import residual_scales
from daebench.scene import PoissonScene
from daebench.stepping import REASONS
from daebench.studies.cell import Cell
from daebench.studies.measure import Row

FINE, DRIFTING, OFF = "fine", "drifting", "off the manifold"
NO_SOLUTION, SINGULAR, RANK_LOST, BLOWN_UP, STOPPED = "no solution", "singular", "rank lost", "blown up", "stopped"

OUTCOMES = {
    FINE: "it came to its end, on the manifold, and its energy error is bounded",
    DRIFTING: "its energy error grows",
    OFF: "it left the manifold by more than a thousandth of what a change of all positions by one part would do",
    NO_SOLUTION: "the equations of a step have no solution that Newton's iteration finds",
    SINGULAR: "their matrix is singular",
    RANK_LOST: "G loses rank on its way",
    BLOWN_UP: "a number is no longer finite",
    STOPPED: "it was stopped by something else, as a solver that gives up",
}
"""What became of a run, from the best to the worst, and what that says."""

FAR = 1e-3
"""Relative residual of constraints from which on a state is off the manifold."""

TOLD = {
    "G loses rank": RANK_LOST,
    **{REASONS[status][0].split(" in {")[0].split(", residual")[0]: NO_SOLUTION for status in (1, 5)},
    REASONS[2][0].split(", residual")[0]: SINGULAR,
    **{REASONS[status][0]: BLOWN_UP for status in (3, 4)},
}
"""What the sentence of a failure begins its reason with, and the word for it."""


def outcome_of(cell: Cell, row: Row) -> str:
    """Return which of :data:`OUTCOMES` a row with the metrics "energy" and, on a constrained problem, "manifold" tells of."""
    if row["failure"]:
        return next((word for text, word in TOLD.items() if text in row["failure"]), STOPPED)
    scene = cell.scene
    if not isinstance(scene, PoissonScene):
        scale = residual_scales(scene, scene.p0, scene.q0)[0]
        if not row["g"] <= FAR * (scale or 1.0):
            return OFF
    return DRIFTING if row["energy_kind"] in ("linear", "growing") else FINE
