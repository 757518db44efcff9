"""Export the grounding dataset: the questions, the tables, and the card that says what they are."""

from __future__ import annotations

import hashlib
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from roboirg.apps.grounding.dataset_tables import write_parquet
from roboirg.apps.grounding.items.grounding_item import (
    ITEMS_FILE,
    GroundingItem,
    write_items,
)
from roboirg.apps.grounding.items.question_set import ExportRequest, Progress, collect_items
from roboirg.core.licenses import PICTURE_LICENSE, TERMS
from roboirg.core.version import __version__
from roboirg.util.atomic_write import write_atomically

CARD = "README.md"
_MIB = 2**20
_CARD = """\
---
license: {picture_license}
language: [en]
task_categories: [visual-question-answering, multiple-choice, robotics]
tags: [robotics, RoboIRGBench, "arxiv:2609.34384"]
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

- {terms}
- {facts.items:,} items; {facts.pictures:,} pictures and {facts.videos:,} videos, each stored once.
- Size of all files: {size:.1f} MiB.
- SHA-256 of `{items_file}`, which names every file by its content: `{facts.sha256}`.
- Videos have every {every}th control step (20 per second) of the front camera; `frames` are at \
most {frames} of them, evenly spaced.

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
    """Write a dataset of grounding questions; return its size and a digest of its content.

    It has a file of items, Parquet files for each split, pictures, videos, and a card.

    Args:
        request: which episodes, settings and options the questions are of.
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
    for split, items_of_split in _by_split(items).items():
        write_parquet(items_of_split, folder, split)
    facts = DatasetFacts(
        items=len(items),
        pictures=len(_pictures(items)),
        videos=len({item.video for item in items if item.video is not None}),
        sha256=hashlib.sha256(content).hexdigest(),
        size=_size(folder),
    )
    write_atomically(folder / CARD, _card(request, items, facts))
    return facts


def _by_split(items: Sequence[GroundingItem]) -> dict[str, list[GroundingItem]]:
    """Return the items of each split, in order."""
    found = defaultdict(list)
    for item in items:
        found[item.split].append(item)
    return found


def _pictures(items: Sequence[GroundingItem]) -> set[str]:
    """Return the paths of all pictures of the items: first pictures, and frames of videos."""
    found = set()
    for item in items:
        found.add(item.picture)
        found.update(item.frames)
    return found


def _size(folder: Path) -> int:
    """Return the size of all files of the dataset but its card, bytes."""
    size = 0
    for path in folder.rglob("*"):
        if path.is_file() and path.name != CARD:
            size += path.stat().st_size
    return size


def _card(request: ExportRequest, items: Sequence[GroundingItem], facts: DatasetFacts) -> str:
    """Return the dataset's README.md: Markdown with a head of YAML, which Hugging Face reads."""
    files = [f"  - split: {split}\n    path: data/{split}-*.parquet" for split in _by_split(items)]
    return _CARD.format(
        facts=facts,
        first=items[0],
        size=facts.size / _MIB,
        files="\n".join(files),
        package=__version__,
        items_file=ITEMS_FILE,
        frames=request.frames,
        every=request.frames_every,
        picture_license=PICTURE_LICENSE,
        terms=TERMS,
    )
