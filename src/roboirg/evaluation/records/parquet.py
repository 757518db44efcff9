"""Export records as a Parquet table for pandas, Polars or DuckDB, one row per episode."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboirg.evaluation.records.record import Record
from roboirg.util.atomic_write import replacing
from roboirg.util.parquet_support import check_parquet_support

if TYPE_CHECKING:
    from pyarrow import Schema

_TEXT_COLUMNS = [
    "policy",
    "task",
    "split",
    "setting",
    "form",
    "distractor",
    "frame",
    "delivery",
    "rival",
    "reasoning",
    "actions",
    "demonstration_frames",
    "meshes",
    "wordings",
    "wordings_file",
    "spec",
    "difficulty",
    "demonstration_source",
    "outcome",
    "error",
    "cause",
    "policy_version",
    "server_version",
    "prompt_verdict",
    "language_version",
    "package_version",
    "code",
    "plan",
    "command",
    "video",
    "video_error",
    "details",
    "render_device",
    "processor",
    "action_log",
    "end_state",
    "started_at",
]
_NUMBER_COLUMNS = [
    "episode",
    "distractors",
    "policy_seed",
    "max_steps",
    "observe_every",
    "seed",
    "steps",
    "demonstration_steps",
    "environment_version",
    "attempt",
    "schema_version",
]
_JSON_COLUMNS = ("goal", "metadata", "policy_metadata", "usage", "timings")
"""Fields whose keys depend on the task or policy."""
_BATCH_ROWS = 5_000


def write_parquet(records: Iterable[Record], path: Path) -> int:
    """Write records to a Parquet file, which appears complete or not at all.

    The columns are the fields of a record. ``instruction``, ``mentions``, ``prompt``, ``events``
    and ``attribution`` are nested; ``goal``, ``metadata``, ``policy_metadata``, ``usage`` and
    ``timings`` are JSON texts.

    Returns:
        Number of rows.

    Raises:
        MissingDependencyError: pyarrow is not installed.
        InvalidValueError: the file cannot be written.
    """
    check_parquet_support()
    import pyarrow as pa
    from pyarrow import parquet

    schema, count = _schema(), 0
    rows = map(_row, records)
    with (
        replacing(path) as partial,
        parquet.ParquetWriter(partial, schema, compression="zstd") as writer,
    ):
        while batch := list(itertools.islice(rows, _BATCH_ROWS)):
            writer.write_table(pa.Table.from_pylist(batch, schema=schema))
            count += len(batch)
    return count


def _row(record: Record) -> dict[str, Any]:
    data = record.model_dump(mode="json")
    for name in _JSON_COLUMNS:
        data[name] = json.dumps(data[name], ensure_ascii=False)
    frames = data["demonstration_frames"]
    data["demonstration_frames"] = None if frames is None else str(frames)
    for mention in data["mentions"]:
        mention["value"] = str(mention["value"])
    return data


def _schema() -> Schema:
    import pyarrow as pa

    text, number, truth = pa.string(), pa.int64(), pa.bool_()
    known = {
        **dict.fromkeys((*_TEXT_COLUMNS, *_JSON_COLUMNS), text),
        **dict.fromkeys(_NUMBER_COLUMNS, number),
        "privileged": truth,
        "duration_s": pa.float64(),
        "stages": pa.list_(number),
        "prompt": pa.struct(
            {
                "limit": number,
                **dict.fromkeys(("needed", "reached", "lost"), pa.list_(number)),
                "tokenizer": text,
            }
        ),
        "attribution": pa.struct(
            {"kind": text, "failure": text, "subject": text, "step": number, "sentence": text}
        ),
        "instruction": pa.list_(pa.struct({"stage": text, "text": text, "step": number})),
        "mentions": pa.list_(
            pa.struct(
                {
                    **dict.fromkeys(("utterance", "start", "end"), number),
                    **dict.fromkeys(("role", "expression", "slot", "value"), text),
                }
            )
        ),
        "events": pa.list_(
            pa.struct(
                {"step": number, "kind": text, "subject": text, "place": text, "holds": truth}
            )
        ),
    }
    return pa.schema({name: known[name] for name in Record.model_fields})
