"""Export the grounding dataset: the questions, the tables, and the card that says what they are."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from roboirg.apps.grounding.dataset_tables import write_parquet
from roboirg.core.version import __version__
from roboirg.evaluation.grounding_items.grounding_item import (
    ITEMS_FILE,
    GroundingItem,
    write_items,
)
from roboirg.evaluation.grounding_items.question_set import ExportRequest, Progress, collect_items
from roboirg.language.settings import setting_names
from roboirg.util.atomic_write import write_atomically

CARD = "README.md"
_MIB = 2**20
_CARD = """\
---
license: apache-2.0
language: [en]
task_categories: [visual-question-answering, multiple-choice]
configs:
- config_name: default
  data_files:
{files}
---

# RoboIRGBench: grounding

Given what was shown, what is visible and what was said: what is meant? These items test implicit \
references in instructions to a robot, without the robot. Made by `roboirg export grounding` of \
RoboIRGBench {package}, language {first.language_version}, environment \
{first.environment_version}. Each item has the answer as slots, as a choice, and as pixels with \
masks.

- License: Apache-2.0 (`apache-2.0`), as RoboIRGBench's.
- {facts.items:,} items; {facts.pictures:,} pictures and {facts.videos:,} videos, each stored once.
- Size of all files: {size:.1f} MiB.
- SHA-256 of `{items_file}`, which names every file by its content: `{facts.sha256}`.
- Videos have every {every}th control step (20 per second) of the front camera; `frames` are at \
most {frames} of them, evenly spaced.

{counts}

```python
pandas.read_json("{items_file}", lines=True)
pandas.read_parquet("data/{first.split}-00000-of-00001.parquet")
datasets.load_dataset("parquet", data_files="data/{first.split}-*.parquet")
```

Score answers with `roboirg score grounding ANSWERS --data .`.
"""


class DatasetFacts(NamedTuple):
    """How large a dataset is.

    Attributes:
        items: number of items.
        pictures: number of distinct pictures.
        videos: number of distinct videos.
        sha256: of `items.jsonl`, in hexadecimal; it names every picture by its content.
        size: of all files but the card, bytes.
    """

    items: int
    pictures: int
    videos: int
    sha256: str
    size: int


def export_grounding(
    request: ExportRequest, folder: Path, workers: int, progress: Progress | None = None
) -> DatasetFacts:
    """Write the dataset; return its facts.

    Args:
        request: what it holds.
        folder: created if missing, else empty.
        workers: worker processes; 0 uses this process only.
        progress: called with the number of episodes that are done, and of all.

    Raises:
        InvalidValueError: the folder is not empty or cannot be written, or nothing is to be
            exported.
        MissingDependencyError: pyarrow is not installed.
        RoboIRGError: a thing that is meant cannot be seen, or a video cannot be played.
    """
    items = collect_items(request, folder, workers, progress)
    content = write_items(items, folder)
    splits = tuple(dict.fromkeys(one.split for one in items))
    for split in splits:
        write_parquet([one for one in items if one.split == split], folder, split)
    facts = DatasetFacts(
        items=len(items),
        pictures=len({path for item in items for path in (item.picture, *item.frames)}),
        videos=len({item.video for item in items} - {None}),
        sha256=hashlib.sha256(content).hexdigest(),
        size=_size(folder),
    )
    card = _CARD.format(
        facts=facts,
        first=items[0],
        size=facts.size / _MIB,
        files="\n".join(f"  - split: {one}\n    path: data/{one}-*.parquet" for one in splits),
        counts=_counts(items),
        package=__version__,
        items_file=ITEMS_FILE,
        frames=request.frames,
        every=request.frames_every,
    )
    write_atomically(folder / CARD, card)
    return facts


def _size(folder: Path) -> int:
    """Return the size of all files of the dataset but its card, bytes."""
    return sum(
        path.stat().st_size for path in folder.rglob("*") if path.is_file() and path.name != CARD
    )


def _counts(items: Sequence[GroundingItem]) -> str:
    """Return a table of the numbers of items by task and setting."""
    found = Counter((item.task, item.setting) for item in items)
    settings = [name for name in setting_names() if any(name == one for _, one in found)]
    lines = [f"| task | {' | '.join(settings)} |", f"| --- |{' ---: |' * len(settings)}"]
    for task in dict.fromkeys(task for task, _ in found):
        numbers = (str(found[task, setting] or "–") for setting in settings)
        lines.append(f"| {task} | {' | '.join(numbers)} |")
    return "\n".join(lines)
