"""What a user's own code raises is one sentence, with file and line of that code."""

from __future__ import annotations

import sys
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import hosting_fakes
import pytest
from hosting_fakes import paper_plan, paper_runner

from roboirg import main as cli
from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.hosting.policy_opening import open_policy
from roboirg.evaluation.records.store import read_records
from roboirg.evaluation.run.executor import InProcess
from roboirg.evaluation.run.runner import run_plan

IT, BOTH = "throwing:It", "planner:throwing:Planner?hands=throwing:It"
RAISED = "(throwing.py, line 10)"
OPENED = ("import", "class body", "__init__", "needs", "version")
PLAYED = ("reset", "act", "hear", "metadata", "subgoal")
PLANNED = ("planner's reset", "planner's plan", "follow")


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Any:
    """Return what a run says when something of `throwing` raises: the refusal, or the record."""
    monkeypatch.syspath_prepend(Path(__file__).parent)
    step = hosting_fakes.PaperWorld.step_chunk

    def and_speak(world: Any, rows: Any) -> Any:
        *found, info = step(world, rows)
        return *found, {**info, "heard": [{"text": "Go on.", "step": 1}]}

    monkeypatch.setattr(hosting_fakes.PaperWorld, "step_chunk", and_speak)

    def play(hook: str, spec: str = IT, process: str = "shared") -> Any:
        monkeypatch.setenv("HOOK", hook)
        sys.modules.pop("throwing", None)
        plan = paper_plan(spec, 1, policy_process=process)
        try:
            refs = tuple(map(open_policy, plan.policies))
        except InvalidValueError as error:
            return str(error)
        plan = plan.model_copy(update={"policies": refs})
        run_plan(plan, tmp_path, paper_runner(plan, tmp_path), InProcess())
        return read_records(tmp_path)[0]

    return play


@pytest.mark.parametrize(
    ("hook", "spec"), [*((hook, IT) for hook in OPENED), ("planner's __init__", BOTH)]
)
def test_what_cannot_be_opened_has_its_place(told: Any, hook: str, spec: str) -> None:
    assert f": ValueError: from {hook} {RAISED}" in told(hook, spec)


@pytest.mark.parametrize(
    ("hook", "spec", "process"),
    [*((hook, IT, "shared") for hook in PLAYED), ("act", IT, "own"),
     *((hook, BOTH, "shared") for hook in PLANNED), (PLANNED[-1], BOTH, "own")],
)  # fmt: skip
def test_what_a_call_raises_has_its_place(told: Any, hook: str, spec: str, process: str) -> None:
    record = told(hook, spec, process)
    assert record.cause == f"policy: ValueError: from {hook} {RAISED}"
    assert "Traceback" in record.details


@pytest.mark.parametrize("hook", ["usage", "close"])
def test_what_comes_after_the_verdict_stays_in_the_record(told: Any, hook: str) -> None:
    record = told(hook)
    assert (record.outcome, record.cause) == ("success", None)
    assert f"from {hook}" in record.details


@pytest.mark.parametrize(
    ("hook", "keys"),
    [("a key of the observation", "the observation has front_rgb, instruction, joint_positions"),
     ("a key of the video", "the demonstration has front_rgb, joint_positions")],
)  # fmt: skip
@pytest.mark.parametrize("process", ["shared", "own"])
def test_a_missing_key_comes_with_those_that_are_there(
    told: Any, hook: str, keys: str, process: str
) -> None:
    cause = told(hook, process=process).cause
    assert cause.startswith(f"policy: KeyError: 'front'; {keys} (throwing.py, line ")


def test_a_command_of_another_package_is_one_sentence(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.syspath_prepend(Path(__file__).parent)
    monkeypatch.setenv("HOOK", "command")
    monkeypatch.setattr(sys, "argv", ["roboirg", "theirs"])
    monkeypatch.setattr(cli.app, "registered_commands", list(cli.app.registered_commands))
    for name, value in (("theirs", "throwing:command"), ("none", "throwing:__doc__")):
        cli._add_outside(EntryPoint(name, value, cli.COMMANDS))
    with pytest.raises(SystemExit):
        cli.main()
    refused, raised = capsys.readouterr().err.splitlines()
    assert refused.startswith("roboirg: no command none: TypeError: ")
    assert raised == (
        f"roboirg: ValueError: from command {RAISED}; PYTHONDEVMODE=1 shows the traceback."
    )
