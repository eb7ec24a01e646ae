"""Symmetric compositions of a symmetric step of order 2, HLW (V.3.2).

The step Phi_h is repeated with step sizes gamma_i h that raise the order::

    Psi_h = Phi_{gamma_s h} ∘ ... ∘ Phi_{gamma_1 h},     gamma_{s+1-i} = gamma_i,     gamma_1 + ... + gamma_s = 1

The number of stages s is odd, and the middle weight is computed: it is 1 minus the others.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal, localcontext


@dataclass(frozen=True, kw_only=True)
class Composition:
    """A symmetric composition: its order, and the weights gamma_1 ... gamma_{(s-1)/2} before the middle one."""

    name: str
    """Its name as a suffix of a method, for example "kahan_li8"."""
    order: int
    """Order of the composed step."""
    source: str
    """Source of the weights."""
    gamma: tuple[str, ...]
    """The weights before the middle one as decimal numbers: closed forms to 50 digits, published numbers as published. The latter satisfy
    the order conditions to 1e-24.
    """

    @property
    def stages(self) -> int:
        """Number of substeps s."""
        return 2 * len(self.gamma) + 1

    @property
    def weights(self) -> tuple[float, ...]:
        """All weights gamma_1 ... gamma_s, shape(s,).

        The middle one is 1 minus the *rounded* others, itself rounded once: no floating-point number in its place brings the sum
        nearer to 1, so that n composed steps of h end at n h.
        """
        half = [float(gamma) for gamma in self.gamma]
        middle = math.fsum([1.0, *(-gamma for gamma in half + half)])
        return (*half, middle, *reversed(half))


def _equal_steps(before: int) -> tuple[str, ...]:
    """Return the weights of order 4 that are all equal but the middle one: sum gamma_i^3 = 0, to 50 digits."""
    with localcontext(prec=50):
        n = Decimal(2 * before)
        # n weights gamma and the middle one 1 - n gamma: the cubes vanish where n gamma^3 = (n gamma - 1)^3.
        return (str(1 / (n - n ** (1 / Decimal(3)))),) * before


_ALL = (
    Composition(
        name="triple_jump4",
        order=4,
        source="Creutz & Gocksch (1989), Forest (1989), Suzuki (1990), Yoshida (1990); HLW Example II.4.2",
        gamma=_equal_steps(1),
    ),
    Composition(name="suzuki4", order=4, source="Suzuki (1990), 5 stages; HLW Example II.4.3", gamma=_equal_steps(2)),
    Composition(
        name="yoshida6",
        order=6,
        source="Yoshida (1990), solution A, 7 stages; HLW (V.3.11)",
        gamma=("0.78451361047755726381949763", "0.23557321335935813368479318", "-1.17767998417887100694641568"),
    ),
    Composition(
        name="kahan_li6",
        order=6,
        source="Kahan & Li (1997), 9 stages; HLW (V.3.12)",
        gamma=(
            "0.39216144400731413927925056",
            "0.33259913678935943859974864",
            "-0.70624617255763935980996482",
            "0.08221359629355080023149045",
        ),
    ),
    Composition(
        name="suzuki_umeno8",
        order=8,
        source="Suzuki & Umeno (1993), 15 stages; HLW (V.3.13)",
        gamma=(
            "0.74167036435061295344822780",
            "-0.40910082580003159399730010",
            "0.19075471029623837995387626",
            "-0.57386247111608226665638773",
            "0.29906418130365592384446354",
            "0.33462491824529818378495798",
            "0.31529309239676659663205666",
        ),
    ),
    Composition(
        name="kahan_li8",
        order=8,
        source="Kahan & Li (1997), 17 stages; HLW (V.3.14)",
        gamma=(
            "0.13020248308889008087881763",
            "0.56116298177510838456196441",
            "-0.38947496264484728640807860",
            "0.15884190655515560089621075",
            "-0.39590389413323757733623154",
            "0.18453964097831570709183254",
            "0.25837438768632204729397911",
            "0.29501172360931029887096624",
        ),
    ),
    Composition(
        name="sofroniou_spaletta10",
        order=10,
        source="Sofroniou & Spaletta (2005), 35 stages; HLW V.3.2, p. 158",
        gamma=(
            "0.07879572252168641926390768",
            "0.31309610341510852776481247",
            "0.02791838323507806610952027",
            "-0.22959284159390709415121340",
            "0.13096206107716486317465686",
            "-0.26973340565451071434460973",
            "0.07497334315589143566613711",
            "0.11199342399981020488957508",
            "0.36613344954622675119314812",
            "-0.39910563013603589787862981",
            "0.10308739852747107731580277",
            "0.41143087395589023782070412",
            "-0.00486636058313526176219566",
            "-0.39203335370863990644808194",
            "0.05194250296244964703718290",
            "0.05066509075992449633587434",
            "0.04967437063972987905456880",
        ),
    ),
)

COMPOSITIONS: Mapping[str, Composition] = {composition.name: composition for composition in _ALL}
"""Every composition by its name, by order and then by number of stages."""


def weights_of(name: str) -> tuple[float, ...]:
    """Return the weights of a composition's substeps; none for the name "", where a step is one step."""
    return COMPOSITIONS[name].weights if name else ()
