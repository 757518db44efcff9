"""The card of a dataset: what it holds, how large it is, and how to load it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple, Self

from roboirg.apps.grounding.dataset_tables import TSV_FOLDER
from roboirg.core.version import __version__
from roboirg.evaluation.grounding_items.grounding_item import ITEMS_FILE, GroundingItem
from roboirg.language.settings import setting_names
from roboirg.util.atomic_write import write_atomically

CARD = "README.md"
LICENSE = "apache-2.0"
_MIB = 2**20


class DatasetFacts(NamedTuple):
    """What a dataset holds.

    Attributes:
        items: number of items.
        by_task: number of items by task and setting.
        by_choices: number of items by number of choices.
        by_place: number of items by letter of the right choice.
        pictures: number of distinct pictures.
        videos: number of distinct videos.
        sha256: of `items.jsonl`, in hexadecimal; it names every picture by its content.
        size: of all files, bytes.
        splits: names of the splits.
        versions: of the language and of the environment.
    """

    items: int
    by_task: dict[str, Counter[str]]
    by_choices: list[tuple[int, int]]
    by_place: list[tuple[str, int]]
    pictures: int
    videos: int
    sha256: str
    size: int
    splits: tuple[str, ...]
    versions: tuple[str, int]

    @classmethod
    def of(
        cls,
        items: Sequence[GroundingItem],
        sha256: str,
        size: int,
        splits: tuple[str, ...],
    ) -> Self:
        """Count items."""
        by_task: dict[str, Counter[str]] = {}
        for item in items:
            by_task.setdefault(item.task, Counter())[item.setting] += 1
        return cls(
            items=len(items),
            by_task=by_task,
            by_choices=sorted(Counter(len(item.choices) for item in items).items()),
            by_place=sorted(Counter(item.choice for item in items).items()),
            pictures=len({path for item in items for path in (item.picture, *item.frames)}),
            videos=len({item.video for item in items} - {None}),
            sha256=sha256,
            size=size,
            splits=splits,
            versions=(items[0].language_version, items[0].environment_version),
        )


def write_card(folder: Path, facts: DatasetFacts, frames: int, every: int) -> None:
    """Write the card of a dataset.

    Args:
        folder: of the dataset.
        facts: what it holds.
        frames: maximum of the frames of a video.
        every: control steps between two frames.
    """
    write_atomically(folder / CARD, "\n".join(_lines(facts, frames, every)) + "\n")


def _lines(facts: DatasetFacts, frames: int, every: int) -> Iterator[str]:
    yield from _front_matter(facts)
    language, environment = facts.versions
    yield "# RoboIRGBench: grounding"
    yield ""
    yield (
        "Given what was shown, what is visible and what was said: what is meant? These items "
        "test implicit references in instructions to a robot, without the robot. Made by "
        f"`roboirg export grounding` of RoboIRGBench {__version__}, language {language}, "
        f"environment {environment}. Each item has the answer as slots, as a choice, and as "
        "pixels with masks."
    )
    yield ""
    yield f"- License: Apache-2.0 (`{LICENSE}`), as RoboIRGBench's."
    yield (
        f"- {facts.items:,} items; {facts.pictures:,} pictures and {facts.videos:,} videos, each "
        "stored once."
    )
    yield f"- Size of all files: {facts.size / _MIB:.1f} MiB."
    yield f"- SHA-256 of `{ITEMS_FILE}`, which names every file by its content: `{facts.sha256}`."
    yield (
        f"- Videos have every {every}th control step (20 per second) of the front camera; `frames` "
        f"are at most {frames} of them, evenly spaced."
    )
    by_number = ", ".join(f"{count:,} with {number}" for number, count in facts.by_choices)
    by_letter = ", ".join(f"{letter} {count:,}" for letter, count in facts.by_place)
    yield f"- Items by number of choices: {by_number}. Right choices by letter: {by_letter}."
    yield ""
    yield from _counts(facts)
    yield ""
    yield from _usage(facts)


def _front_matter(facts: DatasetFacts) -> Iterator[str]:
    yield "---"
    yield f"license: {LICENSE}"
    yield "language: [en]"
    yield "task_categories: [visual-question-answering, multiple-choice]"
    yield "configs:"
    yield "- config_name: default"
    yield "  data_files:"
    for split in facts.splits:
        yield f"  - split: {split}"
        yield f"    path: data/{split}-*.parquet"
    yield "---"
    yield ""


def _counts(facts: DatasetFacts) -> Iterator[str]:
    found = {setting for counts in facts.by_task.values() for setting in counts}
    settings = [name for name in setting_names() if name in found]
    yield f"| task | {' | '.join(settings)} | all |"
    yield f"| --- |{' ---: |' * (len(settings) + 1)}"
    for task, counts in facts.by_task.items():
        numbers = [str(counts[setting] or "–") for setting in settings]
        yield f"| {task} | {' | '.join(numbers)} | {counts.total()} |"


def _usage(facts: DatasetFacts) -> Iterator[str]:
    split = facts.splits[0]
    yield "```python"
    yield f'pandas.read_json("{ITEMS_FILE}", lines=True)'
    yield f'pandas.read_parquet("data/{split}-00000-of-00001.parquet")'
    yield f'datasets.load_dataset("parquet", data_files="data/{split}-*.parquet")'
    yield "```"
    yield ""
    yield (
        f"Score answers with `roboirg score grounding ANSWERS --data .`; `{TSV_FOLDER}/` has "
        "the choice questions for VLMEvalKit."
    )
