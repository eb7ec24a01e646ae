"""Butane, rigid but for its torsion, in a harmonic well that holds its first atom."""

from daebench.problems import butane
from daebench.reports.molecules.well import in_a_well
from daebench.systems.constrained import ConstrainedHamiltonian


def problem(*, stiffness: float = 20.0) -> ConstrainedHamiltonian:
    """Return butane of the catalogue, case "tumbling", in a well.

    Parameters
    ----------
    stiffness : float
        Stiffness of the well, kJ/mol/Angstrom^2.
    """
    return in_a_well(butane.problem(), "tumbling", stiffness)
