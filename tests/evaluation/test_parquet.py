from __future__ import annotations

import json
from pathlib import Path

import msgspec
import pandas as pd
from evaluation_fakes import FakePlay, small_plan
from msgspec.structs import replace

from roboirg.core.environment_options import ENVIRONMENT_OPTIONS, EnvironmentOptions
from roboirg.core.instruction_options import OPTION_NAMES
from roboirg.evaluation.records.parquet import write_parquet
from roboirg.evaluation.records.record import Attribution, Record


def test_a_table_holds_every_field_of_every_record(tmp_path: Path) -> None:
    why = Attribution(kind="grounding", failure="wrong_object", step=4, sentence="Green.")
    records = [FakePlay()(job) for job in small_plan().jobs()]
    records[0] = replace(
        records[0],
        attribution=why,
        environment=EnvironmentOptions(demonstration_frames=4),
        usage={"calls": 2.0},
        error="connection",
    )
    records[1] = replace(records[1], attribution=None)
    said = records[1].instruction
    late = (*said[:-1], replace(said[-1], step=20))
    records[1] = replace(records[1], instruction=late).with_options(delivery="turns")
    path = tmp_path / "records.parquet"
    assert write_parquet(iter(records), path) == len(records)
    table = pd.read_parquet(path)
    fields = {*Record.__struct_fields__} - {"options", "environment"}
    assert set(table.columns) == {*fields, *OPTION_NAMES, *ENVIRONMENT_OPTIONS}
    for row, record in zip(table.to_dict("records"), records, strict=True):
        assert (row["policy"], row["episode"], row["outcome"]) == (
            record.policy,
            record.episode,
            record.outcome,
        )
        assert json.loads(row["goal"]) == msgspec.to_builtins(record.goal)
        assert [event["kind"] for event in row["events"]] == [one.kind for one in record.events]
        assert list(row["stages"]) == list(record.options.stages)
    assert table.attribution[0]["failure"] == "wrong_object"
    assert table.attribution[1] is None
    assert list(table.delivery[:2]) == ["prompt", "turns"]
    assert [one["step"] for one in table.instruction[1]] == [0] * (len(said) - 1) + [20]
    assert table.demonstration_frames[0] == "4"
    assert json.loads(table.usage[0]) == {"calls": 2.0}
