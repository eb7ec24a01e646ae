"""Why a scheme stops, and what to do, by the status of its report."""

from daebench.schemes.kernels.branch import ANOTHER_BRANCH
from daebench.schemes.kernels.rank import RANK_LOST

TURNED = 10
"""Status where the equations of a step are singular although G keeps its rank."""

REDUNDANT = "see whether constraints are redundant, or G has lost rank or a chart is singular there"
"""Advice if an iteration matrix is singular."""

REASONS = {
    1: ("the iteration did not converge in {sweeps} iterations, residual {residual:.2e}", "use a smaller h"),
    2: (
        "the iteration matrix is singular to round-off, residual {residual:.2e}",
        REDUNDANT,
    ),
    3: (
        "a value is no longer finite",
        "use a smaller h, and see whether the motion has left the domain of H or that of the chart of local:",
    ),
    4: (
        "H or a monitored quantity is not finite after this step",
        "use a smaller h, and see whether the motion has left the domain of H or the range of double precision",
    ),
    5: (
        "the constraints did not reach the tolerance in {relaxations} rounds, residual {residual:.2e}",
        "use a smaller h or a larger tolerance",
    ),
    8: (
        "the derivatives of the states are no longer finite, or did not settle in {sweeps} sweeps",
        "use a shorter run, because derivatives of an unstable motion grow without bound, or leave out the sensitivities",
    ),
    ANOTHER_BRANCH: ("the step ends on another branch of g = 0 than the one on which the motion goes on from there", "use a smaller h"),
    TURNED: (
        "the iteration matrix is singular to round-off, residual {residual:.2e}",
        "G keeps its rank there, so the step is too large; use a smaller h",
    ),
}
"""Why a scheme stopped, and what to do, by the status of its report."""

ITS_OWN = "this is the limit of the iteration, which omits derivatives, and not necessarily of the equations"
"""Note on the limit of a simplified iteration."""

IN_SHORT = {
    1: "no convergence",
    2: "singular matrix",
    3: "not finite",
    4: "H not finite",
    5: "constraints not met",
    6: "left the domain",
    RANK_LOST: "G loses rank",
    8: "derivatives not finite",
    ANOTHER_BRANCH: "another branch",
    TURNED: "step too large",
}
"""The reason in two or three words, for tables and pictures of many runs."""

SIMPLIFIED = REASONS | {1: (REASONS[1][0], f"{REASONS[1][1]}; {ITS_OWN}")}
"""The reasons of a scheme whose iteration omits derivatives."""
