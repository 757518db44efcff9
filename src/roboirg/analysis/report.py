"""One self-contained HTML page that shows every episode: what was said, done and judged."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, get_args

from roboirg.analysis.statistics import EXPLICIT, Cell, Panel, Variant, make_panels
from roboirg.analysis.tables import ALL_TASKS, percent, points
from roboirg.episode import DIFFICULTIES, SPLITS
from roboirg.errors import MissingDependencyError
from roboirg.evaluation.record import EventRecord, Job, MentionSpan, Outcome, Record
from roboirg.evaluation.store import read_records, write_atomically

if TYPE_CHECKING:
    import jinja2

REPORT_FILE = "report.html"
TEMPLATE = "report.html.j2"

STEPS_PER_SECOND = 20
RESTING = "still"
_HUES = 4
"""Colours that the style sheet has for slots."""


class Segment(NamedTuple):
    """A stretch of an utterance; `mention` is None between mentions."""

    text: str
    mention: MentionSpan | None
    hue: int
    hint: str


class Line(NamedTuple):
    """An utterance as it is shown."""

    stage: str
    segments: tuple[Segment, ...]


class Choice(NamedTuple):
    """A filter: its name in the page's data, what it is called, and what it offers."""

    name: str
    label: str
    values: tuple[str, ...]


class Mark(NamedTuple):
    """An event on the time line; `left` is its place in per cent."""

    left: float
    step: int
    seconds: str
    text: str
    holds: bool


@dataclass(frozen=True, slots=True)
class Card:
    """An episode as it is shown. Films and pictures are data URIs."""

    number: int
    record: Record
    setting: str
    lines: tuple[Line, ...]
    goal: str
    marks: tuple[Mark, ...]
    seconds: str
    video: str | None
    poster: str | None


@dataclass(frozen=True, slots=True)
class HeatCell:
    """A cell of the overview."""

    policy: str
    task: str | None
    setting: str
    split: str
    max_steps: int
    rate: float | None
    text: str
    gap: str
    note: str
    is_complete: bool


class HeatRow(NamedTuple):
    """A row of the overview: a policy as a whole, or one of its tasks."""

    name: str
    is_policy: bool
    cells: tuple[HeatCell | None, ...]


def write_report(folder: Path, *, planned: Sequence[Job] = (), videos: bool = True) -> Path:
    """Write ``report.html`` into a run's folder, whole or not at all.

    Args:
        folder: of the run.
        planned: jobs that should be there; the page says which cells lack some.
        videos: put the films into the page.

    Returns:
        The path of the page.

    Raises:
        StoreError: there are no records, or they cannot be read.
        MissingDependencyError: Jinja is not installed.
    """
    path = folder / REPORT_FILE
    write_atomically(path, render(read_records(folder), folder if videos else None, planned))
    return path


def render(
    records: Sequence[Record], folder: Path | None = None, planned: Sequence[Job] = ()
) -> str:
    """The page as text.

    Args:
        records: one for each identity.
        folder: where the films are; None leaves them out.
        planned: jobs that should be there.

    Raises:
        MissingDependencyError: Jinja is not installed.
    """
    ordered = sorted(records, key=_order)
    panels = make_panels(ordered, planned)
    variants = sorted(
        {variant for panel in panels for variant in panel.variants}, key=Variant.sort_key
    )
    return (
        _environment()
        .get_template(TEMPLATE)
        .render(
            variants=[variant.label for variant in variants],
            rows=[row for panel in panels for row in _heat_rows(panel, variants)],
            cards=[_card(number, record, folder) for number, record in enumerate(ordered, 1)],
            choices=_choices(ordered),
            several={
                name: len({getattr(record, name) for record in records}) > 1
                for name in ("policy_seed", "max_steps")
            },
            has_privileged=any(record.privileged for record in records),
            has_gaps=any(
                cell.gap is not None and variant != EXPLICIT
                for panel in panels
                for (_, variant), cell in panel.cells.items()
            ),
            counts={
                outcome: sum(record.outcome == outcome for record in records)
                for outcome in ("success", "failure", "error")
            },
            devices=sorted({record.render_device for record in records if record.render_device}),
            versions=sorted({record.package_version for record in records}),
            languages=sorted({record.language_version for record in records}),
        )
    )


def check_report_support() -> None:
    """Complain now if the page cannot be made.

    Raises:
        MissingDependencyError: Jinja is not installed.
    """
    try:
        import jinja2  # noqa: F401 - an extra
    except ImportError as error:
        raise MissingDependencyError(
            f"The report needs Jinja, which is not installed ({error}); run: "
            "pip install 'roboirgbench[report]'"
        ) from error


