"""An experiment in a static page: pictures drawn beforehand for the values that it offers, and inputs that show one or the other."""

import itertools
from collections.abc import Callable, Sequence
from typing import Any

from markupsafe import Markup

from daebench.pages.lesson.control import Control, defaults
from daebench.pages.lesson.experiment import Experiment, Shown

SCRIPT = """
for (const film of document.querySelectorAll(".film")) {
  const knobs = [...film.querySelectorAll("[data-knob]")];
  const chosen = (knob) => knob.type === "range" ? knob.value : knob.querySelector("input:checked").value;
  const show = () => {
    for (const knob of knobs) if (knob.type === "range") {
      const text = JSON.parse(knob.dataset.texts)[knob.value];
      knob.setAttribute("aria-valuetext", text);
      knob.parentElement.querySelector("output").textContent = text;
    }
    const frame = film.querySelector(`template[data-frame="${knobs.map(chosen).join("-")}"]`).content.cloneNode(true);
    for (const part of ["says", "drawing"]) film.querySelector("." + part).replaceChildren(...frame.querySelector("." + part).childNodes);
  };
  film.querySelector(".knobs").hidden = false;
  film.addEventListener("input", show);
  show();
}
"""
"""Script that shows the frame chosen by the inputs of each experiment of a page."""


def static_experiment(experiment: Experiment, tell: Callable[[float], None]) -> Markup:
    """Return an experiment as HTML that needs no server: controls, and a frame for each combination of the values that they offer.

    Parameters
    ----------
    experiment : Experiment
        What is shown.
    tell : callable
        Called with the fraction of the frames that are drawn.
    """
    controls = [control for control in experiment.controls if control.offered]
    choices = list(itertools.product(*(range(len(control.offered)) for control in controls)))
    first = tuple(list(control.offered).index(control.default) for control in controls)
    frames = []
    for k, choice in enumerate(choices):
        values = {control.name: control.offered[index] for control, index in zip(controls, choice, strict=True)}
        frames.append(frame(choice, experiment.show(defaults(experiment.controls) | values)))
        tell((k + 1) / len(choices))
    now = experiment.show(defaults(experiment.controls))
    return Markup(
        '<figure class="film" id="film-{}"><div class="knobs" hidden>{}</div><p class="says" aria-live="polite">{}</p>'
        '<div class="drawing" role="group" aria-label="{}">{}</div>{}<figcaption>{} <span class="files"><a href="{}.csv">CSV</a></span>'
        "</figcaption></figure>"
    ).format(
        experiment.name,
        Markup("").join(knob(experiment.name, *pair) for pair in zip(controls, first, strict=True)),
        now.says,
        experiment.title,
        now.picture,
        Markup("").join(frames),
        fixed(experiment),
        experiment.name,
    )


def frame(choice: Sequence[int], shown: Shown) -> Markup:
    """Return a frame that is hidden until it is chosen."""
    return Markup('<template data-frame="{}"><p class="says">{}</p><div class="drawing">{}</div></template>').format(
        "-".join(map(str, choice)), shown.says, shown.picture
    )


def knob(name: str, control: Control, index: int) -> Markup:
    """Return the input of a control of the experiment of this name."""
    texts = [control.text(value) for value in control.offered]
    return slider(control, index, texts) if control.is_slider else buttons(f"{name}-{control.name}", control, index, texts)


def slider(control: Control, index: int, texts: Sequence[str]) -> Markup:
    """Return a slider whose value is the index of the control's value."""
    import json

    return Markup(
        '<label>{}<input type="range" min="0" max="{}" step="1" value="{}" data-knob="{}" data-texts="{}" aria-valuetext="{}">'
        "<output>{}</output></label>"
    ).format(control.label, len(texts) - 1, index, control.name, json.dumps(texts), texts[index], texts[index])


def buttons(group: str, control: Control, index: int, texts: Sequence[str]) -> Markup:
    """Return radio buttons, one a value of the control."""
    template = Markup('<label><input type="radio" name="{}" value="{}"{}>{}</label>')
    inputs = (template.format(group, k, Markup(" checked") if k == index else "", text) for k, text in enumerate(texts))
    return Markup('<fieldset data-knob="{}"><legend>{}</legend>{}</fieldset>').format(control.name, control.label, Markup("").join(inputs))


def fixed(experiment: Experiment) -> str:
    """Return the controls that the static page does not offer, and their values there."""
    still: list[Any] = [control for control in experiment.controls if not control.offered]
    if not still:
        return "All controls of the live lesson are here."
    return (
        "Fixed here, free in the live lesson: " + ", ".join(f"{control.label} {control.text(control.default)}" for control in still) + "."
    )
