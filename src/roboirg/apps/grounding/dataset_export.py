"""Export the grounding dataset: the questions, then the files of each format."""

from __future__ import annotations

import hashlib
from pathlib import Path

from roboirg.apps.grounding.dataset_card import CARD, DatasetFacts, write_card
from roboirg.apps.grounding.dataset_tables import write_parquet, write_tsv
from roboirg.evaluation.grounding_items.grounding_item import GroundingItem, write_items
from roboirg.evaluation.grounding_items.question_set import (
    PARTS,
    ExportRequest,
    Progress,
    collect_items,
)


def export_grounding(
    request: ExportRequest, folder: Path, workers: int, progress: Progress | None = None
) -> DatasetFacts:
    """Write the dataset; return its facts.

    Args:
        request: what it holds.
        folder: created if missing; a dataset of the same request is continued.
        workers: worker processes; 0 uses this process only.
        progress: called with the number of episodes that are done, and of all.

    Raises:
        InvalidValueError: the folder holds another dataset or cannot be written, or nothing is to
            be exported.
        MissingDependencyError: pyarrow is not installed.
        RoboIRGError: a thing that is meant cannot be seen, or a video cannot be played.
    """
    return _write_files(folder, collect_items(request, folder, workers, progress), request)


def _write_files(folder: Path, items: list[GroundingItem], request: ExportRequest) -> DatasetFacts:
    content = write_items(items, folder)
    splits = tuple(dict.fromkeys(one.split for one in items))
    for split in splits:
        own = [one for one in items if one.split == split]
        write_parquet(own, folder, split)
        write_tsv(own, folder, split)
    facts = DatasetFacts.of(items, hashlib.sha256(content).hexdigest(), _size(folder), splits)
    write_card(folder, facts, request.frames, request.frames_every)
    return facts


def _size(folder: Path) -> int:
    """Return the size of all files of the dataset but its card, bytes."""
    return sum(
        path.stat().st_size
        for path in folder.rglob("*")
        if path.is_file() and path.parent.name != PARTS and path.name != CARD
    )
