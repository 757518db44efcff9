"""One self-contained HTML page that shows every episode: what was said, done and judged."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, get_args

from roboirg.analysis.cards import Media, make_card
from roboirg.analysis.overview import FEW, Level, make_levels, present
from roboirg.analysis.statistics import EXPLICIT, Condition, Panel, Variant, make_panels
from roboirg.episode import DIFFICULTIES, SPLITS
from roboirg.errors import MissingDependencyError
from roboirg.evaluation.record import Job, Outcome, Record
from roboirg.evaluation.store import read_records, write_atomically

if TYPE_CHECKING:
    import jinja2

REPORT_FILE = "report.html"
TEMPLATE = "report.html.j2"


class Choice(NamedTuple):
    """A filter: its name in the page's data, what it is called, and what it offers."""

    name: str
    label: str
    values: tuple[str, ...]


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
    levels = make_levels(ordered, panels, variants)
    template = _environment().get_template(TEMPLATE)
    return template.render(
        variants=[variant.label for variant in variants],
        levels=levels,
        cards=[make_card(number, record, media) for number, record in enumerate(ordered, 1)],
        films_are_beside=not media.embeds,
        facts=_facts(records, name),
        few=FEW,
        choices=_choices(ordered),
        several={
            name: len({getattr(record, name) for record in records}) > 1
            for name in ("policy_seed", "max_steps")
        },
        counts={
            outcome: sum(record.outcome == outcome for record in records)
            for outcome in get_args(Outcome)
        },
        devices=sorted({record.render_device for record in records if record.render_device}),
        **_to_explain(records, panels, levels),
    )


def _to_explain(
    records: Sequence[Record], panels: Sequence[Panel], levels: Sequence[Level]
) -> dict[str, bool]:
    """What the page's legends have to explain, because it occurs."""
    return {
        "has_references": any(
            mention.slot not in record.goal for record in records for mention in record.mentions
        ),
        "has_privileged": any(record.privileged for record in records),
        "has_gaps": any(
            cell.gap is not None and variant != EXPLICIT
            for panel in panels
            for (_, variant), cell in panel.cells.items()
        ),
        "has_floors": any(
            cell is not None and cell.gap_is_muted
            for level in levels
            for row in level.rows
            for cell in row.cells
        ),
    }


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
        Choice("split", "split", present(records, "split", SPLITS)),
        Choice("seed", "policy seed", _numbers(record.policy_seed for record in records)),
        Choice("limit", "step limit", _numbers(record.max_steps for record in records)),
    )
    return [
        Choice("policy", "policy", tuple(dict.fromkeys(record.policy for record in records))),
        Choice("task", "task", tuple(dict.fromkeys(record.task for record in records))),
        Choice("setting", "setting", settings),
        *(rule for rule in rules if len(rule.values) > 1),
        Choice("outcome", "outcome", present(records, "outcome", get_args(Outcome))),
        Choice("difficulty", "difficulty", present(records, "difficulty", DIFFICULTIES)),
    ]


def _numbers(values: Iterable[int]) -> tuple[str, ...]:
    return tuple(map(str, sorted(set(values))))
