"""The facts of a run: each is there, known or not, in every format."""

from __future__ import annotations

import json
import sys
from types import SimpleNamespace

import pytest
from flat_jobs import job_of
from made_records import make_record
from page_text import call, store

from roboirg.analysis.tables.facts_table import NO_NETWORK, NOT_REPORTED, RUN
from roboirg.core.inference_facts import InferenceFacts, inference_facts
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.plan.stored_plans import write_plan

Facts = dict[str, dict[str, str]]


def record_of(episode, outcome="success", *, setting="explicit", **fields):
    """Return the record of an episode of PickXtimes, played by the policy *mine*."""
    job = job_of(policy="mine", task="PickXtimes", split="test", episode=episode, setting=setting)
    cause = None if outcome == "success" else "why"
    start = f"{episode}{setting}{outcome}"
    return make_record(job, outcome, cause, started_at=start, **fields)


def facts_of_run(folder, *records):
    """Return the table of facts as ``{"the run": {"tasks": "PickXtimes"}, "mine": {…}}``."""
    store(folder, records)
    rows = json.loads(call("tables", folder, "--which", "facts", "--format", "json"))
    found: Facts = {}
    for row in rows:
        found.setdefault(row["of"], {})[row["fact"]] = row["value"]
    return found


def test_the_table_of_facts_says_under_which_conditions_the_episodes_were_played(tmp_path):
    """Of two episodes of PickXtimes, number 0 was played in explicit and number 3 in direct.

    All else is as usual: the words of the benchmark, all in one prompt, and its step limit. The
    records do not name the device that drew the pictures.
    """
    facts = facts_of_run(tmp_path, record_of(0), record_of(3, setting="direct"))

    expected = {
        "tasks": "PickXtimes",
        "settings": "explicit; direct",
        "step limit": "1300 at 20 a second",
        "words": "our own words",
        "delivery": "prompt",
        "episodes": "2, from 0 to 3",
        "render device": "not reported",
    }
    assert facts["the run"].items() >= expected.items()


def test_the_table_of_facts_counts_what_was_planned_played_and_begun_again(tmp_path):
    """Of the planned episodes 0 to 3, number 0 failed and was begun again, 1 ran out of time.

    The other two were not played. Would find a repeated episode that counts twice, or an error
    that vanishes; the failed first attempt counts as begun again and not as an error.
    """
    plan = make_plan(["mine=random"], tasks="PickXtimes", settings="explicit", episodes="4")
    write_plan(plan, tmp_path)
    failed = record_of(0, "error", error="policy")
    again = record_of(0, attempt=2)
    out_of_time = record_of(1, "error", error="timeout")

    facts = facts_of_run(tmp_path, failed, again, out_of_time)

    expected = {
        "trials played": "2",
        "errors, in no rate": "timeout 1",
        "trials planned and not played": "2",
        "trials begun again": "1",
    }
    assert facts["the run"].items() >= expected.items()


def test_the_table_of_facts_lists_each_version_of_the_code_once(tmp_path):
    """One record has our code; the other has another one and does not say what code judged it."""
    ours = record_of(0)
    other = record_of(2, code="0a", verdict_code=None)

    facts = facts_of_run(tmp_path, ours, other)

    assert facts["the run"]["package code"] == f"{ours.code}; 0a"
    assert facts["the run"]["verdict code"] == ours.verdict_code


def test_steps_per_call_are_over_all_episodes_and_without_failed_attempts(tmp_path):
    """The failed attempt does not count: 30 + 31 steps by 3 + 1 calls are 15.25, rounded up.

    A mean of the two episodes' numbers would be (30 / 3 + 31 / 1) / 2 = 20.5.
    """
    failed = record_of(0, "error", error="policy", steps=50, calls=1, executed=20)
    again = record_of(0, attempt=2, steps=30, calls=3, executed=16)
    other = record_of(1, steps=31, calls=1, executed=10)

    facts = facts_of_run(tmp_path, failed, again, other)

    assert facts["mine"]["control steps per call, mean"] == "15.3"
    assert facts["mine"]["actions executed per call, most"] == "16"


