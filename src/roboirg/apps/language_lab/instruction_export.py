"""Export of instructions: one row for each episode, setting and form, in JSON lines or Parquet.

All rows have the same columns and types, so that pandas and Hugging Face `datasets` load them
directly; `docs/instruction-data.md` explains the columns.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, get_args

from roboirg.language.instruction_row import ExportRow
from roboirg.util.atomic_write import write_atomically
from roboirg.util.parquet_support import check_parquet_support

ExportFormat = Literal["jsonl", "parquet"]
EXPORT_FORMATS: tuple[ExportFormat, ...] = get_args(ExportFormat)


def encode(rows: Iterable[ExportRow], kind: ExportFormat) -> bytes:
    """Return the content of a file with the rows; the same rows give the same bytes.

    In Parquet, the bytes also depend on the version of pyarrow.
    """
    return _ENCODERS[kind](rows)


def check_export_support(kind: ExportFormat) -> None:
    """Check early that a format can be written."""
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
    """Write the rows to a file, atomically."""
    write_atomically(path, encode(rows, kind))
