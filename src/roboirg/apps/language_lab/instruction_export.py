"""Export of instructions: one row for each episode, setting and form, in JSON lines or Parquet.

All rows have the same columns and types, so that pandas and Hugging Face `datasets` load them
directly; `docs/grounding.md` explains the columns.
"""

from __future__ import annotations

import io
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Literal, get_args

from roboirg.core.episode import Episode
from roboirg.core.errors import known_name
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language.instruction_row import ExportRow, row
from roboirg.language.variants import instructions
from roboirg.util.parquet_support import check_parquet_support

ExportFormat = Literal["jsonl", "parquet"]
EXPORT_FORMATS: tuple[ExportFormat, ...] = get_args(ExportFormat)
_NUMBERS = ("episode", "seed", "words", "tokens", "distractors")
_NUMBER_LISTS = ("landmark_classes", "stages")
_TEXT_LISTS = ("patterns", "references", "landmarks", "draws")
"""Columns that are no texts; `turns` and `mentions` are lists of rows of their own."""


def rows_of(
    episodes: Iterable[Episode],
    settings: Sequence[str],
    forms: Sequence[str],
    options: InstructionOptions,
) -> list[ExportRow]:
    """Return a row for each instruction that episodes have in some settings and forms.

    Settings that a task lacks, or that cannot express an episode, have none.
    """
    said = instructions(episodes, settings, forms, options)
    return [row(episode, instruction) for episode, instruction in said]


def encode(rows: Sequence[ExportRow], kind: ExportFormat) -> bytes:
    """Return the content of a file with the rows; the same rows give the same bytes.

    In Parquet, the bytes also depend on the version of pyarrow.
    """
    if kind == "parquet":
        return _parquet(rows)
    return _jsonl(rows)


def format_of(path: Path) -> ExportFormat:
    """Return the format that the ending of a file names: ``words.parquet`` gives ``parquet``.

    Raises:
        UnknownNameError: no format has that ending.
        MissingDependencyError: it needs a package that is not installed.
    """
    kind = known_name("format", path.suffix.removeprefix("."), EXPORT_FORMATS)
    if kind == "parquet":
        check_parquet_support()
    return kind


def _jsonl(rows: Sequence[ExportRow]) -> bytes:
    """Return a line of JSON for each row, in UTF-8."""
    return "".join(f"{json.dumps(columns, ensure_ascii=False)}\n" for columns in rows).encode()


def _parquet(rows: Sequence[ExportRow]) -> bytes:
    """Return the content of a Parquet file with the rows.

    All rows must have the columns of the first one. Columns are texts unless `_NUMBERS` or one of
    the lists of columns next to it names them.
    """
    check_parquet_support()
    import pyarrow as pa
    from pyarrow import parquet

    text = pa.string()
    number = pa.int64()
    turn = pa.struct({"stage": text, "start": number, "text": text})
    mention = pa.struct(
        {
            "turn": number,
            "start": number,
            "end": number,
            "text": text,
            "role": text,
            "expression": text,
            "slot": text,
            "value": text,
        }
    )
    types = dict.fromkeys(rows[0], text)  # later lines replace the type of some columns
    types |= dict.fromkeys(_NUMBERS, number)
    types |= dict.fromkeys(_NUMBER_LISTS, pa.list_(number))
    types |= dict.fromkeys(_TEXT_LISTS, pa.list_(text))
    types |= {"turns": pa.list_(turn), "mentions": pa.list_(mention)}
    schema = pa.schema([(name, types[name]) for name in rows[0]])
    table = pa.Table.from_pylist(list(rows), schema=schema)
    file = io.BytesIO()
    parquet.write_table(table, file, compression="zstd")
    return file.getvalue()