UNKNOWN_UNLESS_DECLARED = ("version", "cameras", "trained on", "dtype", "python", "prompts")
FACTS_OF_A_NETWORK = InferenceFacts(
    python="3.12.1", libraries={"torch": "2.9"}, dtypes=("bfloat16",), devices=("cuda:0",)
)


@pytest.mark.parametrize(
    ("fields", "metadata", "expected"),
    [
        (
            {},
            {},
            {
                **dict.fromkeys(
                    [*UNKNOWN_UNLESS_DECLARED, "control steps per call, mean"], NOT_REPORTED
                ),
                "reads the simulator's state": "no",
            },
        ),
        (
            {
                "needs": {"cameras": ["front"], "actions": "ee_pose", "lowers_prompt": True},
                "inference": FACTS_OF_A_NETWORK,
            },
            {"trained_on": "explicit", "device": "two cards"},
            {
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
            },
        ),
        # The client's process of a server has libraries, too, but computes nothing.
        (
            {"inference": FACTS_OF_A_NETWORK},
            {"server": "openpi://host:8000", "dtype": "float16"},
            {"dtype": "float16", "python": NOT_REPORTED, "libraries": NOT_REPORTED},
        ),
        (
            {},
            {"network": "none"},
            {"dtype": NO_NETWORK, "preprocessing": NO_NETWORK, "device": NOT_REPORTED},
        ),
        # The policy behind a planner does not speak for the planner.
        (
            {},
            {
                "planner": {"model": "large"},
                "policy": {"network": "none", "chunk": 16, "device": "cpu"},
                "device": "a card",
            },
            {
                "chunk": "16",
                "network": NOT_REPORTED,
                "dtype": NOT_REPORTED,
                "device": "a card",
            },
        ),
    ],
    ids=[
        "nothing is declared",
        "declared and reported",
        "on a server",
        "no network",
        "behind a planner",
    ],
)
def test_the_facts_of_a_policy_are_what_it_declares_and_what_its_process_reports(
    tmp_path, fields, metadata, expected
):
    """What neither says is *not reported*: a guess would look like a fact in a paper."""
    record = record_of(0, policy_metadata=metadata, **fields)

    found = facts_of_run(tmp_path, record)

    assert found["mine"].items() >= expected.items()
    assert found[RUN]["errors, in no rate"] == "0"


class Network:
    """A network with parameters of some (dtype, device, number of values) each."""

    def __init__(self, *parameters):
        self._parameters = [
            SimpleNamespace(dtype=f"torch.{dtype}", device=device, numel=lambda size=size: size)
            for dtype, device, size in parameters
        ]

    def parameters(self):
        return self._parameters


@pytest.fixture
def networks_are_modules_of_torch(monkeypatch):
    """Stand in for PyTorch, of which nothing but the class of networks is asked."""
    torch = SimpleNamespace(nn=SimpleNamespace(Module=Network))
    monkeypatch.setitem(sys.modules, "torch", torch)


def test_types_and_devices_of_a_network_are_found_wherever_the_policy_keeps_it(
    networks_are_modules_of_torch,
):
    """In dictionaries, lists and objects, also in a circle; that of most parameters comes first."""
    large = Network(("bfloat16", "cuda:0", 400))
    small = Network(("float32", "cpu", 6), ("float32", "cuda:0", 2))
    policy = SimpleNamespace(nets={"large": large}, behind=SimpleNamespace(heads=[small]))
    policy.itself = policy

    found = inference_facts(policy)

    assert found.dtypes == ("bfloat16", "float32")
    assert found.devices == ("cuda:0", "cpu")


def test_of_a_policy_without_a_network_only_its_python_is_known(networks_are_modules_of_torch):
    """The policy is an object without attributes; the fixture stands in for PyTorch."""
    found = inference_facts(object())

    assert (found.dtypes, found.devices) == ((), ())
    assert found.python.startswith("3.")
