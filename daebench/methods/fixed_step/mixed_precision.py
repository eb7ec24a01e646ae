"""Requirements of mixed precision: forces in single precision, and everything else in double precision."""

from typing import TYPE_CHECKING, Any

from daebench.compiler.constrained.representation import WRITTEN_OUT
from daebench.errors import BadInput
from daebench.runs.ivp import ConstrainedIvp

if TYPE_CHECKING:
    from daebench.methods.fixed_step.base import FixedStepMethod

MIXED = "mixed"


def require_mixed(method: "FixedStepMethod[Any, Any]", ivp: ConstrainedIvp) -> None:
    """Refuse to compute in mixed precision where forces are not a function U_q(q), or their rounding would enter an iteration.

    The increments of an iteration do not become smaller than the rounding of the functions that it evaluates. With forces in single
    precision it therefore does not converge in double precision.
    """
    if why := _obstacle(method, ivp):
        raise BadInput(f"{method.name} on {ivp.problem} cannot compute in mixed precision: {why}; use float64 or float32.")


def _obstacle(method: "FixedStepMethod[Any, Any]", ivp: ConstrainedIvp) -> str:
    """Return why forces cannot be computed in single precision alone, or ""."""
    if ivp.facts.EXTENDED or ivp.facts.FORCED:
        return "it needs a system without forces that depend on time or velocity"
    if not ivp.facts.SEPARABLE:
        return "it needs H = 1/2 p^T M^-1 p + U(q) with constant M"
    if ivp.arrays or int(ivp.facts.D) > WRITTEN_OUT:
        return "its forces are computed in loops, of which there are none in single precision"
    if method.form:
        return f"forces are not computed apart in the form {method.form}"
    if "H_q" in method.iterated(ivp):
        return "the scheme evaluates forces in an iteration, which does not converge beyond single precision"
    return ""
