"""Appearance and name of a method: the same stroke and the same name in every picture."""

import re
from collections.abc import Iterable
from dataclasses import replace
from itertools import product
from typing import Any
from zlib import crc32

from daebench.draw.figures import BLACK, BLUE, BROWN, GREEN, INDIGO, OLIVE, ORANGE, PURPLE, SKY, VERMILION, Stroke

SOLID, DASHED, DOTTED, MIXED, LONG = "-", (0, (6, 1.5)), (0, (1, 1)), (0, (4, 1.5, 1, 1.5)), (0, (8, 2))

STROKES_OF = {
    "rattle": Stroke(BLUE, SOLID, "^"),
    "rattle_gauss_seidel": Stroke(BLUE, DOTTED, "1"),
    "rattle_ilves": Stroke(BLUE, LONG, "3"),
    "rattle_lincs": Stroke(SKY, MIXED, "4"),
    "rattle_settle": Stroke(SKY, SOLID, "X"),
    "boris": Stroke(BROWN, LONG, "x"),
    "rattle_conformal": Stroke(BLUE, MIXED, "2"),
    "shake": Stroke(OLIVE, DASHED, "P"),
    "symplectic_euler": Stroke(SKY, DOTTED, "v"),
    "symplectic_euler_adjoint": Stroke(SKY, LONG, "<"),
    "verlet": Stroke(BLUE, DASHED, ">"),
    "lobatto2": Stroke(GREEN, DOTTED, "1"),
    "lobatto3": Stroke(GREEN, SOLID, "p"),
    "lobatto4": Stroke(GREEN, DASHED, "h"),
    "lobatto5": Stroke(GREEN, MIXED, "8"),
    "lobatto6": Stroke(GREEN, LONG, "*"),
    "strang": Stroke(BROWN, SOLID, "d"),
    "lie": Stroke(BROWN, DOTTED, "3"),
    "lie_adjoint": Stroke(BROWN, MIXED, "4"),
    "rk4": Stroke(VERMILION, SOLID, "o"),
    "se": Stroke(ORANGE, SOLID, "s"),
    "seproj": Stroke(ORANGE, DASHED, "D"),
    "implicit_euler": Stroke(PURPLE, MIXED, "D"),
    "explicit_euler": Stroke(OLIVE, DOTTED, "x"),
    "midpoint": Stroke(PURPLE, SOLID, "s"),
    "gauss2": Stroke(PURPLE, DOTTED, "h"),
    "stiff:gauss2": Stroke(PURPLE, LONG, "h"),
    "gauss3": Stroke(PURPLE, DASHED, "p"),
    "gauss4": Stroke(PURPLE, LONG, "8"),
    "radau2_ggl": Stroke(INDIGO, DOTTED, "v"),
    "radau3_ggl": Stroke(INDIGO, SOLID, "v"),
    "radau2_index2": Stroke(INDIGO, MIXED, "^"),
    "radau3_index2": Stroke(INDIGO, DASHED, "^"),
    "generalized_alpha": Stroke(BLACK, LONG, "X"),
    "energy_momentum": Stroke(OLIVE, MIXED, "X"),
    "livens": Stroke(OLIVE, LONG, "P"),
    "ggl_vi": Stroke(BLACK, DASHED, "1"),
    "ggl_vi_mod": Stroke(BLACK, MIXED, "2"),
    "dla": Stroke(BLUE, DASHED, "h"),
    "gni": Stroke(ORANGE, MIXED, "^"),
    "nonholonomic_leapfrog": Stroke(VERMILION, DOTTED, "p"),
    "nonholonomic_newmark": Stroke(BLACK, SOLID, "<"),
    "nonholonomic_newmark_pair": Stroke(BLACK, DOTTED, "d"),
    "spark_lobatto2": Stroke(OLIVE, DOTTED, "1"),
    "spark_lobatto3": Stroke(OLIVE, SOLID, "p"),
    "spark_lobatto4": Stroke(OLIVE, DASHED, "h"),
    "ida:index3": Stroke(VERMILION, DASHED, "D"),
    "ida:index2": Stroke(BLUE, DASHED, "^"),
    "ida:index1": Stroke(ORANGE, DASHED, "s"),
    "ida:ggl": Stroke(GREEN, MIXED, "P"),
    "ida:baumgarte": Stroke(PURPLE, DOTTED, "v"),
    "ida:ode": Stroke(BLACK, DOTTED, "v"),
    "ida:casimirs": Stroke(OLIVE, LONG, "h"),
    "cvode": Stroke(SKY, DASHED, "<"),
    "cvode:bdf": Stroke(SKY, MIXED, ">"),
    "cvode:bdf:projected": Stroke(SKY, SOLID, "d"),
    "scipy": Stroke(PURPLE, DASHED, "D"),
    "scipy:RK45": Stroke(PURPLE, MIXED, "<"),
    "scipy:RK23": Stroke(PURPLE, DOTTED, ">"),
    "scipy:Radau": Stroke(INDIGO, MIXED, "D"),
    "scipy:BDF": Stroke(INDIGO, DOTTED, "s"),
    "scipy:LSODA": Stroke(BROWN, DASHED, "s"),
    "heyoka": Stroke(BLACK, SOLID, "*"),
    "solve_dae": Stroke(INDIGO, LONG, "<"),
}
"""Colour, dashes and marker by the name of a method, or of its solver; a composition, a projection or a form is drawn like its scheme."""

