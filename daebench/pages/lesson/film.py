"""Pictures drawn beforehand, one for each setting of a few controls, and the inputs that choose among them."""

import itertools
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import Any

from markupsafe import Markup

Values = Mapping[str, Any]
"""Values of controls by name."""


@dataclass(frozen=True)
class Control:
    """A choice among values: a slider of numbers, or a list of names."""

    name: str
    """Its name."""
    label: str
    """Its label, with the unit, as plain text."""
    values: Mapping[Any, str]
    """Its possible values in order, as they are written."""
    default: Any
    """Its initial value."""

    @property
    def is_slider(self) -> bool:
        """Whether its values are numbers."""
        return all(type(value) is float for value in self.values)


@dataclass(frozen=True)
class Shown:
    """The result for one setting of the controls: drawings as SVG, and what was measured, in sentences, as HTML."""

    picture: Markup
    says: Markup


def defaults(controls: Sequence[Control]) -> dict[str, Any]:
    """Return the values that controls have at first, by name."""
    return {control.name: control.default for control in controls}


def style() -> str:
    """Return the style of films and of the panels in them."""
    sheets = [resources.files("daebench.draw.svg") / "panels.css", resources.files("daebench.pages.lesson") / "film.css"]
    return "\n".join(sheet.read_text(encoding="utf-8") for sheet in sheets)


def film(name: str, title: str, controls: Sequence[Control], show: Callable[[Values], Shown], tell: Callable[[float, str], None]) -> Markup:
    """Return controls as HTML, and a frame for each setting of them; ``NAME.csv`` beside the page has the numbers."""
    settings = list(itertools.product(*(control.values for control in controls)))
    names = [control.name for control in controls]
    frames = []
    for k, setting in enumerate(settings):
        frames.append(_frame(controls, setting, show(dict(zip(names, setting, strict=True)))))
        tell((k + 1) / len(settings), "pictures")
    now = show(defaults(controls))
    return Markup(
        '<figure class="film" id="film-{}"><div class="controls" hidden>{}</div><p class="says" aria-live="polite">{}</p>'
        '<div class="drawing" role="group" aria-label="{}">{}</div>{}<figcaption><span class="files"><a href="{}.csv">CSV</a></span>'
        "</figcaption></figure>"
    ).format(name, Markup("").join(map(_input, controls)), now.says, title, now.picture, Markup("").join(frames), name)


def _frame(controls: Sequence[Control], setting: Sequence[Any], shown: Shown) -> Markup:
    """Return a frame that is hidden until it is chosen."""
    places = [list(control.values).index(value) for control, value in zip(controls, setting, strict=True)]
    return Markup('<template data-frame="{}"><p class="says">{}</p><div class="drawing">{}</div></template>').format(
        "-".join(map(str, places)), shown.says, shown.picture
    )


def _input(control: Control) -> Markup:
    """Return the input of a control: its value is the place of the control's value."""
    texts, now = list(control.values.values()), list(control.values).index(control.default)
    if control.is_slider:
        return Markup(
            '<label>{}<input type="range" min="0" max="{}" step="1" value="{}" data-control="{}" data-texts="{}" aria-valuetext="{}">'
            "<output>{}</output></label>"
        ).format(control.label, len(texts) - 1, now, control.name, json.dumps(texts), texts[now], texts[now])
    template = Markup('<label><input type="radio" name="{}" value="{}"{}>{}</label>')
    inputs = (template.format(control.name, k, Markup(" checked") if k == now else "", text) for k, text in enumerate(texts))
    return Markup('<fieldset data-control="{}"><legend>{}</legend>{}</fieldset>').format(
        control.name, control.label, Markup("").join(inputs)
    )
