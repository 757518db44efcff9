"""The command that selects the seeds of the splits again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from roboirg.cli.options import (
    Tasks,
    Workers,
)
from roboirg.core.errors import InvalidValueError


def build_splits(
    tasks: Tasks = "all",
    split: Annotated[str, typer.Option(help="train, val, test or all.")] = "all",
    workers: Workers = None,
    out: Annotated[str | None, typer.Option(help="Write to this file instead of stdout.")] = None,
) -> None:
    """Select the seeds of the splits again; tasks and splits not named stay unchanged."""
    from roboirg.apps.split_search.seed_selection import (
        check_kept_splits,
        episode_slots,
        find_seeds,
        merge_splits,
    )
    from roboirg.apps.split_search.seed_summary import follow_progress, print_summary
    from roboirg.evaluation.plan.plan_parsing import parse_names, parse_splits
    from roboirg.tasks import find_tasks
    from roboirg.tasks.splits import splits
    from roboirg.util.atomic_write import write_atomically
    from roboirg.util.console_width import progress_console
    from roboirg.util.processor import core_count

    names = find_tasks(parse_names("task", tasks))
    wanted = parse_splits(split)
    check_kept_splits(names, wanted, splits.shipped_splits())
    if out is not None and not Path(out).parent.is_dir():
        raise InvalidValueError(f"There is no folder for {out!r}; create it first.")
    slots = episode_slots(names, wanted)
    console = progress_console(stderr=True)
    count = core_count() if workers is None else workers
    found = follow_progress(find_seeds(slots, count), slots, console)
    print_summary(found, console)
    text = splits.splits_text(merge_splits(names, found, splits.shipped_splits()))
    if out is None:
        typer.echo(text, nl=False)
    else:
        write_atomically(Path(out), text)


def add_commands(app: typer.Typer) -> None:
    app.command("build-splits")(build_splits)