MARKS: dict[str, tuple[Any, str]] = {
    "triple_jump4": (SOLID, "v"),
    "suzuki4": (MIXED, "h"),
    "yoshida6": (DASHED, "<"),
    "kahan_li6": (DASHED, "X"),
    "suzuki_umeno8": (DOTTED, "d"),
    "kahan_li8": (LONG, "*"),
    "sofroniou_spaletta10": (DOTTED, "p"),
    "proj": (DASHED, "d"),
    "symproj": (MIXED, "D"),
    "local": (LONG, "<"),
    "canonical": (MIXED, "^"),
    "stiff": (DOTTED, "P"),
    "baumgarte": (DOTTED, ">"),
    "darboux": (LONG, "v"),
}
"""Dashes and marker of a composition, a projection or a form of the equations, in the colour of its scheme."""

OTHER = Stroke(BROWN, MIXED, "h")
"""Stroke of a method that is not listed here, such as an external code."""

MARKERS = "hvpXdP<>"
"""Markers of the user's own codes, chosen by name; in one picture they also differ in colour, see :func:`strokes_of`."""

COLORS = (BROWN, OLIVE, INDIGO, SKY, ORANGE, PURPLE, GREEN, VERMILION, BLUE, BLACK)
"""Colours of the user's own codes, in the order of use."""

NAMES = {
    "rattle": "RATTLE",
    "rattle_gauss_seidel": "RATTLE, Gauss-Seidel",
    "rattle_ilves": "RATTLE, ILVES",
    "rattle_lincs": "RATTLE, LINCS",
    "rattle_settle": "RATTLE, SETTLE",
    "boris": "Boris",
    "rattle_conformal": "RATTLE, conformal",
    "shake": "SHAKE",
    "symplectic_euler": "symplectic Euler",
    "symplectic_euler_adjoint": "symplectic Euler, adjoint",
    "verlet": "Störmer-Verlet",
    "strang": "Strang",
    "lie": "Lie-Trotter",
    "lie_adjoint": "Lie-Trotter, adjoint",
    "rk4": "RK4",
    "se": "se, reduced equations",
    "seproj": "seproj, reduced equations",
    "implicit_euler": "implicit Euler",
    "explicit_euler": "explicit Euler",
    "midpoint": "implicit midpoint",
    "generalized_alpha": "generalized-alpha",
    "energy_momentum": "energy-momentum",
    "livens": "Livens",
    "ggl_vi": "GGL-VI",
    "ggl_vi_mod": "GGL-VI, modified",
    "dla": "discrete Lagrange-d'Alembert",
    "gni": "GNI",
    "nonholonomic_leapfrog": "nonholonomic leapfrog",
    "nonholonomic_newmark": "nonholonomic Newmark",
    "nonholonomic_newmark_pair": "nonholonomic Newmark and adjoint",
    "spark_lobatto2": "SPARK Lobatto 2",
    "spark_lobatto3": "SPARK Lobatto 3",
    "spark_lobatto4": "SPARK Lobatto 4",
    "heyoka:taylor": "Taylor (heyoka)",
    "cvode:adams": "CVODE Adams",
    "cvode:bdf": "CVODE BDF",
    "cvode:bdf:projected": "CVODE BDF, projected",
    "solve_dae:Radau": "Radau (solve_dae)",
    "ida:ggl": "IDA GGL",
    "ida:baumgarte": "IDA Baumgarte",
    "ida:ode": "IDA ODE",
    "ida:casimirs": "IDA, Casimirs imposed",
}
"""Names that do not follow a rule."""

PARTS = {"suzuki4": "Suzuki 4", "kahan_li8": "Kahan-Li 8", "proj": "projected", "symproj": "symmetrically projected"}
PARTS |= {"local": "local coordinates", "canonical": "canonical coordinates"}
PARTS |= {"stiff": "stiff form", "baumgarte": "Baumgarte", "darboux": "Darboux"}
RULES = (
    (r"lobatto(\d+)", r"Lobatto \1"),
    (r"gauss(\d+)", r"Gauss \1"),
    (r"radau(\d+)_ggl", r"Radau \1, GGL"),
    (r"radau(\d+)_index2", r"Radau \1, index 2"),
    (r"ida:index(\d)", r"IDA index \1"),
    (r"scipy:(\w+)", r"\1 (SciPy)"),
)
"""Names of families."""

