"""The operator's page as text: one trial at a time, a form with a button for every verdict."""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

from roboirg.core.errors import MissingDependencyError
from roboirg.real.pages.arrangement_svg import draw_svg
from roboirg.real.study.failure_choices import failure_choices
from roboirg.real.study.study_plan import PlannedTrial
from roboirg.real.study.trial_log import SUCCESS, VOID_CHOICE, TrialLog, said_of
from roboirg.real.study.trial_text import meant_by, places_of, turns_of
from roboirg.records.record import Record

if TYPE_CHECKING:
    import jinja2

TEMPLATE = "score.html.j2"
SUCCESS_KEY, VOID_KEY = "s", "v"


class Button(NamedTuple):
    """A verdict that can be given.

    Attributes:
        value: as `TrialLog.score` takes it.
        key: of the keyboard.
        words: what it says.
        group: success, grounding, execution or void.
        chosen: whether it is the verdict that counts now.
    """

    value: str
    key: str
    words: str
    group: str
    chosen: bool


def render(ledger: TrialLog, trial: PlannedTrial, *, token: str, message: str = "") -> str:
    """The page of a trial.

    Args:
        ledger: what is known of all trials.
        trial: the one to show.
        token: which only pages of this server know.
        message: what came of the last click.

    Raises:
        MissingDependencyError: Jinja is not installed.
    """
    names = [one.name for one in ledger.plan.trials]
    place = names.index(trial.name)
    record = ledger.newest(trial.name)
    states = Counter(ledger.state(name) for name in names)
    said = said_of(record) if record else {}
    return _template().render(
        trial=trial.name,
        block=trial.block,
        position=place + 1,
        total=len(names),
        scored=states["scored"] + states["void"],
        waiting=states["waiting"],
        previous=names[place - 1] if place else "",
        following=names[place + 1] if place + 1 < len(names) else "",
        turns=turns_of(trial),
        meant=meant_by(trial),
        places=places_of(trial),
        drawing=draw_svg(trial.episode.scene),
        buttons=buttons_of(trial, record, ledger.state(trial.name)),
        state=ledger.state(trial.name),
        cause=record.cause if record and record.outcome == "error" else "",
        note=said.get("note", ""),
        video=(record.video or "") if record else "",
        seen=ledger.count(trial.name),
        undo=ledger.last_scored or "",
        token=token,
        message=message,
    )


def buttons_of(trial: PlannedTrial, record: Record | None, state: str) -> tuple[Button, ...]:
    """Every verdict of a trial, with the key that gives it."""
    choices = failure_choices(trial.episode)
    chosen = _chosen(trial, record, state)
    failures = (
        Button(
            one.key,
            str(number),
            f"it {one.words}",
            "grounding" if one.is_grounding else "execution",
            one.key == chosen,
        )
        for number, one in enumerate(choices, 1)
    )
    return (
        Button(SUCCESS, SUCCESS_KEY, "it did what was meant", SUCCESS, chosen == SUCCESS),
        *failures,
        Button(
            VOID_CHOICE, VOID_KEY, "void: it says nothing about the policy, try again",
            VOID_CHOICE, chosen == VOID_CHOICE,
        ),
    )  # fmt: skip


def _chosen(trial: PlannedTrial, record: Record | None, state: str) -> str:
    """The verdict that counts now; empty if there is none."""
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


def check_page_support() -> None:
    """Complain now if the page cannot be made.

    Raises:
        MissingDependencyError: Jinja is not installed.
    """
    try:
        import jinja2  # noqa: F401 - an extra
    except ImportError as error:
        raise MissingDependencyError(
            f"The page needs Jinja, which is not installed ({error}); run: "
            "pip install 'roboirgbench[report]'"
        ) from error


@functools.cache
def _template() -> jinja2.Template:
    check_page_support()
    import jinja2
    from markupsafe import Markup

    def svg(text: str) -> Markup:
        return Markup(text)  # noqa: S704 - drawn here, of the plan's own names

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("roboirg.real.pages"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["svg"] = svg
    return environment.get_template(TEMPLATE)


def redirect_of(query: Mapping[str, str]) -> str:
    """The address of a trial's page."""
    from urllib.parse import urlencode

    return "/?" + urlencode(query)
