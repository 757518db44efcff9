"""An instruction as a row of plain JSON values; docs/grounding.md explains the columns."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from roboirg.core.episode import Episode
from roboirg.language.instruction import Instruction
from roboirg.language.token_counts import count_tokens
from roboirg.tasks import get_task

ExportRow = dict[str, Any]
"""Plain JSON values by column."""
_RIVAL = ("rival", "rival_slot", "rival_position", "rival_reference")


def row(episode: Episode, instruction: Instruction) -> ExportRow:
    """Return an instruction as a row of plain JSON values by column.

    `docs/grounding.md` explains the columns. All rows have the same columns and types.
    """
    metadata: Mapping[str, Any] = instruction.metadata
    return {
        "id": f"{episode.key}/{instruction.setting}/{instruction.form}",
        "task": episode.task,
        "suite": get_task(episode.task).suite,
        "split": episode.split,
        "episode": episode.index,
        "seed": episode.seed,
        "difficulty": episode.difficulty,
        "setting": instruction.setting,
        "form": instruction.form,
        "text": instruction.text,
        "command": instruction.command,
        "turns": _utterance_rows(instruction),
        "mentions": _mention_rows(instruction),
        "words": len(instruction.text.split()),
        "tokens": count_tokens(instruction.text),
        # As text, because each task has its own slots.
        "goal": json.dumps(episode.goal.as_mapping()),
        **_copied(metadata, "pattern", "patterns", "relation"),
        "references": _texts(metadata["reference"]),
        **_copied(metadata, "landmarks", "landmark_classes", "frame"),
        **_copied(metadata, "stages", "distractor", "distractors"),
        "touched": ", ".join(metadata["touched"]) or "none",
        **{name: str(metadata[name] or "none") for name in _RIVAL},
        "draws": metadata["draws"],
        # Never null: readers infer the types of columns.
        "wordings": metadata["wordings"] or "own",
        "pool": metadata["pool"],
        "whole_sentence": metadata["command"],
        "language_version": metadata["language_version"],
        "words_version": metadata["words"],
    }


def _copied(metadata: Mapping[str, Any], *names: str) -> ExportRow:
    """Return some entries of the metadata, under their own names."""
    return {name: metadata[name] for name in names}


def _utterance_rows(instruction: Instruction) -> list[ExportRow]:
    """Return a row for each utterance: its stage, text, and first character in the whole prompt.

    The prompt joins utterances by a space: *Red is nice.* starts at 0, and *Lift it.* after it at
    13.
    """
    rows = []
    start = 0
    for utterance in instruction.utterances:
        rows.append({"stage": utterance.stage, "start": start, "text": utterance.text})
        start += len(utterance.text) + 1  # a space joins two utterances
    return rows


def _mention_rows(instruction: Instruction) -> list[ExportRow]:
    """Return a row for each mention: words that name a value of the goal or point back at one.

    A mention has its characters within its utterance; the row has them within the whole prompt.
    """
    utterance_starts = [turn["start"] for turn in _utterance_rows(instruction)]
    rows = []
    for mention in instruction.mentions:
        utterance_start = utterance_starts[mention.utterance]
        rows.append(
            {
                "turn": mention.utterance,
                "start": utterance_start + mention.start,
                "end": utterance_start + mention.end,
                "text": instruction.span(mention),
                "role": mention.role,
                "expression": mention.expression,
                "slot": mention.slot,
                "value": str(mention.value),
            }
        )
    return rows


def _texts(value: object) -> list[str]:
    """Return a value as a list of texts: ``3`` and ``[3]`` give ``["3"]``, None ``[]``."""
    if value is None:
        return []
    if isinstance(value, list):
        return [str(item) for item in value]
    return [str(value)]
