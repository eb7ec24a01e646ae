"""Cyclohexane, the rigid chair, in a harmonic well that holds its first atom."""

from daebench.problems import cyclohexane_ring
from daebench.reports.molecules.well import in_a_well
from daebench.systems.constrained import ConstrainedHamiltonian


def problem(*, stiffness: float = 20.0) -> ConstrainedHamiltonian:
    """Return the ring of the catalogue, case "chair", in a well.

    Parameters
    ----------
    stiffness : float
        Stiffness of the well, kJ/mol/Angstrom^2.
    """
    return in_a_well(cyclohexane_ring.problem(), "chair", stiffness)
