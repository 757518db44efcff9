"""What a user's own code raises is one sentence, with file and line of that code."""

from __future__ import annotations

import ast
import sys
from importlib.metadata import EntryPoint
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import hosting_fakes
import pytest
from hosting_fakes import paper_plan, paper_runner

from roboirg import main as cli
from roboirg.core.error_words import one_line
from roboirg.core.errors import InvalidValueError
from roboirg.records.store import read_records
from roboirg.runs.hosting.policy_opening import open_policy
from roboirg.runs.run.executor import InProcess
from roboirg.runs.run.runner import run_plan

IT = "throwing:It"
BOTH = "planner:throwing:Planner?hands=throwing:It"
RAISED = "(throwing.py, line 12)"
HOOKS = ("import", "class body", "__init__", "needs", "version", "reset", "act", "hear",
         "metadata", "subgoal")  # fmt: skip
PLANNED = ("planner's __init__", "planner's reset", "planner's plan", "follow")
KEYS = {"act": "observation has front_rgb, instruction", "reset": "demonstration has front_rgb"}


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Any:
    """Return what plays an episode in which something of `throwing` raises: the record, or why."""
    step = hosting_fakes.PaperWorld.step_chunk

    def and_speak(world: Any, rows: Any) -> Any:
        *found, info = step(world, rows)
        return *found, {**info, "heard": [{"text": "Go on.", "step": 1}]}

    monkeypatch.setattr(hosting_fakes.PaperWorld, "step_chunk", and_speak)

    def play(hook: str, spec: str = IT, process: str = "shared") -> Any:
        monkeypatch.setenv("HOOK", hook)
        monkeypatch.delitem(sys.modules, "throwing", raising=False)
        plan = paper_plan(spec, 1, policy_process=process)
        try:
            opened = plan.model_copy(update={"policies": tuple(map(open_policy, plan.policies))})
        except InvalidValueError as error:
            return SimpleNamespace(cause=str(error).rstrip("."), details="Traceback")
        run_plan(opened, tmp_path, paper_runner(opened, tmp_path), InProcess())
        return read_records(tmp_path)[0]

    return play


@pytest.mark.parametrize(
    ("hook", "spec", "process"),
    [*((hook, IT, "shared") for hook in HOOKS), *((hook, BOTH, "shared") for hook in PLANNED),
     ("act", IT, "own"), ("planner's plan", BOTH, "own")],
)  # fmt: skip
def test_what_a_user_wrote_has_its_place(told, hook, spec, process):
    found = told(hook, spec, process)
    kind = "SystemExit" if hook == "class body" else "ValueError"

    assert found.cause.endswith(f": {kind}: from {hook} {RAISED}")
    assert "Traceback" in found.details


@pytest.mark.parametrize(
    "run",
    [
        lambda: ast.literal_eval("1+"),
        lambda: exec(compile("1/0", "<made by a library>", "exec"), {}),  # noqa: S102
    ],
)
def test_code_without_a_file_has_the_place_that_runs_it(run):
    with pytest.raises((SyntaxError, ZeroDivisionError)) as raised:
        run()
    assert one_line(raised.value).rpartition(", line ")[0].endswith(Path(__file__).name)


@pytest.mark.parametrize("hook", ["usage", "close"])
def test_what_comes_after_the_verdict_stays_in_the_record(told, hook):
    record = told(hook)
    assert (record.outcome, record.cause) == ("success", None)
    assert f"from {hook}" in record.details


@pytest.mark.parametrize("hook", KEYS)
@pytest.mark.parametrize("process", ["shared", "own"])
def test_a_missing_key_comes_with_those_that_are_there(told, hook, process):
    assert told(f"a key in {hook}", process=process).cause == (
        f"policy: KeyError: 'front'; the {KEYS[hook]}, joint_positions (throwing.py, line 15)"
    )


def test_a_command_of_another_package_is_one_sentence(monkeypatch, capsys):
    monkeypatch.setenv("HOOK", "command")
    monkeypatch.delitem(sys.modules, "throwing", raising=False)
    monkeypatch.setattr(sys, "argv", ["roboirg", "theirs"])
    monkeypatch.setattr(cli.app, "registered_commands", list(cli.app.registered_commands))
    for name, value in (("theirs", "throwing:command"), ("none", "throwing:__doc__")):
        cli._add_outside(EntryPoint(name, value, cli.COMMANDS))

    with pytest.raises(SystemExit):
        cli.main()

    refused, raised = capsys.readouterr().err.splitlines()
    assert refused.startswith("roboirg: no command none: throwing:__doc__: TypeError: ")
    assert raised == (
        f"roboirg: ValueError: from command {RAISED}; PYTHONDEVMODE=1 shows the traceback."
    )
