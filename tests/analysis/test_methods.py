"""The methods section: every item is there, known or not, in every format."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import msgspec
import pytest
from flat_jobs import job_of
from typer.testing import CliRunner

from roboirg.core.errors import UnknownNameError
from roboirg.core.inference_facts import InferenceFacts, inference_facts
from roboirg.evaluation.analysis.methods.method_sections import make_sections
from roboirg.evaluation.analysis.methods.method_text import FORMATS, write_methods
from roboirg.evaluation.analysis.methods.played_facts import NOT_REPORTED
from roboirg.evaluation.play.rollout_result import RolloutResult, make_record
from roboirg.evaluation.records.record import Record
from roboirg.evaluation.records.store import RecordStore
from roboirg.main import app

ITEMS = {
    "Horizon and control rate",
    "Precision of inference",
    "Observations",
    "Instructions",
    "Use of the words in training",
    "Screening of scenes",
    "Statistics",
    "Sensitivity to analysis choices",
    "Controls and floors",
    "Seeds, retries and errors",
}
"""Items 5 to 12 of an audit of language evaluations, controls, and what a repeat needs."""


def record(episode: int, outcome: str = "success", **fields) -> Record:
    setting = fields.pop("setting", "explicit")
    changes = {name: fields.pop(name) for name in ("steps", "attempt", "calls") if name in fields}
    job = job_of(policy="mine", task="PickXtimes", split="test", episode=episode, setting=setting)
    result = RolloutResult(outcome, cause=None if outcome == "success" else "why", **fields)  # type: ignore[arg-type]
    made = make_record(job, result, started_at=f"{episode}{setting}{outcome}")
    return msgspec.structs.replace(made, **changes)


def sections(folder: Path, *records: Record) -> dict[str, dict[str, str]]:
    with RecordStore(folder) as store:
        for one in records:
            store.append(one)
    return json.loads(write_methods(make_sections(folder, ()), "json"))


def test_every_item_is_there_and_what_is_unknown_is_not_reported(tmp_path: Path) -> None:
    found = sections(tmp_path, record(0))
    assert set(found) == ITEMS
    assert all(found[title] for title in ITEMS)
    for title in ("Precision of inference", "Use of the words in training"):
        assert NOT_REPORTED in found[title]["mine"]
    assert "chance in explicit" in found["Controls and floors"]


def test_what_a_policy_declares_and_its_process_reports_is_there(tmp_path: Path) -> None:
    known = {
        "needs": {
            "cameras": ["front"],
            "actions": "ee_pose",
            "lowers_prompt": True,
            "depth": False,
        },
        "policy_metadata": {"trained_on": "explicit", "preprocessing": "resized to 224"},
        "inference": InferenceFacts(
            python="3.12.1", libraries={"torch": "2.9"}, dtypes=("bfloat16",), devices=("cuda:0",)
        ),
    }
    found = sections(
        tmp_path,
        record(0, steps=30, calls=3, **known),
        record(1, outcome="failure", steps=10, calls=1, attempt=2, **known),
    )
    assert "action space ee_pose" in found["Horizon and control rate"]["mine"]
    assert "per call, mean: 10.0" in found["Horizon and control rate"]["mine"]
    for word in ("bfloat16", "cuda:0", "torch 2.9", "3.12.1"):
        assert word in found["Precision of inference"]["mine"]
    assert "cameras: front" in found["Observations"]["mine"]
    assert "resized to 224" in found["Observations"]["mine"]
    assert "sent in lower case" in found["Instructions"]["mine"]
    assert found["Use of the words in training"]["mine"].endswith("explicit")
    again = found["Seeds, retries and errors"]["episodes that were begun more than once"]
    assert again == "1 of 2"


def test_a_server_speaks_for_its_own_process(tmp_path: Path) -> None:
    """The client's process has number types and libraries, too, but computes nothing."""
    mine = InferenceFacts(python="3.11", libraries={"numpy": "2"})
    server = {"server": "openpi://host:8000", "dtype": "float16"}
    found = sections(tmp_path, record(0, inference=mine, policy_metadata=server))
    text = found["Precision of inference"]["mine"]
    assert "computed by a server" in text
    assert "number type of inference: float16" in text
    assert f"versions of libraries: {NOT_REPORTED}" in text
    assert "3.11" not in text


def test_an_episode_that_was_played_again_counts_once(tmp_path: Path) -> None:
    found = sections(tmp_path, record(0, "error", error="policy"), record(0))
    assert found["Seeds, retries and errors"]["errors, in no rate"] == "none (of 1 results)"


@pytest.mark.parametrize("name", FORMATS)
def test_the_command_prints_every_format(tmp_path: Path, name: str) -> None:
    sections(tmp_path, record(0), record(0, setting="direct"))
    shown = CliRunner().invoke(app, ["report", str(tmp_path), "--methods", name])
    assert shown.exit_code == 0, shown.output
    for title in ITEMS:
        assert title in shown.output
    assert not (tmp_path / "report.html").exists()


def test_the_sections_of_the_docs_have_these_headings() -> None:
    page = (Path(__file__).parents[2] / "docs" / "methods-sections.md").read_text()
    printed = re.findall(r"^```markdown\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    assert len(printed) == 3
    for text in printed:
        assert set(re.findall("^## (.*)$", text, re.MULTILINE)) == ITEMS


def test_an_unknown_format_is_named(tmp_path: Path) -> None:
    shown = CliRunner().invoke(app, ["report", str(tmp_path), "--methods", "word"])
    assert isinstance(shown.exception, UnknownNameError)
    assert "markdown, latex, json" in str(shown.exception)


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
