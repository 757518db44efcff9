"""Select the seeds of the splits again.

python scripts/build_splits.py --tasks PickXtimes
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import seed_selection
import typer

from roboirg.cli.options import Tasks, Workers
from roboirg.cli.progress_bar import progress_bars
from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.runs.plan.option_parsing import parse_names
from roboirg.tasks import find_tasks
from roboirg.tasks.splits import splits
from roboirg.util.atomic_write import write_atomically
from roboirg.util.processor import worker_count

SHIPPED = Path(splits.__file__).with_name(splits.SPLITS_FILE)


def build_splits(
    tasks: Tasks = "all",
    workers: Workers = None,
    out: Annotated[Path, typer.Option(help="The file to write.")] = SHIPPED,
) -> None:
    """Select the seeds of all splits of some tasks again; those of other tasks stay unchanged."""
    names = find_tasks(parse_names("task", tasks))
    if not out.parent.is_dir():
        raise InvalidValueError(f"There is no folder for '{out}'; create it first.")
    slots = seed_selection.episode_slots(names)
    count = worker_count(workers)
    found: list[seed_selection.SelectedSeed] = []
    with progress_bars() as report:
        for selected in seed_selection.find_seeds(slots, count):
            found.append(selected)
            report("episodes", len(found), len(slots), selected.slot.key)
    for slot, rejections in found:
        for seed, reason, cause in rejections:
            typer.echo(f"{slot.key}: seed {seed} is rejected, {reason}: {cause}", err=True)
    built = seed_selection.merge_splits(names, found, splits.shipped_splits())
    write_atomically(out, seed_selection.splits_text(built))


if __name__ == "__main__":
    try:
        typer.run(build_splits)
    except RoboIRGError as error:
        sys.exit(str(error))
