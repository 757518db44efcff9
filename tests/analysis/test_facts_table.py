"""The facts of a run: each is there, known or not, in every format."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from flat_jobs import job_of
from made_records import make_record
from typer.testing import CliRunner

from roboirg.core.inference_facts import InferenceFacts, inference_facts
from roboirg.evaluation.analysis.tables.facts_table import NOT_APPLICABLE, NOT_REPORTED, RUN
from roboirg.evaluation.analysis.tables.rendering import FORMATS
from roboirg.evaluation.plan.plan_maker import make_plan
from roboirg.evaluation.plan.stored_plans import write_plan
from roboirg.evaluation.records.record import Record
from roboirg.evaluation.records.store import RecordStore
from roboirg.main import app

Facts = dict[str, dict[str, str]]


def record(episode: int, outcome: str = "success", **fields) -> Record:
    setting = fields.pop("setting", "explicit")
    job = job_of(policy="mine", task="PickXtimes", split="test", episode=episode, setting=setting)
    cause, start = None if outcome == "success" else "why", f"{episode}{setting}{outcome}"
    return make_record(job, outcome, cause, started_at=start, **fields)


def facts(folder: Path, *records: Record) -> Facts:
    with RecordStore(folder) as store:
        for one in records:
            store.append(one)
    printed = CliRunner().invoke(app, ["tables", str(folder), "--which", "facts", "--format=json"])
    assert printed.exit_code == 0, printed.output
    found: Facts = {}
    for row in json.loads(printed.output):
        found.setdefault(row["of"], {})[row["fact"]] = row["value"]
    return found


def test_a_run_has_its_facts(tmp_path: Path) -> None:
    again = record(0, "error", error="policy"), record(0, attempt=2)
    later = record(2, "error", error="timeout"), record(3, setting="direct")
    write_plan(make_plan(["mine=random"], tasks="PickXtimes", settings="direct"), tmp_path)
    found = facts(tmp_path, *again, *later)[RUN]
    assert found["tasks"] == "PickXtimes"
    assert found["settings"] == "explicit; direct"
    assert found["step limit"] == "1300 at 20 a second"
    assert found["words"] == "our own words"
    assert found["delivery"] == "prompt"
    assert found["episodes"] == "3, from 0 to 3"
    assert found["trials played"] == "3"
    assert found["errors, in no rate"] == "timeout 1"
    assert found["trials planned and not played"] == "3"
    assert found["trials begun again"] == "1"
    assert found["render device"] == NOT_REPORTED


def test_what_a_policy_does_not_say_is_not_reported(tmp_path: Path) -> None:
    found = facts(tmp_path, record(0))["mine"]
    for name in ("version", "cameras", "trained on", "dtype", "python", "prompts"):
        assert found[name] == NOT_REPORTED, name
    assert found["control steps per call, mean"] == NOT_REPORTED
    assert found["reads the simulator's state"] == "no"


def test_what_a_policy_declares_and_its_process_reports_is_there(tmp_path: Path) -> None:
    known = {
        "needs": {"cameras": ["front"], "actions": "ee_pose", "lowers_prompt": True},
        "policy_metadata": {"trained_on": "explicit", "device": "two cards"},
        "inference": InferenceFacts(
            python="3.12.1", libraries={"torch": "2.9"}, dtypes=("bfloat16",), devices=("cuda:0",)
        ),
    }
    long, short = {"steps": 30, "calls": 3, "executed": 16}, {"steps": 10, "calls": 1}
    played = record(0, **long, **known), record(1, **short, executed=10, **known)
    found = facts(tmp_path, *played)["mine"]
    expected = {
        "cameras": "front",
        "actions": "ee_pose",
        "lowers prompt": "yes",
        "prompt tokens": "none",
        "trained on": "explicit",
        "device": "two cards",
        "parameter dtype": "bfloat16",
        "dtype": NOT_REPORTED,
        "libraries": "torch 2.9",
        "python": "3.12.1",
        "control steps per call, mean": "10.0",
        "actions executed per call, most": "16",
    }
    assert found.items() >= expected.items()


def test_a_server_speaks_for_its_own_process(tmp_path: Path) -> None:
    """The client's process has libraries, too, but computes nothing."""
    mine = InferenceFacts(python="3.11", libraries={"numpy": "2"})
    server = {"server": "openpi://host:8000", "dtype": "float16"}
    found = facts(tmp_path, record(0, inference=mine, policy_metadata=server))["mine"]
    assert found["dtype"] == "float16"
    assert found["python"] == found["libraries"] == NOT_REPORTED


def test_without_a_network_its_number_type_is_not_applicable(tmp_path: Path) -> None:
    found = facts(tmp_path, record(0, policy_metadata={"network": "none"}))["mine"]
    assert found["dtype"] == found["preprocessing"] == NOT_APPLICABLE
    assert found["device"] == NOT_REPORTED


def test_the_policy_behind_a_planner_does_not_speak_for_the_planner(tmp_path: Path) -> None:
    metadata = {"planner": {"model": "large"}, "policy": {"network": "none", "chunk": 16}}
    found = facts(tmp_path, record(0, policy_metadata=metadata))["mine"]
    assert found["chunk"] == "16"
    assert found["network"] == found["dtype"] == NOT_REPORTED


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_has_all_facts(tmp_path: Path, name: str) -> None:
    long = "resized to 96 × 96, and " * 20
    facts(tmp_path, record(0, policy_metadata={"preprocessing": long}))
    shown = CliRunner().invoke(app, ["tables", str(tmp_path), "--which", "facts", "--format", name])
    assert shown.exit_code == 0, shown.output
    for word in ("language version", "preprocessing", NOT_REPORTED):
        assert word in shown.output
    if name == "terminal":
        assert max(map(len, shown.output.splitlines())) <= 130


class Parameter:
    def __init__(self, dtype: str, device: str, size: int) -> None:
        self.dtype, self.device, self.size = f"torch.{dtype}", device, size

    def numel(self) -> int:
        return self.size


class Network:
    def __init__(self, *parameters: Parameter) -> None:
        self._parameters = parameters

    def parameters(self) -> tuple[Parameter, ...]:
        return self._parameters


def test_parameters_are_found_below_a_policy(monkeypatch: pytest.MonkeyPatch) -> None:
    """In dictionaries, lists and objects; the kind of most numbers comes first."""
    torch = SimpleNamespace(nn=SimpleNamespace(Module=Network))
    monkeypatch.setitem(sys.modules, "torch", torch)
    large = Network(Parameter("bfloat16", "cuda:0", 400))
    small = Network(Parameter("float32", "cpu", 6), Parameter("float32", "cuda:0", 2))
    body = SimpleNamespace(nets={"large": large}, behind=SimpleNamespace(heads=[small]))
    body.itself = body
    facts = inference_facts(body)
    assert facts.dtypes == ("bfloat16", "float32")
    assert facts.devices == ("cuda:0", "cpu")


def test_a_policy_without_networks_has_none() -> None:
    facts = inference_facts(object())
    assert (facts.dtypes, facts.devices) == ((), ())
    assert facts.python.startswith("3.")
