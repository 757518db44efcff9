"""Export records as a Parquet table for pandas, Polars or DuckDB, one row per episode."""

from __future__ import annotations

import itertools
import json
import operator
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
from msgspec import inspect

from roboirg.evaluation.records.record import Record
from roboirg.util.atomic_write import replacing
from roboirg.util.parquet_support import check_parquet_support

if TYPE_CHECKING:
    from pyarrow import DataType

_BATCH_ROWS = 5_000
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

    columns = {name.rpartition(".")[2]: _arrow_type(kind) for name, kind in _COLUMNS.items()}
    schema, count = pa.schema(columns), 0
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
    return {
        name.rpartition(".")[2]: _fit(operator.attrgetter(name)(record), kind)
        for name, kind in _COLUMNS.items()
    }


def _fit(value: Any, kind: inspect.Type) -> Any:  # noqa: ANN401 - a value of that type
    """Return a value as its column takes it."""
    kind = _without_none(kind)
    if value is None:
        return None
    if isinstance(kind, inspect.DictType):
        return json.dumps(msgspec.to_builtins(value), ensure_ascii=False)
    if isinstance(kind, inspect.UnionType):
        return str(value)
    if isinstance(kind, _NESTED):
        return {one.name: _fit(getattr(value, one.name), one.type) for one in kind.fields}
    if isinstance(kind, inspect.VarTupleType):
        return [_fit(one, kind.item_type) for one in value]
    return value


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


def _columns() -> dict[str, inspect.Type]:
    """Return the type of each field of a record; those of options have dotted names."""
    record = inspect.type_info(Record)
    if not isinstance(record, inspect.StructType):
        raise TypeError(f"{Record} is no struct")
    found: dict[str, inspect.Type] = {}
    for one in record.fields:
        if isinstance(one.type, inspect.DataclassType) and one.name != "ref":
            found |= {f"{one.name}.{option.name}": option.type for option in one.type.fields}
        else:
            found[one.name] = one.type
    return found


_COLUMNS = _columns()
