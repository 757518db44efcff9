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
from roboirg.evaluation.analysis.methods.method_text import FORMATS
from roboirg.evaluation.analysis.methods.played_facts import NO_NETWORK, NOT_REPORTED
from roboirg.evaluation.plan.plan import Plan
from roboirg.evaluation.plan.stored_plans import write_plan
from roboirg.evaluation.play.rollout_result import RolloutResult, make_record
from roboirg.evaluation.records.record import Record
from roboirg.evaluation.records.store import RecordStore
from roboirg.main import app
from roboirg.policies.builtin import BUILTIN
from roboirg.policies.by_name.loading import load_policy_class

HORIZON = "Horizon and control rate"
STEPS = "step limit of a rollout"
SECONDS = "wall-clock limits, in all plans of the run"
CONTROL = "positive control, another policy that reads the simulator's state"
ITEMS = {
    "Terms",
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
    told = {name: fields.pop(name) for name in ("arm", "policy_seed") if name in fields}
    job = job_of(
        policy="mine", task="PickXtimes", split="test", episode=episode, setting=setting, **told
    )
    result = RolloutResult(outcome, cause=None if outcome == "success" else "why", **fields)  # type: ignore[arg-type]
    made = make_record(job, result, started_at=f"{episode}{setting}{outcome}")
    return msgspec.structs.replace(made, **changes)


def sections(folder: Path, *records: Record) -> dict[str, dict[str, str]]:
    with RecordStore(folder) as store:
        for one in records:
            store.append(one)
    return json.loads(FORMATS["json"](make_sections(folder)))


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
    assert "actions: ee_pose (" in found["Horizon and control rate"]["mine"]
    assert "on average 10.0 control steps" in found["Horizon and control rate"]["mine"]
    computed = f"number type of the computation: {NOT_REPORTED} by the policy"
    parameters = "number type of the parameters: bfloat16"
    for word in (computed, parameters, "cuda:0", "torch 2.9", "3.12.1"):
        assert word in found["Precision of inference"]["mine"]
    assert (
        "and whose pictures it was given: front; rendered and sent at 256 × 256 pixels"
        in found["Observations"]["mine"]
    )
    assert "resized to 224" in found["Observations"]["mine"]
    assert "sent: in lower case" in found["Instructions"]["mine"]
    assert found["Use of the words in training"]["mine"].endswith("explicit")
    again = found["Seeds, retries and errors"]["rollouts begun again after a fault"]
    assert again == "1 of 2"


def test_a_server_speaks_for_its_own_process(tmp_path: Path) -> None:
    """The client's process has number types and libraries, too, but computes nothing."""
    mine = InferenceFacts(python="3.11", libraries={"numpy": "2"})
    server = {"server": "openpi://host:8000", "dtype": "float16"}
    found = sections(tmp_path, record(0, inference=mine, policy_metadata=server))
    text = found["Precision of inference"]["mine"]
    assert "computed by its server" in text
    assert "number type of the computation: float16" in text
    assert f"not reported): {NOT_REPORTED} by the server" in text
    assert f"version of the policy: {NOT_REPORTED} by the server" in text
    assert "3.11" not in text
    assert f"length of a chunk, as declared: {NOT_REPORTED} by the server" in found[HORIZON]["mine"]


def test_a_built_in_policy_that_is_served_has_a_name_and_the_version_of_its_package(
    tmp_path: Path,
) -> None:
    server = {"server": "localhost:8000", "version": "built-in", "policy": "random"}
    found = sections(tmp_path, record(0, policy_metadata=server))
    text = found["Precision of inference"]["mine"]
    assert "policy served: random; version of the policy: that of roboirgbench, below;" in text


def test_an_episode_that_was_played_again_counts_once(tmp_path: Path) -> None:
    found = sections(tmp_path, record(0, "error", error="policy"), record(0))
    errors = found["Seeds, retries and errors"]
    assert errors["rollouts that ended in an error, which are in no rate"] == "0 of 1"


@pytest.mark.parametrize("name", BUILTIN)
def test_built_in_policies_have_no_network(tmp_path: Path, name: str) -> None:
    """What a network would have is none, which differs from what is not reported."""
    metadata = dict(load_policy_class(name).metadata)
    found = sections(tmp_path, record(0, policy_metadata=metadata))
    assert NO_NETWORK in found["Precision of inference"]["mine"]
    assert NO_NETWORK in found["Observations"]["mine"]
    assert "understands the text: " in found["Instructions"]["mine"]
    assert f"understands the text: {NOT_REPORTED}" not in found["Instructions"]["mine"]


def test_the_policy_behind_a_planner_does_not_speak_for_the_planner(tmp_path: Path) -> None:
    metadata = {"planner": {"model": "large"}, "policy": {"network": "none", "dtype": "float16"}}
    found = sections(tmp_path, record(0, policy_metadata=metadata))
    assert "number type of the computation: float16" in found["Precision of inference"]["mine"]
    assert f"device of inference: {NOT_REPORTED}" in found["Precision of inference"]["mine"]


def test_texts_and_templates_are_counted(tmp_path: Path) -> None:
    jobs = [(arm, setting) for arm in ("told", "silent") for setting in ("explicit", "direct")]
    played = [
        record(episode, arm=arm, setting=setting) for arm, setting in jobs for episode in range(4)
    ]
    found = sections(tmp_path, *played)
    told = {record(episode, setting="direct").command for episode in range(4)}
    counts = found["Instructions"]
    direct = {record(episode, setting="direct").instruction for episode in range(4)}
    assert counts["explicit, arm told"].startswith(f"{len(told)} distinct texts; command")
    assert counts["direct, arm silent"] == "1 distinct text, fixed"
    chance = found["Controls and floors"]["chance in direct"]
    assert chance.endswith("without any words: mine, arm silent, direct: 100.0 %")
    (label,) = set(found["Use of the words in training"]) - {"mine"}
    seen = found["Use of the words in training"][label]
    assert f"{len(told) + len(direct)} texts: in neither, as their templates are held out" in seen
    assert "1 text: in neither, as it is the fixed text of a control arm" in seen


def test_each_other_analysis_has_a_verdict_or_a_reason(tmp_path: Path) -> None:
    played = [
        record(episode, outcome, setting=setting, policy_seed=seed)
        for setting, outcome in (("explicit", "success"), ("direct", "failure"))
        for seed in (0, 1)
        for episode in range(3)
    ]
    found = sections(tmp_path, *played)
    assert found["Statistics"][
        "Holm's correction"
    ] == "3 families, each corrected alone; " + "; ".join(
        f"mine, differences to explicit in {scope}: 1 test"
        for scope in ("single tasks", "suites", "all tasks")
    )
    found = found["Sensitivity to analysis choices"]
    assert found["mine, direct minus explicit"] == (
        "open; 3 paired scenes, with which uncorrected p is at least 0.25, so the verdict is open; "
        "does not hold in 1 of 4: unit rollout (lower)"
    )
    tried, _, without = found["mine, other analyses of differences to explicit"].partition("; ")
    assert tried == "tried: seed 0, seed 1, unit rollout, equal weights of difficulties"
    for choice in ("errors as failures", "unit task", "equal weights of suites", "one processor"):
        assert choice in without
    assert found["mine, contrasts of arms"] == "none played"


def test_limits_are_the_benchmarks_or_set_for_the_run(tmp_path: Path) -> None:
    found = sections(tmp_path, record(0))["Horizon and control rate"]
    assert "1300 control steps of the policy (the benchmark's limit)" in found[STEPS]
    assert found[SECONDS].startswith(f"{NOT_REPORTED}, as the run has no plan; ")
    fields = {"policies": ("mine",), "tasks": ("PickXtimes",), "episodes": (0,)}
    write_plan(Plan(**fields, policy_timeout_s=30), tmp_path)
    shorter = msgspec.structs.replace(record(1), max_steps=200)
    found = sections(tmp_path, shorter)["Horizon and control rate"]
    assert "200, 1300 control steps of the policy (set for this run; the" in found[STEPS]
    assert (
        "30 s per call of the policy (set for this run; the benchmark's limit is 600)"
        in (found[SECONDS])
    )
    assert "7200 s per rollout (the benchmark's limit)" in found[SECONDS]


def test_what_cannot_show_anything_is_named(tmp_path: Path) -> None:
    """A bootstrap over two scenes, and a policy as its own positive control."""
    two = [msgspec.structs.replace(record(episode), privileged=True) for episode in (0, 1)]
    found = sections(tmp_path / "few", *two)
    assert "too few scenes, in: PickXtimes (2)" in found["Statistics"]["intervals"]
    assert found["Controls and floors"][CONTROL] == "none, as mine (privileged) is the only policy"
    other = [msgspec.structs.replace(record(episode), policy="other") for episode in range(3)]
    found = sections(tmp_path / "more", *two, *other)
    assert found["Statistics"]["intervals"].endswith("too few scenes, in: no task")
    assert found["Controls and floors"][CONTROL] == "mine (privileged), explicit: 100.0 %"


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
