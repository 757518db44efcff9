"""Instructions as a table: one row for each episode, setting and form, in JSON lines or Parquet.

Every row has the same columns of the same types, so that pandas and Hugging Face `datasets` load
it as it is; `docs/language.md` explains the columns.
"""

from __future__ import annotations

import io
import itertools
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, get_args

from roboirg.core.episode import Episode
from roboirg.core.errors import InvalidValueError, MissingDependencyError
from roboirg.language.instruction import Instruction
from roboirg.tasks import get_task

Format = Literal["jsonl", "parquet"]
EXPORT_FORMATS: tuple[Format, ...] = get_args(Format)

Row = dict[str, Any]
"""Plain JSON values by column."""


def row(episode: Episode, instruction: Instruction) -> Row:
    """All that is known about one instruction; the columns are in `docs/language.md`."""
    about: Mapping[str, Any] = instruction.metadata
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
        # As text, because every task has slots of its own.
        "goal": json.dumps(episode.goal.as_mapping()),
        "pattern": about["pattern"],
        "patterns": about["patterns"],
        "relation": about["relation"],
        "references": _texts(about["reference"]),
        "landmarks": about["landmarks"],
        "landmark_classes": about["landmark_classes"],
        "frame": about["frame"],
        "stages": about["stages"],
        "distractor": about["distractor"],
        "distractors": about["distractors"],
        "templates": about["templates"],
        "language_version": about["language_version"],
    }


def _turns(instruction: Instruction) -> list[Row]:
    """Each utterance, and where in the prompt it begins."""
    lengths = [len(utterance.text) + 1 for utterance in instruction.utterances]
    starts = itertools.accumulate(lengths, initial=0)
    return [
        {"stage": utterance.stage, "start": start, "text": utterance.text}
        for utterance, start in zip(instruction.utterances, starts, strict=False)
    ]


def _mentions(instruction: Instruction) -> list[Row]:
    """Each mention; its span counts in the whole prompt."""
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


def encoded(rows: Iterable[Row], kind: Format) -> bytes:
    """The rows as a file; the same rows give the same bytes (Parquet: with the same pyarrow).

    Raises:
        MissingDependencyError: Parquet needs pyarrow.
    """
    return _ENCODERS[kind](rows)


def check_export_support(kind: Format) -> None:
    """See before the work starts that a format can be written.

    Raises:
        MissingDependencyError: Parquet needs pyarrow.
    """
    if kind != "parquet":
        return
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError as error:
        raise MissingDependencyError(
            "Parquet files need pyarrow: pip install 'roboirgbench[export]'; "
            "or ask for --format jsonl."
        ) from error


def _jsonl(rows: Iterable[Row]) -> bytes:
    return "".join(f"{json.dumps(one, ensure_ascii=False)}\n" for one in rows).encode()


def _parquet(rows: Iterable[Row]) -> bytes:
    check_export_support("parquet")
    import pyarrow as pa
    from pyarrow import parquet

    text, number = pa.string(), pa.int64()
    texts, numbers = pa.list_(text), pa.list_(number)
    special = {
        **dict.fromkeys(("episode", "seed", "words", "distractors"), number),
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


def _struct(*fields: tuple[str, Any]) -> Any:  # noqa: ANN401 - it ships no types
    import pyarrow as pa

    return pa.struct(list(fields))


_ENCODERS: Mapping[Format, Callable[[Iterable[Row]], bytes]] = {
    "jsonl": _jsonl,
    "parquet": _parquet,
}


def write_rows(rows: Iterable[Row], path: Path, kind: Format) -> None:
    """Write the rows to a file, which is replaced whole.

    Raises:
        MissingDependencyError: Parquet needs pyarrow.
        InvalidValueError: the file cannot be written.
    """
    data = encoded(rows, kind)
    partial = path.with_name(f".{path.name}.part")
    try:
        partial.write_bytes(data)
        partial.replace(path)
    except OSError as error:
        raise InvalidValueError(f"Cannot write {path}: {error.strerror}.") from error
