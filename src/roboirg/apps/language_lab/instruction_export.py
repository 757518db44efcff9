"""Export of instructions: one row for each episode, setting and form, in JSON lines or Parquet.

All rows have the same columns and types, so that pandas and Hugging Face `datasets` load them
directly; `docs/instruction-data.md` explains the columns.
"""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from typing import Literal, get_args

from roboirg.language.instruction_row import ExportRow
from roboirg.util.parquet_support import check_parquet_support

ExportFormat = Literal["jsonl", "parquet"]
EXPORT_FORMATS: tuple[ExportFormat, ...] = get_args(ExportFormat)


def encode(rows: Sequence[ExportRow], kind: ExportFormat) -> bytes:
    """Return the content of a file with the rows; the same rows give the same bytes.

    In Parquet, the bytes also depend on the version of pyarrow.
    """
    return _parquet(rows) if kind == "parquet" else _jsonl(rows)


def check_export_support(kind: ExportFormat) -> None:
    """Check early that a format can be written."""
    if kind == "parquet":
        check_parquet_support()


def _jsonl(rows: Sequence[ExportRow]) -> bytes:
    return "".join(f"{json.dumps(one, ensure_ascii=False)}\n" for one in rows).encode()


def _parquet(rows: Sequence[ExportRow]) -> bytes:
    check_export_support("parquet")
    import pyarrow as pa
    from pyarrow import parquet

    text, number = pa.string(), pa.int64()
    texts, numbers = pa.list_(text), pa.list_(number)
    special = {
        **dict.fromkeys(("episode", "seed", "words", "tokens", "distractors"), number),
        **dict.fromkeys(("landmark_classes", "stages"), numbers),
        **dict.fromkeys(("patterns", "references", "landmarks", "templates"), texts),
        "turns": pa.list_(pa.struct([("stage", text), ("start", number), ("text", text)])),
        "mentions": pa.list_(
            pa.struct(
                [
                    *((name, number) for name in ("turn", "start", "end")),
                    *((name, text) for name in ("text", "role", "expression", "slot", "value")),
                ]
            )
        ),
    }
    schema = pa.schema([(name, special.get(name, text)) for name in rows[0]])
    file = io.BytesIO()
    table = pa.Table.from_pylist(list(rows), schema=schema)
    parquet.write_table(table, file, compression="zstd")
    return file.getvalue()
