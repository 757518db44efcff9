"""Export records as a Parquet table for pandas, Polars or DuckDB, one row per episode."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
from msgspec import inspect

from roboirg.core.environment_options import EnvironmentOptions
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.records.record import Record
from roboirg.util.atomic_write import replacing
from roboirg.util.parquet_support import check_parquet_support

if TYPE_CHECKING:
    from pyarrow import DataType

_BATCH_ROWS = 5_000
_OPTIONS = {"options": InstructionOptions, "environment": EnvironmentOptions}
"""Fields whose own fields are columns."""
_NESTED = (inspect.StructType, inspect.DataclassType)


def write_parquet(records: Iterable[Record], path: Path) -> int:
    """Write records to a Parquet file, which appears complete or not at all.

    The columns are the fields of a record and the options of its instruction and environment.
    ``ref``, ``instruction``, ``mentions``, ``prompt``, ``events`` and ``attribution`` are nested;
    dictionaries, whose keys depend on the task or the policy, are JSON texts.

    Returns:
        Number of rows.
    """
    check_parquet_support()
    import pyarrow as pa
    from pyarrow import parquet

    columns = {name: _arrow_type(kind) for name, kind in _COLUMNS.items()}
    schema, count = pa.schema(columns), 0
    rows = (
        {name: _fit(value, columns[name]) for name, value in _flat(record).items()}
        for record in records
    )
    with (
        replacing(path) as partial,
        parquet.ParquetWriter(partial, schema, compression="zstd") as writer,
    ):
        while batch := list(itertools.islice(rows, _BATCH_ROWS)):
            writer.write_table(pa.Table.from_pylist(batch, schema=schema))
            count += len(batch)
    return count


def _flat(record: Record) -> dict[str, Any]:
    """Return the values of a record's columns, as JSON."""
    row: dict[str, Any] = msgspec.to_builtins(record)
    for name in _OPTIONS:
        row |= row.pop(name)
    return row


def _fit(value: Any, kind: DataType) -> Any:  # noqa: ANN401 - JSON, of that type
    """Return a value as its column takes it; what varies in its type is JSON."""
    from pyarrow import types

    if value is not None and types.is_struct(kind):
        return {one.name: _fit(value[one.name], one.type) for one in kind}
    if value is not None and types.is_list(kind):
        return [_fit(one, kind.value_type) for one in value]
    is_text = value is None or isinstance(value, str) or not types.is_string(kind)
    return value if is_text else json.dumps(value, ensure_ascii=False)


def _arrow_type(kind: inspect.Type) -> DataType:
    """Return the type of a column; dictionaries and unions are text."""
    import pyarrow as pa

    kind = _without_none(kind)
    if isinstance(kind, _NESTED):
        return pa.struct({one.name: _arrow_type(one.type) for one in kind.fields})
    if isinstance(kind, inspect.VarTupleType):
        return pa.list_(_arrow_type(kind.item_type))
    if isinstance(kind, inspect.TupleType):
        return pa.list_(_arrow_type(kind.item_types[0]))
    if isinstance(kind, inspect.LiteralType):
        return pa.int64() if isinstance(kind.values[0], int) else pa.string()
    plain = {inspect.IntType: pa.int64(), inspect.FloatType: pa.float64()}
    return {**plain, inspect.BoolType: pa.bool_()}.get(type(kind), pa.string())


def _without_none(kind: inspect.Type) -> inspect.Type:
    """Return a type without None, of which every column may have some."""
    if not isinstance(kind, inspect.UnionType):
        return kind
    kinds = tuple(one for one in kind.types if not isinstance(one, inspect.NoneType))
    return kinds[0] if len(kinds) == 1 else inspect.UnionType(kinds)


def _fields(kind: type) -> dict[str, inspect.Type]:
    info: Any = inspect.type_info(kind)
    return {one.name: one.type for one in info.fields}


_COLUMNS = {
    name: kind
    for holder in (Record, *_OPTIONS.values())
    for name, kind in _fields(holder).items()
    if name not in _OPTIONS
}
