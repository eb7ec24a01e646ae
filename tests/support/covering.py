"""Which schemes the gate sweeps over which problems: a covering design, of which the full product is for the day of a release.

Each scheme meets two problems of different structure, or the one it is for; each problem of the sweep that is not like another of it
meets two schemes; each claim is measured on all these pairs.
"""

PLAIN = ("spherical-fast", "two_bodies_on_sphere", "planar", "planar_pendulum", "spherical_pendulum")
"""Problems of which M is constant and both parts of H have exact flows."""

GENERAL = ("double_pendulum", "stretched-M", "torus", "slider_crank", "stretched-H", "relativistic")
"""Problems of other structure: several constraints, a mass matrix of q, an H that is no sum of two parts."""

TURNED = (*PLAIN[1:], PLAIN[0])
"""Those for schemes that take no others: the second problem of a scheme is another one than its first."""

QUADRATIC = GENERAL[:4]
SEPARABLE = GENERAL[:1]
ON_VELOCITIES = "knife_edge"
MANY_STAGES = 6
"""The order above which a scheme meets no two bodies: its stages, written out, take long to link."""

LARGE = {(scheme, place) for scheme in ("rattle", "gauss2") for place in ("andrews_squeezer", "butane")}
"""Pairs for problems of many unknowns, among the slow tests."""


def design(claims):
    """Return the pairs (scheme, problem) for the claims of schemes by name."""
    pairs = set(LARGE)
    for number, (scheme, said) in enumerate(claims.items()):
        if said.nonholonomic:
            pairs.add((scheme, ON_VELOCITIES))
            continue
        others = others_for(said)
        pairs |= {(scheme, PLAIN[number % len(PLAIN)]), (scheme, others[number % len(others)])}
        if said.any_form:
            pairs.add((scheme, ON_VELOCITIES))
    return pairs


def others_for(said):
    """Return the problems, unlike a pendulum where there are such, that a scheme with these claims takes."""
    if said.needs_kinetic_flow or said.constraints:
        return TURNED
    if said.separable_only:
        return SEPARABLE
    general = QUADRATIC if said.quadratic_only else GENERAL
    return general[1:] if said.order > MANY_STAGES else general
