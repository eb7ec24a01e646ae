"""The live side of a lesson: marimo's widgets for controls, what they show, and the note of progress before."""

from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Any

import marimo as mo
from markupsafe import Markup

from daebench.pages.lesson.control import Control, defaults
from daebench.pages.lesson.experiment import Experiment, Preparation


class Knobs(mo.Html):
    """The widgets of an experiment, side by side."""


class Picture(mo.Html):
    """What an experiment shows with the values that its widgets have.

    Parameters
    ----------
    experiment : Experiment
        What is shown.
    values : mapping of str to Any
        Values of its controls.
    """

    def __init__(self, experiment: Experiment, values: Mapping[str, Any]) -> None:
        self.experiment = experiment
        shown = experiment.show(values)
        whole = Markup('<div class="shown"><p class="says">{}</p><div class="drawing">{}</div></div>').format(shown.says, shown.picture)
        super().__init__(str(whole))  # marimo's encoder takes no subclass of str


def style() -> mo.Html:
    """Return the style of pictures and controls, for the head of a lesson."""
    return mo.Html(f"<style>{style_text()}</style>")


def style_text() -> str:
    """Return the style of lessons, which the live and the static page share."""
    files = [resources.files("daebench.draw.svg") / "panels.css", resources.files("daebench.reports.lessons") / "lesson.css"]
    return "\n".join(sheet.read_text(encoding="utf-8") for sheet in files)


def prepare(preparations: Sequence[Preparation]) -> None:
    """Do what has to be done before the controls answer at once, behind a note of progress."""
    with mo.status.progress_bar(total=len(preparations), title="Preparing", subtitle=preparations[0][0], remove_on_exit=True) as bar:
        for (_, make), (following, _) in zip(preparations, [*preparations[1:], ("done", None)], strict=True):
            make()
            bar.update(subtitle=following)


def panel(experiment: Experiment) -> Any:
    """Return the widgets of an experiment as one element, whose value is the values of the controls by name."""
    return mo.ui.dictionary({control.name: widget(control) for control in experiment.controls})


def widget(control: Control) -> Any:
    """Return the widget of a control."""
    if control.is_switch:
        return mo.ui.switch(value=control.default, label=control.label)
    if control.is_slider:
        return mo.ui.slider(steps=list(control.values), value=control.default, label=control.label, show_value=True)
    return mo.ui.dropdown(
        {control.text(value): value for value in control.values}, value=control.text(control.default), label=control.label
    )


def arranged(widgets: Any) -> Knobs:
    """Return the widgets of a panel side by side."""
    return Knobs(mo.hstack(list(widgets.elements.values()), justify="start", gap=1.5, wrap=True).text)


def shown(experiment: Experiment, widgets: Any) -> Picture:
    """Return what an experiment shows with the values that its widgets have."""
    return Picture(experiment, widgets.value)


def report(experiments: Sequence[Experiment]) -> None:
    """Print what each experiment measures with its default values, where the lesson is run as a plain script."""
    if mo.app_meta().mode == "script":
        for experiment in experiments:
            setting = ", ".join(f"{control.name} = {control.text(control.default)}" for control in experiment.controls)
            print(f"{experiment.title}: {setting}\n  {experiment.show(defaults(experiment.controls)).says.striptags()}")
