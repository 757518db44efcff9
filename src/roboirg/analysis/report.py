"""One self-contained HTML page that shows every episode: what was said, done and judged."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, NamedTuple, get_args
from urllib.parse import quote

from roboirg.analysis.statistics import EXPLICIT, Cell, Condition, Panel, Variant, make_panels
from roboirg.analysis.tables import ALL_TASKS, count_text, gap_text, percent, points
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
MOST_FILM_BYTES = 60_000_000
"""Films that weigh more together stay beside the page."""

FEW = 20
"""Cells with fewer episodes say how many."""

_HUES = 4
"""Colours that the style sheet has for slots."""

_NEUTRAL = "reference"
"""The colour of what only leads to the goal."""

_TICK_SECONDS = (1, 2, 5, 10, 20, 60)
_MOST_TICKS = 6


class Segment(NamedTuple):
    """A stretch of an utterance; `mention` is None between mentions."""

    text: str
    mention: MentionSpan | None
    hue: str
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


class Tick(NamedTuple):
    """A place on the scale of the time line."""

    left: float
    seconds: int


@dataclass(frozen=True, slots=True)
class Card:
    """An episode as it is shown. Films and pictures are data URIs, or paths beside the page."""

    number: int
    record: Record
    setting: str
    lines: tuple[Line, ...]
    goal: str
    marks: tuple[Mark, ...]
    ticks: tuple[Tick, ...]
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
    difficulty: str
    rate: float | None
    text: str
    gap: str
    gap_is_muted: bool
    count: str
    note: str
    is_complete: bool


class HeatRow(NamedTuple):
    """A row of the overview: a policy as a whole, or one of its tasks."""

    name: str
    is_policy: bool
    trials: str
    cells: tuple[HeatCell | None, ...]


class Level(NamedTuple):
    """The overview of one difficulty; empty for all together."""

    difficulty: str
    rows: tuple[HeatRow, ...]


@dataclass(frozen=True, slots=True)
class Media:
    """How films get into the page.

    Attributes:
        folder: of the run; None leaves films out.
        embeds: whether they become part of the page.
    """

    folder: Path | None
    embeds: bool

    @classmethod
    def of(cls, records: Sequence[Record], folder: Path | None) -> Media:
        """Into the page where they are not too much together."""
        if folder is None:
            return cls(None, embeds=True)
        films = [folder / record.video for record in records if record.video is not None]
        weight = sum(film.stat().st_size for film in films if film.is_file())
        return cls(folder, embeds=weight <= MOST_FILM_BYTES)

    def link(self, name: str | None, kind: str) -> str | None:
        """What a source attribute says; None without the file."""
        if self.folder is None or name is None:
            return None
        if self.embeds:
            return _data_uri(self.folder / name, kind)
        return quote(name) if (self.folder / name).is_file() else None


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
    records = read_records(folder)
    media = folder if videos else None
    write_atomically(path, render(records, media, planned, name=folder.resolve().name))
    return path


def render(
    records: Sequence[Record],
    folder: Path | None = None,
    planned: Sequence[Job] = (),
    *,
    name: str = "",
) -> str:
    """The page as text.

    Args:
        records: one for each identity.
        folder: where the films are; None leaves them out. More than `MOST_FILM_BYTES` of them
            are linked to, by their paths in it, rather than embedded.
        planned: jobs that should be there.
        name: of the run.

    Raises:
        MissingDependencyError: Jinja is not installed.
    """
    panels = make_panels(records, planned)
    ordered = _in_order(records, panels)
    variants = sorted(
        {variant for panel in panels for variant in panel.variants}, key=Variant.sort_key
    )
    media = Media.of(records, folder)
    levels = _levels(ordered, panels, variants)
    return (
        _environment()
        .get_template(TEMPLATE)
        .render(
            variants=[variant.label for variant in variants],
            levels=levels,
            cards=[_card(number, record, media) for number, record in enumerate(ordered, 1)],
            films_are_beside=not media.embeds,
            has_references=any(
                mention.slot not in record.goal for record in records for mention in record.mentions
            ),
            facts=_facts(records, name),
            few=FEW,
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
            has_floors=any(
                cell is not None and cell.gap_is_muted
                for level in levels
                for row in level.rows
                for cell in row.cells
            ),
            counts={
                outcome: sum(record.outcome == outcome for record in records)
                for outcome in ("success", "failure", "error")
            },
            devices=sorted({record.render_device for record in records if record.render_device}),
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


def _in_order(records: Sequence[Record], panels: Sequence[Panel]) -> list[Record]:
    """Policies and tasks as in the overview, then episodes, then settings."""
    conditions = [panel.condition for panel in panels]
    tasks = list(dict.fromkeys(task for panel in panels for task in panel.tasks))
    return sorted(
        records,
        key=lambda record: (
            conditions.index(Condition.of(record)),
            tasks.index(record.task),
            record.episode,
            Variant.of(record).sort_key(),
            record.policy_seed,
        ),
    )


def _facts(records: Sequence[Record], name: str) -> list[tuple[str, str]]:
    """What the head of the page says about the run."""
    times = sorted(record.started_at[:16].replace("T", " ") for record in records)
    facts = [
        ("run", name),
        ("played", _span(times[0], times[-1]) if times else ""),
        ("split", _said(records, "split")),
        ("step limit", _said(records, "max_steps")),
        ("roboirg", _said(records, "package_version")),
        ("language", _said(records, "language_version")),
        ("environment", _said(records, "environment_version")),
    ]
    return [(label, value) for label, value in facts if value]


def _span(first: str, last: str) -> str:
    """From one time to another, such as 2026-01-02 03:04; the day only once."""
    if first == last:
        return f"{first} UTC"
    day, _, minute = last.partition(" ")
    return f"{first} to {minute if first.startswith(day) else last} UTC"


def _said(records: Sequence[Record], name: str) -> str:
    return ", ".join(map(str, sorted({getattr(record, name) for record in records})))


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


def _levels(
    records: Sequence[Record], panels: Sequence[Panel], variants: Sequence[Variant]
) -> list[Level]:
    """The overview of everything, and of each difficulty where there are several."""
    levels = [("", panels)]
    found = _present(records, "difficulty", DIFFICULTIES)
    if len(found) > 1:
        # What is planned and not played has no difficulty yet; it counts among everything.
        levels += [
            (level, make_panels([record for record in records if record.difficulty == level]))
            for level in found
        ]
    return [
        Level(
            difficulty,
            tuple(row for panel in own for row in _heat_rows(panel, variants, difficulty)),
        )
        for difficulty, own in levels
    ]


def _heat_rows(panel: Panel, variants: Sequence[Variant], difficulty: str) -> list[HeatRow]:
    def row(task: str | None, name: str, *, is_policy: bool) -> HeatRow:
        cells = (_heat_cell(panel, task, variant, difficulty) for variant in variants)
        return HeatRow(name, is_policy, count_text(*panel.trials([task])), tuple(cells))

    whole = row(None, panel.label, is_policy=True)
    if len(panel.tasks) == 1:
        return [whole]
    return [whole, *(row(task, task, is_policy=False) for task in panel.tasks)]


def _heat_cell(
    panel: Panel, task: str | None, variant: Variant, difficulty: str
) -> HeatCell | None:
    cell = panel.cells.get((task, variant))
    if cell is None:
        return None
    return HeatCell(
        policy=panel.condition.policy,
        task=task,
        setting=variant.label,
        split=panel.condition.split,
        max_steps=panel.condition.max_steps,
        rate=cell.rate,
        text="–" if cell.rate is None else percent(cell.rate),
        difficulty=difficulty,
        gap="" if variant == EXPLICIT else gap_text(cell),
        gap_is_muted=cell.is_at_floor,
        count=_count(cell),
        note=_note(
            cell,
            ", ".join(filter(None, (panel.label, task or ALL_TASKS, difficulty, variant.label))),
            is_reference=variant == EXPLICIT,
        ),
        is_complete=cell.is_complete,
    )


def _count(cell: Cell) -> str:
    """How sure the rate is: few episodes are counted, and the interval is said always."""
    if cell.interval is None:
        return ""
    interval = "–".join(map(percent, cell.interval))
    return f"{cell.successes}/{cell.trials} · {interval}" if cell.trials < FEW else interval


def _note(cell: Cell, where: str, *, is_reference: bool) -> str:
    """A cell in words, for tool tips and screen readers."""
    words = [f"{where}: {cell.successes} of {cell.trials} succeeded"]
    if cell.interval is not None:
        low, high = cell.interval
        words.append(f"95 % interval {percent(low)} to {percent(high)} %")
    if cell.gap is not None and not is_reference:
        words.append(f"{points(cell.gap)} points to explicit on {cell.pairs} same episodes")
        if cell.is_at_floor:
            words.append("nothing succeeded there, so the gap says nothing")
    if cell.errors:
        words.append(f"{cell.errors} ended in an error")
    if cell.missing:
        words.append(f"{cell.missing} still to be played")
    return "; ".join(words)


def _card(number: int, record: Record, media: Media) -> Card:
    hues = {slot: str(index % _HUES) for index, slot in enumerate(record.goal)}
    poster = None if record.video is None else str(PurePosixPath(record.video).with_suffix(".jpg"))
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
        ticks=_ticks(record),
        seconds=f"{record.steps / STEPS_PER_SECOND:.0f}",
        video=media.link(record.video, "video/mp4"),
        poster=media.link(poster, "image/jpeg"),
    )


def _value(value: object) -> str:
    return ", then ".join(value) if isinstance(value, tuple) else str(value)


def _mentions_of(record: Record, utterance: int) -> list[MentionSpan]:
    own = [mention for mention in record.mentions if mention.utterance == utterance]
    return sorted(own, key=lambda mention: mention.start)


def _segments(
    text: str, mentions: Sequence[MentionSpan], hues: dict[str, str]
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
            segments.append(Segment(text[position : mention.start], None, "", ""))
        hint = f"{mention.role}: {mention.slot} {mention.value}"
        span = text[mention.start : mention.end]
        segments.append(Segment(span, mention, hues.get(mention.slot, _NEUTRAL), hint))
        position = mention.end
    if position < len(text):
        segments.append(Segment(text[position:], None, "", ""))
    return tuple(segments)


def _marks(record: Record) -> tuple[Mark, ...]:
    """What the policy did; not what the video shows, and not every rest of the robot."""
    shown = _shown_events(record)
    last = _last_step(record)
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


def _shown_events(record: Record) -> list[EventRecord]:
    return [event for event in record.events if event.step > 0 and event.kind != RESTING]


def _last_step(record: Record) -> int:
    return max([1, record.steps, *(event.step for event in _shown_events(record))])


def _ticks(record: Record) -> tuple[Tick, ...]:
    """Whole seconds on the time line, a handful of them."""
    length = _last_step(record) / STEPS_PER_SECOND
    fitting = (step for step in _TICK_SECONDS if length / step < _MOST_TICKS)
    every = next(fitting, _TICK_SECONDS[-1])
    return tuple(
        Tick(round(100 * seconds / length, 2), seconds)
        for seconds in range(0, int(length) + 1, every)
    )


def _event_text(event: EventRecord) -> str:
    words = event.kind.replace("_", " ")
    text = f"{event.subject.replace('_', ' ')} {words}"
    if event.place:
        text += f" on {event.place.replace('_', ' ')}"
    return text if event.holds else f"{text}: no longer"


def _data_uri(path: Path, kind: str) -> str | None:
    try:
        data = path.read_bytes()
    except OSError:
        return None
    return f"data:{kind};base64,{base64.b64encode(data).decode('ascii')}"
