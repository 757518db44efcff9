"""The items as a table in Parquet, with their pictures."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from roboirg.apps.grounding.items.grounding_item import GroundingItem
from roboirg.util.atomic_write import replacing
from roboirg.util.parquet_support import check_parquet_support
from roboirg.util.regular_file import read_regular

DATA = "data"
ROWS_PER_GROUP = 256
_DICTIONARY_LIMIT = 1 << 30
"""Bytes of a column's distinct values in a row group: so that each picture is stored once in it."""

_NUMBERS = ("episode", "distractors", "video_steps", "environment_version")
_TEXT_LISTS = (
    "turns", "choices", "answers", "goals", "choice_answers", "hidden_slots", "expressions",
)  # fmt: skip


def write_parquet(items: Sequence[GroundingItem], folder: Path, split: str) -> None:
    """Write the questions of a split as a Parquet file with pictures inside.

    It is for pandas, and for Hugging Face's `datasets`, which loads the file without options since
    pictures are columns of its type Image. The file appears whole or not at all.

    Args:
        items: the questions, a row for each.
        folder: of the dataset, where pictures are read and the file is written.
        split: for the file's name, ``test-00000-of-00001.parquet``.
    """
    check_parquet_support()
    import pyarrow as pa
    from pyarrow import parquet

    schema = _arrow_schema()
    path = folder / DATA / f"{split}-00000-of-00001.parquet"
    pictures = _PictureFiles(folder)
    # Items of an episode share pictures: columns with a dictionary store equal values once.
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
            group = items[start : start + ROWS_PER_GROUP]
            rows = [_row(item, pictures) for item in group]
            writer.write_table(pa.Table.from_pylist(rows, schema=schema))


class _PictureFiles:
    """The pictures of a dataset's folder, each read from the disk once and then kept."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._contents: dict[str, bytes] = {}

    def value(self, path: str) -> Mapping[str, Any]:
        """Return a picture as the type Image of `datasets`.

        ``{"bytes": b"…", "path": "pictures/3f9c.png"}``, the path as items have it.
        """
        if path not in self._contents:
            self._contents[path] = read_regular(self._folder / path)
        return {"bytes": self._contents[path], "path": path}


def _row(item: GroundingItem, pictures: _PictureFiles) -> dict[str, Any]:
    """Return an item with its pictures instead of their paths."""
    row: dict[str, Any] = msgspec.to_builtins(item)
    row["picture"] = pictures.value(item.picture)
    row["frames"] = [pictures.value(path) for path in item.frames]
    return row


def _arrow_schema() -> Any:  # noqa: ANN401 - pyarrow ships no types
    """Return the columns of the Parquet file with their types: one for each field of an item.

    A field is a text unless named here. The metadata has the types as `datasets` reads them.
    """
    import pyarrow as pa

    text = pa.string()
    number = pa.int64()
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
    names = GroundingItem.__struct_fields__
    schema = pa.schema([(name, special.get(name, text)) for name in names])
    return schema.with_metadata({"huggingface": json.dumps(_features(schema))})


def _features(schema: Any) -> dict[str, Any]:  # noqa: ANN401 - pyarrow ships no types
    """Return the types of the columns in the words of Hugging Face's `datasets`.

    For example ``{"info": {"features": {"task": {"dtype": "string", "_type": "Value"}, …}}}``.
    """
    image = {"_type": "Image"}
    found = {field.name: _feature(field.type) for field in schema}
    found["picture"] = image
    found["frames"] = {"feature": image, "_type": "List"}
    return {"info": {"features": found}}


def _feature(kind: Any) -> Any:  # noqa: ANN401 - pyarrow ships no types
    """Return the type of a column of pyarrow as Hugging Face's `datasets` describes it.

    A list of numbers is ``{"feature": {"dtype": "int64", "_type": "Value"}, "_type": "List"}``.
    """
    import pyarrow as pa

    if pa.types.is_list(kind):
        return {"feature": _feature(kind.value_type), "_type": "List"}
    if pa.types.is_struct(kind):
        return {field.name: _feature(field.type) for field in kind}
    name = "float64" if pa.types.is_floating(kind) else str(kind)
    return {"dtype": name, "_type": "Value"}
