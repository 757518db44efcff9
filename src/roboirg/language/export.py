"""Export of instructions: one row for each episode, setting and form, in JSON lines or Parquet.

All rows have the same columns and types, so that pandas and Hugging Face `datasets` load them
directly; `docs/language.md` explains the columns.
"""

from __future__ import annotations

import io
import itertools
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, get_args

from roboirg.core.episode import Episode
from roboirg.language.instruction import Instruction
from roboirg.language.token_counts import count_tokens
from roboirg.tasks import get_task
from roboirg.util.atomic_write import write_atomically
from roboirg.util.parquet_support import check_parquet_support

ExportFormat = Literal["jsonl", "parquet"]
EXPORT_FORMATS: tuple[ExportFormat, ...] = get_args(ExportFormat)

ExportRow = dict[str, Any]
"""Plain JSON values by column."""


def row(episode: Episode, instruction: Instruction) -> ExportRow:
    """Return an instruction as a row; `docs/language.md` explains the columns."""
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
        "rival": str(metadata["rival"] or "none"),
        "rival_slot": metadata["rival_slot"] or "none",
        "rival_position": metadata["rival_position"] or "none",
        "rival_reference": metadata["rival_reference"] or "none",
        "reasoning": metadata["reasoning"] or "none",
        "templates": metadata["templates"],
        # Never null: readers infer the types of columns.
        "wordings": metadata["wordings"] or "own",
        "pool": metadata["pool"],
        "command_template": metadata["command"],
        "language_version": metadata["language_version"],
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


def encode(rows: Iterable[ExportRow], kind: ExportFormat) -> bytes:
    """Return the content of a file with the rows; the same rows give the same bytes.

    In Parquet, the bytes also depend on the version of pyarrow.

    Raises:
        MissingDependencyError: the format is Parquet, and pyarrow is not installed.
    """
    return _ENCODERS[kind](rows)


def check_export_support(kind: ExportFormat) -> None:
    """Check early that a format can be written.

    Raises:
        MissingDependencyError: the format is Parquet, and pyarrow is not installed.
    """
    if kind == "parquet":
        check_parquet_support()


def _jsonl(rows: Iterable[ExportRow]) -> bytes:
    return "".join(f"{json.dumps(one, ensure_ascii=False)}\n" for one in rows).encode()


def _parquet(rows: Iterable[ExportRow]) -> bytes:
    check_export_support("parquet")
    import pyarrow as pa
    from pyarrow import parquet

    text, number = pa.string(), pa.int64()
    texts, numbers = pa.list_(text), pa.list_(number)
    special = {
        **dict.fromkeys(("episode", "seed", "words", "tokens", "distractors"), number),
        **dict.fromkeys(("landmark_classes", "stages"), numbers),
        **dict.fromkeys(("patterns", "references", "landmarks", "templates"), texts),
        "turns": pa.list_(_struct(("stage", text), ("start", number), ("text", text))),
        "mentions": pa.list_(
            _struct(
                *((name, number) for name in ("turn", "start", "end")),
                *((name, text) for name in ("text", "role", "expression", "slot", "value")),
            )
        ),
    }
    collected = list(rows)
    names: Sequence[str] = list(collected[0]) if collected else []
    schema = pa.schema([(name, special.get(name, text)) for name in names])
    file = io.BytesIO()
    table = pa.Table.from_pylist(collected, schema=schema)
    parquet.write_table(table, file, compression="zstd")
    return file.getvalue()


def _struct(*fields: tuple[str, Any]) -> Any:  # noqa: ANN401 - pyarrow ships no types
    import pyarrow as pa

    return pa.struct(list(fields))


_ENCODERS: Mapping[ExportFormat, Callable[[Iterable[ExportRow]], bytes]] = {
    "jsonl": _jsonl,
    "parquet": _parquet,
}


def write_rows(rows: Iterable[ExportRow], path: Path, kind: ExportFormat) -> None:
    """Write the rows to a file, atomically.

    Raises:
        MissingDependencyError: the format is Parquet, and pyarrow is not installed.
        InvalidValueError: the file is not writable.
    """
    write_atomically(path, encode(rows, kind))
