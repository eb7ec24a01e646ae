"""An experiment: controls, and the result for their values."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from markupsafe import Markup

from daebench.pages.lesson.control import Control, Values

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Shown:
    """The result for one setting of the controls.

    Parameters
    ----------
    picture : Markup
        Drawings, as SVG.
    says : Markup
        The measured results, in sentences, as HTML.
    """

    picture: Markup
    says: Markup


@dataclass(frozen=True)
class Experiment:
    """Something that a lesson lets one try.

    Parameters
    ----------
    name : str
        Its name in files and links.
    title : str
        Description for readers who cannot see the picture.
    controls : sequence of Control
        The controls.
    show : callable
        Maps values of all controls by name to the result, within 200 ms once the lesson is prepared.
    table : callable
        Takes the same values to the numbers behind the picture.
    """

    name: str
    title: str
    controls: Sequence[Control]
    show: Callable[[Values], Shown]
    table: Callable[[Values], "pd.DataFrame"]


Preparation = tuple[str, Callable[[], object]]
"""What is done before the controls answer at once: what it is, as text, and what does it."""