def _environment() -> jinja2.Environment:
    check_report_support()
    import jinja2

    return jinja2.Environment(
        loader=jinja2.PackageLoader("roboirg.analysis"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )


def _order(record: Record) -> tuple[object, ...]:
    """Tellings of one episode stand together, its policies side by side."""
    told = Variant.of(record).sort_key()
    return (record.task, record.split, record.episode, told, record.policy_seed, record.policy)


def _choices(records: Sequence[Record]) -> list[Choice]:
    """The filters; of the rules under which was played only those of which there are several."""
    variants = sorted({Variant.of(record) for record in records}, key=Variant.sort_key)
    settings = tuple(variant.label for variant in variants)
    rules = (
        Choice("split", "split", _present(records, "split", SPLITS)),
        Choice("seed", "policy seed", _numbers(record.policy_seed for record in records)),
        Choice("limit", "step limit", _numbers(record.max_steps for record in records)),
    )
    return [
        Choice("policy", "policy", tuple(dict.fromkeys(record.policy for record in records))),
        Choice("task", "task", tuple(dict.fromkeys(record.task for record in records))),
        Choice("setting", "setting", settings),
        *(rule for rule in rules if len(rule.values) > 1),
        Choice("outcome", "outcome", _present(records, "outcome", get_args(Outcome))),
        Choice("difficulty", "difficulty", _present(records, "difficulty", DIFFICULTIES)),
    ]


def _present(records: Sequence[Record], name: str, order: Sequence[str]) -> tuple[str, ...]:
    values = {str(getattr(record, name)) for record in records}
    return tuple(value for value in order if value in values)


def _numbers(values: Iterable[int]) -> tuple[str, ...]:
    return tuple(map(str, sorted(set(values))))


def _heat_rows(panel: Panel, variants: Sequence[Variant]) -> list[HeatRow]:
    def row(task: str | None, name: str, *, is_policy: bool) -> HeatRow:
        cells = (_heat_cell(panel, task, variant) for variant in variants)
        return HeatRow(name, is_policy, tuple(cells))

    whole = row(None, panel.label, is_policy=True)
    if len(panel.tasks) == 1:
        return [whole]
    return [whole, *(row(task, task, is_policy=False) for task in panel.tasks)]


def _heat_cell(panel: Panel, task: str | None, variant: Variant) -> HeatCell | None:
    cell = panel.cells.get((task, variant))
    if cell is None:
        return None
    has_gap = cell.gap is not None and variant != EXPLICIT
    return HeatCell(
        policy=panel.condition.policy,
        task=task,
        setting=variant.label,
        split=panel.condition.split,
        max_steps=panel.condition.max_steps,
        rate=cell.rate,
        text="–" if cell.rate is None else percent(cell.rate),
        gap=points(cell.gap) if has_gap and cell.gap is not None else "",
        note=_note(cell, f"{panel.label}, {task or ALL_TASKS}, {variant.label}"),
        is_complete=cell.is_complete,
    )


def _note(cell: Cell, where: str) -> str:
    """A cell in words, for tool tips and screen readers."""
    words = [f"{where}: {cell.successes} of {cell.trials} succeeded"]
    if cell.interval is not None:
        low, high = cell.interval
        words.append(f"95 % interval {percent(low)} to {percent(high)} %")
    if cell.gap is not None:
        words.append(f"{points(cell.gap)} points to explicit on {cell.pairs} same episodes")
    if cell.errors:
        words.append(f"{cell.errors} ended in an error")
    if cell.missing:
        words.append(f"{cell.missing} still to be played")
    return "; ".join(words)


def _card(number: int, record: Record, folder: Path | None) -> Card:
    hues = {slot: index % _HUES for index, slot in enumerate(record.goal)}
    film = None if folder is None or record.video is None else folder / record.video
    poster = None if film is None else film.with_suffix(".jpg")
    return Card(
        number=number,
        record=record,
        setting=Variant.of(record).label,
        lines=tuple(
            Line(turn.stage, _segments(turn.text, _mentions_of(record, index), hues))
            for index, turn in enumerate(record.instruction)
        ),
        goal=" · ".join(f"{slot}: {_value(value)}" for slot, value in record.goal.items()),
        marks=_marks(record),
        seconds=f"{record.steps / STEPS_PER_SECOND:.0f}",
        video=_data_uri(film, "video/mp4"),
        poster=_data_uri(poster, "image/jpeg"),
    )


def _value(value: object) -> str:
    return ", then ".join(value) if isinstance(value, tuple) else str(value)


def _mentions_of(record: Record, utterance: int) -> list[MentionSpan]:
    own = [mention for mention in record.mentions if mention.utterance == utterance]
    return sorted(own, key=lambda mention: mention.start)


def _segments(
    text: str, mentions: Sequence[MentionSpan], hues: dict[str, int]
) -> tuple[Segment, ...]:
    segments: list[Segment] = []
    position = 0
    for mention in mentions:
        if mention.start < position:
            # One span may stand for several values ("them"); it is drawn once and lists all.
            if segments and segments[-1].mention is not None:
                last = segments[-1]
                segments[-1] = last._replace(hint=f"{last.hint}, {mention.value}")
            continue
        if position < mention.start:
            segments.append(Segment(text[position : mention.start], None, 0, ""))
        hint = f"{mention.role}: {mention.slot} {mention.value}"
        span = text[mention.start : mention.end]
        segments.append(Segment(span, mention, hues.get(mention.slot, 0), hint))
        position = mention.end
    if position < len(text):
        segments.append(Segment(text[position:], None, 0, ""))
    return tuple(segments)


def _marks(record: Record) -> tuple[Mark, ...]:
    """What the policy did; not what the video shows, and not every rest of the robot."""
    shown = [event for event in record.events if event.step > 0 and event.kind != RESTING]
    last = max([1, record.steps, *(event.step for event in shown)])
    return tuple(
        Mark(
            left=round(100 * event.step / last, 2),
            step=event.step,
            seconds=f"{event.step / STEPS_PER_SECOND:.1f}",
            text=_event_text(event),
            holds=event.holds,
        )
        for event in shown
    )


def _event_text(event: EventRecord) -> str:
    words = event.kind.replace("_", " ")
    text = f"{event.subject.replace('_', ' ')} {words}"
    if event.place:
        text += f" on {event.place.replace('_', ' ')}"
    return text if event.holds else f"{text}: no longer"


def _data_uri(path: Path | None, kind: str) -> str | None:
    if path is None:
        return None
    try:
        data = path.read_bytes()
    except OSError:
        return None
    return f"data:{kind};base64,{base64.b64encode(data).decode('ascii')}"
