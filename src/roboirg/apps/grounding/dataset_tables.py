"""The items as a table in Parquet, with their pictures."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from roboirg.evaluation.grounding_items.grounding_item import GroundingItem
from roboirg.util.atomic_write import replacing
from roboirg.util.parquet_support import check_parquet_support

DATA = "data"
ROWS_PER_GROUP = 256
_DICTIONARY_LIMIT = 1 << 30
"""Bytes of a column's distinct values in a row group: so that each picture is stored once in it."""

_NUMBERS = ("episode", "distractors", "video_steps", "environment_version")
_TEXT_LISTS = (
    "turns", "choices", "answers", "goals", "choice_answers", "hidden_slots", "expressions",
)  # fmt: skip


def write_parquet(items: Sequence[GroundingItem], folder: Path, split: str) -> None:
    """Write the items of a split with their pictures inside, for pandas and `datasets`.

    Pictures are columns of the type Image of `datasets`, which loads the file without options.
    """
    check_parquet_support()
    import pyarrow as pa
    from pyarrow import parquet

    schema = _arrow_schema()
    path = folder / DATA / f"{split}-00000-of-00001.parquet"
    contents: dict[str, bytes] = {}
    dictionaries = ["picture.bytes", "frames.list.element.bytes", *schema.names]
    with (
        replacing(path) as part,
        parquet.ParquetWriter(
            part,
            schema,
            compression="zstd",
            use_dictionary=dictionaries,
            dictionary_pagesize_limit=_DICTIONARY_LIMIT,
        ) as writer,
    ):
        for start in range(0, len(items), ROWS_PER_GROUP):
            rows = [_row(one, folder, contents) for one in items[start : start + ROWS_PER_GROUP]]
            writer.write_table(pa.Table.from_pylist(rows, schema=schema))


def _row(item: GroundingItem, folder: Path, contents: dict[str, bytes]) -> dict[str, Any]:
    row: dict[str, Any] = msgspec.to_builtins(item)

    def picture(path: str) -> Mapping[str, Any]:
        if path not in contents:
            contents[path] = (folder / path).read_bytes()
        return {"bytes": contents[path], "path": path}

    row["picture"], row["frames"] = picture(item.picture), list(map(picture, item.frames))
    return row


def _arrow_schema() -> Any:  # noqa: ANN401 - pyarrow ships no types
    import pyarrow as pa

    text, number = pa.string(), pa.int64()
    picture = pa.struct([("bytes", pa.binary()), ("path", text)])
    point = pa.struct(
        [
            ("kind", text),
            ("x", number),
            ("y", number),
            ("size", pa.list_(number)),
            ("counts", pa.list_(number)),
        ]
    )
    special = {
        **dict.fromkeys(_NUMBERS, number),
        **dict.fromkeys(_TEXT_LISTS, pa.list_(text)),
        "stages": pa.list_(number),
        "picture": picture,
        "frames": pa.list_(picture),
        "points": pa.list_(point),
        "points_in_order": pa.bool_(),
        "command_chance": pa.float64(),
    }
    schema = pa.schema(
        [(name, special.get(name, text)) for name in GroundingItem.__struct_fields__]
    )
    return schema.with_metadata({"huggingface": json.dumps(_features(schema))})


def _features(schema: Any) -> dict[str, Any]:  # noqa: ANN401 - pyarrow ships no types
    """Return the description of the columns that `datasets` reads."""
    image = {"_type": "Image"}
    found = {field.name: _feature(field.type) for field in schema}
    found |= {"picture": image, "frames": {"feature": image, "_type": "List"}}
    return {"info": {"features": found}}


def _feature(kind: Any) -> Any:  # noqa: ANN401 - pyarrow ships no types
    import pyarrow as pa

    if pa.types.is_list(kind):
        return {"feature": _feature(kind.value_type), "_type": "List"}
    if pa.types.is_struct(kind):
        return {field.name: _feature(field.type) for field in kind}
    name = "float64" if pa.types.is_floating(kind) else str(kind)
    return {"dtype": name, "_type": "Value"}
