"""Hashes of what is said: instructions, what the interpreter finds in them, arms, prompts."""

from __future__ import annotations

import dataclasses
import hashlib
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from language_variants import expressible_options

import roboirg
from roboirg.core.arms import ARMS, PARAPHRASE, TOLD
from roboirg.core.episode import Episode
from roboirg.core.errors import InvalidValueError
from roboirg.core.word_pools import POOLS
from roboirg.language import instruct_with
from roboirg.language.arms import ArmWords, say_arm
from roboirg.reader import interpret
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import SIZES, get_episode

SETTINGS = ("explicit", "direct", "reasoning", "contextual", "spatial", "direct-rival", "grounded")
PROMPTS = Path(roboirg.__file__).parent / "policies" / "vlm" / "prompts"


def texts(folder: Path) -> dict[str, str]:
    """Return a line with a hash for each task, setting and form, by split, pool, or kind."""
    del folder
    found = {split: _lines(split, SIZES[split]) for split in ("train", "val", "test")}
    found |= {f"val-in-{pool}-words": _lines("val", 20, pool) for pool in POOLS}
    found["arms"] = _hashed(_arms())
    found["read"] = _hashed(_read())
    prompts = sorted(PROMPTS.glob("*.toml"))
    found["prompts"] = _hashed(((path.name,), path.read_text("utf-8")) for path in prompts)
    return found


def _lines(split: str, most: int, pool: str | None = None) -> str:
    return _hashed(
        (
            (episode.task, options.setting, options.form),
            " ".join(
                (
                    *(episode.key, repr(options.stages), options.distractor, options.frame),
                    *(repr(said.turns), repr(said.mentions), repr(dict(said.metadata))),
                )
            ),
        )
        for episode in _episodes(split, most)
        for options in expressible_options(episode, pool)
        if options.setting in SETTINGS
        for said in [instruct_with(episode, options)]
    )


def _arms() -> Iterator[tuple[tuple[str, ...], str]]:
    arms = [f"{PARAPHRASE}-1" if name == PARAPHRASE else name for name in ARMS if name != TOLD]
    for episode in _episodes("val", 8):
        for options in expressible_options(episode):
            if options.setting not in SETTINGS or options.form == "resolved":
                continue
            for arm in arms:
                try:
                    said = _in_order(say_arm(episode, options, arm))
                except InvalidValueError:
                    said = None
                yield (episode.task, options.setting, arm), repr(said)


def _in_order(said: ArmWords) -> ArmWords:
    """Return the words of an arm with a tuple for a set, whose order is another in each process."""
    meaning = said.instruction.meaning
    if meaning is None:
        return said
    ordered: Any = meaning._replace(settled=tuple(sorted(meaning.settled)))
    return said._replace(instruction=dataclasses.replace(said.instruction, meaning=ordered))


def _read() -> Iterator[tuple[tuple[str, ...], str]]:
    for episode in _episodes("val", 10):
        for options in expressible_options(episode):
            if options.setting in SETTINGS:
                said = instruct_with(episode, options)
                found = interpret(said.text, episode.scene, episode.task)
                goals = [dataclasses.astuple(goal) for goal in found.goals]
                yield (episode.task, options.setting, options.form), repr(goals)


def _episodes(split: str, most: int) -> Iterator[Episode]:
    for task in every_task():
        for index in range(min(most, SIZES[split])):
            yield get_episode(task, split, index)


def _hashed(found: Iterator[tuple[tuple[str, ...], str]]) -> str:
    """Return a line for each key with the number and hash of its texts, in the order of keys."""
    kept = defaultdict(list)
    for key, text in found:
        kept[key].append(text)
    hashes = {key: hashlib.sha256("\n".join(some).encode()) for key, some in kept.items()}
    return "".join(
        f"{' '.join(key)} {len(kept[key])} {hashes[key].hexdigest()[:16]}\n" for key in sorted(kept)
    )
