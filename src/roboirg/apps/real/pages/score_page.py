"""Render the operator's page: one trial with a button for every verdict."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from roboirg.apps.real.pages.arrangement_svg import draw_svg
from roboirg.apps.real.study.arrangement_shapes import describe_positions
from roboirg.apps.real.study.failure_choices import failure_choices
from roboirg.apps.real.study.study_plan import PlannedTrial
from roboirg.apps.real.study.trial_log import SUCCESS, VOID_CHOICE, TrialLog, trial_metadata
from roboirg.records.record import Record
from roboirg.util.web.page_templates import template_environment

if TYPE_CHECKING:
    import jinja2

TEMPLATE = "score.html.j2"
SUCCESS_KEY = "s"
VOID_KEY = "v"


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
    """Return the HTML page of a trial: what to arrange and say, and a button for every verdict.

    Args:
        trial_log: with the records of the study.
        trial: to show.
        nonce: random text that allows the page's own style and script (Content-Security-Policy).
        message: result of the last click.
    """
    names = [planned.name for planned in trial_log.plan.trials]
    index = names.index(trial.name)
    record = trial_log.newest(trial.name)
    metadata = trial_metadata(record) if record else {}
    unscored = [name for name in names if trial_log.state(name) == "open"]
    state = trial_log.state(trial.name)
    return _template().render(
        trial=trial.name,
        block=trial.block,
        position=index + 1,
        total=len(names),
        scored=len(names) - len(unscored),
        previous=_name_at(names, index - 1),
        following=_name_at(names, index + 1),
        turns=trial.turns,
        meaning=trial.meaning,
        positions=describe_positions(trial.episode.scene),
        drawing=draw_svg(trial.episode.scene),
        buttons=verdict_buttons(trial, record, state),
        state=state,
        note=metadata.get("note", ""),
        video=record.video if record and record.video else "",
        revision=trial_log.revision(trial.name),
        nonce=nonce,
        message=message,
    )


def _name_at(names: Sequence[str], index: int) -> str:
    """Return the name of a trial; empty before the first and after the last."""
    return names[index] if 0 <= index < len(names) else ""


def verdict_buttons(
    trial: PlannedTrial, record: Record | None, state: str
) -> tuple[VerdictButton, ...]:
    """Return a button for every verdict of a trial, with its key: success, failures, void.

    Failures have the keys 1, 2, … in the order of `failure_choices`. `record` is the trial's
    newest, or None; `state` is open, scored or void.
    """
    chosen = _present_choice(trial, record, state)
    done = "the robot did what was meant"
    buttons = [VerdictButton(SUCCESS, SUCCESS_KEY, done, SUCCESS, chosen == SUCCESS)]
    for number, failure in enumerate(failure_choices(trial.episode), 1):
        label = f"the robot {failure.words}"
        group = failure.attribution().kind
        is_chosen = failure.key == chosen
        buttons.append(VerdictButton(failure.key, str(number), label, group, is_chosen))
    void = "void: says nothing about the policy; play the trial again"
    is_void = chosen == VOID_CHOICE
    buttons.append(VerdictButton(VOID_CHOICE, VOID_KEY, void, VOID_CHOICE, is_void))
    return tuple(buttons)


def _present_choice(trial: PlannedTrial, record: Record | None, state: str) -> str:
    """Return the choice of the present verdict, for `TrialLog.score`; empty if there is none.

    For example ``"success"``, ``"void"``, or ``"wrong_place:box_green"``.
    """
    if record is None or state not in ("scored", "void"):
        return ""
    if state == "void":
        return VOID_CHOICE
    attribution = record.attribution
    if attribution is None:
        return SUCCESS
    for choice in failure_choices(trial.episode):
        if choice.failure == attribution.failure and choice.subject == attribution.subject:
            return choice.key
    return ""


@functools.cache
def _template() -> jinja2.Template:
    """Return the page's template, loaded once; its filter `svg` lets drawings pass unescaped."""
    from markupsafe import Markup

    def svg(text: str) -> Markup:
        return Markup(text)  # noqa: S704 - drawn by this package, with the plan's names

    environment = template_environment("roboirg.apps.real.pages")
    environment.filters["svg"] = svg
    return environment.get_template(TEMPLATE)
