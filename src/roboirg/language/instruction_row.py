"""An instruction as a row of plain JSON values; docs/instruction-data.md explains the columns."""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping
from typing import Any

from roboirg.core.episode import Episode
from roboirg.language.instruction import Instruction
from roboirg.language.token_counts import count_tokens
from roboirg.tasks import get_task

ExportRow = dict[str, Any]
"""Plain JSON values by column."""


def row(episode: Episode, instruction: Instruction) -> ExportRow:
    """Return an instruction as a row; `docs/instruction-data.md` explains the columns."""
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
        "turns": _turns(instruction),
        "mentions": _mentions(instruction),
        "words": len(instruction.text.split()),
        "tokens": count_tokens(instruction.text),
        # As text, because each task has its own slots.
        "goal": json.dumps(episode.goal.as_mapping()),
        "pattern": metadata["pattern"],
        "patterns": metadata["patterns"],
        "relation": metadata["relation"],
        "references": _texts(metadata["reference"]),
        "landmarks": metadata["landmarks"],
        "landmark_classes": metadata["landmark_classes"],
        "frame": metadata["frame"],
        "stages": metadata["stages"],
        "distractor": metadata["distractor"],
        "distractors": metadata["distractors"],
        "touched": ", ".join(metadata["touched"]) or "none",
        "rival": str(metadata["rival"] or "none"),
        "rival_slot": metadata["rival_slot"] or "none",
        "rival_position": metadata["rival_position"] or "none",
        "rival_reference": metadata["rival_reference"] or "none",
        "templates": metadata["templates"],
        # Never null: readers infer the types of columns.
        "wordings": metadata["wordings"] or "own",
        "pool": metadata["pool"],
        "command_template": metadata["command"],
        "language_version": metadata["language_version"],
        "words_version": metadata.get("words", "none"),
    }


def _turns(instruction: Instruction) -> list[ExportRow]:
    """Return the utterances, each with its position in the prompt."""
    lengths = [len(utterance.text) + 1 for utterance in instruction.utterances]
    starts = itertools.accumulate(lengths, initial=0)
    return [
        {"stage": utterance.stage, "start": start, "text": utterance.text}
        for utterance, start in zip(instruction.utterances, starts, strict=False)
    ]


def _mentions(instruction: Instruction) -> list[ExportRow]:
    """Return the mentions, with their positions in the prompt."""
    starts = [turn["start"] for turn in _turns(instruction)]
    return [
        {
            "turn": mention.utterance,
            "start": starts[mention.utterance] + mention.start,
            "end": starts[mention.utterance] + mention.end,
            "text": instruction.span(mention),
            "role": mention.role,
            "expression": mention.expression,
            "slot": mention.slot,
            "value": str(mention.value),
        }
        for mention in instruction.mentions
    ]


def _texts(value: object) -> list[str]:
    if value is None:
        return []
    return [str(one) for one in (value if isinstance(value, list) else [value])]
