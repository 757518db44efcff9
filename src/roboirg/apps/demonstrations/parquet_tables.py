"""Tables in Parquet: frames with their pictures, and tables of facts."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roboirg.util.atomic_write import replacing

_DICTIONARY_LIMIT = 2**30
"""Bytes of pictures that a file stores once although several instructions refer to them."""


def number_column(values: NDArray[Any]) -> Any:  # noqa: ANN401 - pyarrow ships no types
    """Return numbers as a column for Parquet: of plain numbers for size 1, else of lists.

    Args:
        values: shape (frames, size).
    """
    import pyarrow as pa

    if values.shape[1] == 1:
        return pa.array(np.ascontiguousarray(values[:, 0]))
    flat = pa.array(np.ascontiguousarray(values).ravel())
    return pa.FixedSizeListArray.from_arrays(flat, values.shape[1])


def picture_column(pictures: Sequence[bytes]) -> Any:  # noqa: ANN401
    """Return PNGs as a column of ``{bytes, path}``, as Hugging Face's `datasets` reads it."""
    import pyarrow as pa

    paths = pa.array([f"{row:06d}.png" for row in range(len(pictures))], pa.string())
    return pa.StructArray.from_arrays([pa.array(pictures, pa.binary()), paths], ["bytes", "path"])


def text_column(texts: Sequence[str]) -> Any:  # noqa: ANN401
    """Return texts as a column."""
    import pyarrow as pa

    return pa.array(texts, pa.string())


def write_frames(
    path: Path,
    features: Mapping[str, Mapping[str, Any]],
    shared: Mapping[str, Any],
    own: Sequence[Mapping[str, Any]],
    *,
    is_described: bool = False,
) -> None:
    """Write the frames of one trajectory as a Parquet file, once for each of its instructions.

    The file stores each picture only once, whatever the number of instructions.

    Args:
        path: file to write; it appears whole or not at all.
        features: the columns in order, with what ``info.json`` says of them.
        shared: by name, columns that are the same for every instruction.
        own: for each instruction its other columns, by name.
        is_described: whether the file holds the types of the columns, for readers that take them
            from it.
    """
    import pyarrow as pa
    from pyarrow import parquet

    tables = []
    for columns in own:
        every_column = {**shared, **columns}
        in_order = {name: every_column[name] for name in features}
        tables.append(pa.table(in_order))
    table = pa.concat_tables(tables)
    if is_described:
        types = {name: _hugging_face_type(feature) for name, feature in features.items()}
        described = json.dumps({"info": {"features": types}})
        table = table.replace_schema_metadata({"huggingface": described})
    repeats_pictures = len(own) > 1
    with replacing(path) as part:
        parquet.write_table(
            table,
            part,
            **_storage(features, repeats_pictures=repeats_pictures),
            dictionary_pagesize_limit=_DICTIONARY_LIMIT,
            row_group_size=max(len(table), 1),
        )


def _storage(
    features: Mapping[str, Mapping[str, Any]], *, repeats_pictures: bool
) -> dict[str, Any]:
    """Return pyarrow's options on how to store columns: compression, dictionaries, statistics.

    Pictures are compressed already, as PNG. If they are repeated, a dictionary stores each once.

    Args:
        features: type and shape of each column.
        repeats_pictures: whether several rows have the same picture.
    """
    pictures = [name for name, feature in features.items() if feature["dtype"] == "image"]
    dictionaries = [name for name, feature in features.items() if feature["dtype"] == "string"]
    compression = dict.fromkeys(features, "snappy")
    for name in pictures:
        compression[f"{name}.bytes"] = "none"
        compression[f"{name}.path"] = "snappy"
    if repeats_pictures:
        dictionaries = [f"{name}.bytes" for name in pictures] + dictionaries
    return {
        "compression": compression,
        "use_dictionary": dictionaries,
        "write_statistics": [name for name in features if name not in pictures],
    }


def _hugging_face_type(feature: Mapping[str, Any]) -> dict[str, Any]:
    """Return a column's type as Hugging Face's `datasets` stores it in a file.

    A vector of eight numbers is ``{"feature": {"dtype": "float32", "_type": "Value"}, "length": 8,
    "_type": "Sequence"}``, a single number its inner part, a picture ``{"_type": "Image"}``.
    """
    if feature["dtype"] == "image":
        return {"_type": "Image"}
    value = {"dtype": feature["dtype"], "_type": "Value"}
    (size,) = feature["shape"]
    if size == 1:
        return value
    return {"feature": value, "length": size, "_type": "Sequence"}


def write_rows(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows, each with its values by column, as a Parquet file; types follow from all rows."""
    import pyarrow as pa
    from pyarrow import parquet

    with replacing(path) as part:
        parquet.write_table(pa.Table.from_pylist([dict(row) for row in rows]), part)


def read_rows(path: Path) -> list[dict[str, Any]]:
    """Return the rows of a table of facts."""
    from pyarrow import parquet

    rows: list[dict[str, Any]] = parquet.read_table(path).to_pylist()
    return rows