PARSED = re.compile(
    r"(?:(?P<form>local|canonical|stiff|baumgarte|darboux):)?(?P<scheme>[^/+]+)(?:/(?P<composition>[^+]+))?(?:\+(?P<projection>.+))?"
)


def name_of(method: str) -> str:
    """Return the name of a method in pictures and sentences.

    Examples
    --------
    >>> name_of("rattle/suzuki4"), name_of("local:gauss3"), name_of("ida:index2")
    ('RATTLE, Suzuki 4', 'Gauss 3, local coordinates', 'IDA index 2')
    """
    parts = _parts(method)
    if parts is None:
        return method
    scheme = _scheme(parts["scheme"])
    return ", ".join([scheme, *(PARTS.get(parts[key], parts[key]) for key in ("composition", "projection", "form") if parts[key])])


def _scheme(scheme: str) -> str:
    """Return the name of a scheme or solver without its additions."""
    if scheme in NAMES:
        return NAMES[scheme]
    for pattern, words in RULES:
        if re.fullmatch(pattern, scheme):
            return re.sub(pattern, words, scheme)
    return scheme.replace("_", " ")


def _parts(method: str) -> dict[str, str] | None:
    """Return form, scheme, composition and projection of a name; None for an external code."""
    if method.startswith((".", "/", "exec:")):
        return None
    match = PARSED.fullmatch(method)
    return {key: value or "" for key, value in match.groupdict().items()} if match else None


def stroke_of(method: str) -> Stroke:
    """Return the stroke of a method in every picture: its scheme's colour, with its own dashes and marker.

    Examples
    --------
    >>> stroke_of("rattle").color == stroke_of("rattle/suzuki4").color, stroke_of("rattle") == stroke_of("rattle/suzuki4")
    (True, False)
    """
    if method in STROKES_OF:
        return STROKES_OF[method]
    parts = _parts(method)
    if parts is None:
        # A checksum, because Python's hash of a text differs from process to process.
        return replace(OTHER, marker=MARKERS[crc32(method.encode()) % len(MARKERS)])
    scheme = parts["scheme"]
    stroke = STROKES_OF.get(scheme) or STROKES_OF.get(scheme.partition(":")[0], OTHER)
    added = parts["composition"] or parts["projection"] or parts["form"]
    dashes, marker = MARKS.get(added, (stroke.dashes, stroke.marker))
    return replace(stroke, dashes=dashes, marker=marker)


def strokes_of(methods: Iterable[str]) -> dict[str, Stroke]:
    """Return the strokes of the methods of one picture: those of :func:`stroke_of`, but a colour of its own for each that is not listed.

    The user's own codes take the colours that no other curve of the picture has, as long as there are some, and then combinations of colour
    and marker that no other curve has. Their colours depend on the picture.

    Examples
    --------
    >>> strokes = strokes_of(["rattle", "./a.py:step", "./b.py:step"])
    >>> strokes["rattle"] == stroke_of("rattle"), len({stroke.color for stroke in strokes.values()})
    (True, 3)
    """
    strokes = {method: stroke_of(method) for method in methods}
    listed = [stroke for method, stroke in strokes.items() if not _is_other(method)]
    colors, pairs = [stroke.color for stroke in listed], {(stroke.color, stroke.marker) for stroke in listed}
    for method in filter(_is_other, strokes):
        stroke = strokes[method]
        # The colour that is used least, and of equals the first in order.
        color = min(COLORS, key=colors.count)
        marker = next((x for x in (stroke.marker, *MARKERS) if (color, x) not in pairs), None)
        if marker is None:
            color, marker = next((pair for pair in product(COLORS, MARKERS) if pair not in pairs), (color, stroke.marker))
        strokes[method] = replace(stroke, color=color, marker=marker)
        colors.append(color)
        pairs.add((color, marker))
    return strokes


def _is_other(method: str) -> bool:
    """Return whether no stroke is listed for a method, or for its scheme or solver."""
    parts = _parts(method)
    scheme = parts["scheme"] if parts else ""
    return not {method, scheme, scheme.partition(":")[0]} & {*STROKES_OF}


def short_name_of(method: str, most: int = 30) -> str:
    """Return the name of a method; of a long path to a code, only its end, with ``most`` letters in all.

    Examples
    --------
    >>> short_name_of("rattle"), short_name_of("./folder/of/a/group/integrator.py:step", 24)
    ('RATTLE', '...up/integrator.py:step')
    """
    name = name_of(method)
    return name if len(name) <= most or _parts(method) else f"...{name[3 - most :]}"


def curve_of(method: str) -> dict[str, object]:
    """Return keyword arguments of Matplotlib's ``plot`` for the curve of a method with markers."""
    return stroke_of(method).points() | {"label": name_of(method)}
