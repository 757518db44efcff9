"""Render the operator's page: one trial with a button for every verdict."""

from __future__ import annotations

import functools
from collections import Counter
from typing import TYPE_CHECKING, NamedTuple

from roboirg.apps.real.pages.arrangement_svg import draw_svg
from roboirg.apps.real.study.arrangement_shapes import describe_positions
from roboirg.apps.real.study.failure_choices import failure_choices
from roboirg.apps.real.study.study_plan import PlannedTrial
from roboirg.apps.real.study.trial_log import SUCCESS, VOID_CHOICE, TrialLog, trial_metadata
from roboirg.evaluation.records.record import Record
from roboirg.util.web.page_templates import template_environment

if TYPE_CHECKING:
    import jinja2

TEMPLATE = "score.html.j2"
SUCCESS_KEY, VOID_KEY = "s", "v"


class VerdictButton(NamedTuple):
    """The button of a verdict.

    Attributes:
        value: choice for `TrialLog.score`.
        key: of the keyboard.
        label: text of the button.
        group: success, grounding, execution or void.
        chosen: whether this is the trial's present verdict.
    """

    value: str
    key: str
    label: str
    group: str
    chosen: bool


def render_trial(trial_log: TrialLog, trial: PlannedTrial, *, nonce: str, message: str = "") -> str:
    """Render the page of a trial.

    Args:
        trial_log: with the records of the study.
        trial: to show.
        nonce: allows the page's own style and script.
        message: result of the last click.
    """
    names = [one.name for one in trial_log.plan.trials]
    index = names.index(trial.name)
    record = trial_log.newest(trial.name)
    states = Counter(trial_log.state(name) for name in names)
    metadata = trial_metadata(record) if record else {}
    return _template().render(
        trial=trial.name,
        block=trial.block,
        position=index + 1,
        total=len(names),
        scored=states["scored"] + states["void"],
        previous=names[index - 1] if index else "",
        following=names[index + 1] if index + 1 < len(names) else "",
        turns=trial.turns,
        meaning=trial.meaning,
        positions=describe_positions(trial.episode.scene),
        drawing=draw_svg(trial.episode.scene),
        buttons=verdict_buttons(trial, record, trial_log.state(trial.name)),
        state=trial_log.state(trial.name),
        note=metadata.get("note", ""),
        video=(record.video or "") if record else "",
        revision=trial_log.revision(trial.name),
        nonce=nonce,
        message=message,
    )


def verdict_buttons(
    trial: PlannedTrial, record: Record | None, state: str
) -> tuple[VerdictButton, ...]:
    """Return a button for every verdict of a trial, with its key."""
    choices = failure_choices(trial.episode)
    chosen = _present_choice(trial, record, state)
    failures = (
        VerdictButton(
            one.key,
            str(number),
            f"the robot {one.words}",
            one.attribution().kind,
            one.key == chosen,
        )
        for number, one in enumerate(choices, 1)
    )
    return (
        VerdictButton(
            SUCCESS, SUCCESS_KEY, "the robot did what was meant", SUCCESS, chosen == SUCCESS
        ),
        *failures,
        VerdictButton(
            VOID_CHOICE, VOID_KEY, "void: says nothing about the policy; play the trial again",
            VOID_CHOICE, chosen == VOID_CHOICE,
        ),
    )  # fmt: skip


def _present_choice(trial: PlannedTrial, record: Record | None, state: str) -> str:
    """Return the choice of the present verdict; empty if there is none."""
    if record is None or state not in ("scored", "void"):
        return ""
    if state == "void":
        return VOID_CHOICE
    found = record.attribution
    if found is None:
        return SUCCESS
    for one in failure_choices(trial.episode):
        if (one.failure, one.subject) == (found.failure, found.subject):
            return one.key
    return ""


@functools.cache
def _template() -> jinja2.Template:
    from markupsafe import Markup

    def svg(text: str) -> Markup:
        return Markup(text)  # noqa: S704 - drawn by this package, with the plan's names

    environment = template_environment("roboirg.apps.real.pages")
    environment.filters["svg"] = svg
    return environment.get_template(TEMPLATE)
