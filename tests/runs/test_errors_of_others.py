"""What a user's own code raises is one sentence, with file and line of that code."""

from __future__ import annotations

import ast
import sys
from importlib.metadata import EntryPoint
from pathlib import Path
from types import SimpleNamespace

import hosting_fakes
import pytest
from hosting_fakes import fake_world_plan, fake_world_runner

from roboirg import main as cli
from roboirg.core.error_words import one_line
from roboirg.core.errors import InvalidValueError
from roboirg.records.store import read_records
from roboirg.runs.hosting.policy_opening import open_policy
from roboirg.runs.run.executor import InProcess
from roboirg.runs.run.runner import run_plan

THROWING_POLICY = "throwing:It"
THROWING_PLANNER = "planner:throwing:Planner?hands=throwing:It"

POLICY_HOOKS = ("import", "class body", "__init__", "needs", "version", "reset", "act", "hear",
         "metadata", "subgoal")  # fmt: skip
PLANNER_HOOKS = ("planner's __init__", "planner's reset", "planner's plan", "follow")
KEYS_THAT_ARE_THERE = {
    "act": "observation has front_rgb, instruction",
    "reset": "demonstration has front_rgb",
}


@pytest.fixture
def record_after_raise_in(monkeypatch, tmp_path):
    """Return what plays an episode in which something of `throwing` raises: the record, or why."""
    step = hosting_fakes.FakeWorld.step_chunk

    def and_speak(world, rows):
        *found, info = step(world, rows)
        return *found, {**info, "heard": [{"text": "Go on.", "step": 1}]}

    monkeypatch.setattr(hosting_fakes.FakeWorld, "step_chunk", and_speak)

    def play(hook, spec=THROWING_POLICY, process="shared"):
        monkeypatch.setenv("HOOK", hook)
        monkeypatch.delitem(sys.modules, "throwing", raising=False)
        plan = fake_world_plan(spec, 1, policy_process=process)
        try:
            opened = plan.model_copy(update={"policies": tuple(map(open_policy, plan.policies))})
        except InvalidValueError as error:
            return SimpleNamespace(cause=str(error).rstrip("."), details="Traceback")
        run_plan(opened, tmp_path, fake_world_runner(opened, tmp_path), InProcess())
        return read_records(tmp_path)[0]

    return play


@pytest.mark.parametrize(
    ("hook", "spec", "process"),
    [*((hook, THROWING_POLICY, "shared") for hook in POLICY_HOOKS),
     *((hook, THROWING_PLANNER, "shared") for hook in PLANNER_HOOKS),
     ("act", THROWING_POLICY, "own"), ("planner's plan", THROWING_PLANNER, "own")],
)  # fmt: skip
def test_an_error_of_a_users_policy_is_recorded_with_the_file_and_line_that_raised_it(
    record_after_raise_in, hook, spec, process
):
    """The module throwing.py raises in one of its methods, in line 12, wherever it is called."""
    found = record_after_raise_in(hook, spec, process)
    kind = "SystemExit" if hook == "class body" else "ValueError"

    assert found.cause.endswith(f": {kind}: from {hook} (throwing.py, line 12)")
    assert "Traceback" in found.details


@pytest.mark.parametrize(
    "run",
    [
        lambda: ast.literal_eval("1+"),
        lambda: exec(compile("1/0", "<made by a library>", "exec"), {}),  # noqa: S102
    ],
)
def test_an_error_in_code_that_has_no_file_is_placed_where_that_code_was_run(run):
    with pytest.raises((SyntaxError, ZeroDivisionError)) as raised:
        run()
    assert one_line(raised.value).rpartition(", line ")[0].endswith(Path(__file__).name)


@pytest.mark.parametrize("hook", ["usage", "close"])
def test_an_error_after_the_verdict_changes_no_outcome_and_stays_in_the_details(
    record_after_raise_in, hook
):
    """A policy is asked for its usage, and closed, when its episode has been judged."""
    record = record_after_raise_in(hook)
    assert (record.outcome, record.cause) == ("success", None)
    assert f"from {hook}" in record.details


@pytest.mark.parametrize("hook", KEYS_THAT_ARE_THERE)
@pytest.mark.parametrize("process", ["shared", "own"])
def test_the_error_of_a_key_that_is_missing_lists_the_keys_that_are_there(
    record_after_raise_in, hook, process
):
    record = record_after_raise_in(f"a key in {hook}", process=process)

    assert record.cause == (
        f"policy: KeyError: 'front'; the {KEYS_THAT_ARE_THERE[hook]}, joint_positions "
        "(throwing.py, line 15)"
    )


def test_a_command_of_another_package_that_cannot_be_added_or_raises_prints_one_sentence(
    monkeypatch, capsys
):
    """`theirs` raises when it is called; `none` is a text, not a command."""
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
        "roboirg: ValueError: from command (throwing.py, line 12); PYTHONDEVMODE=1 shows the "
        "traceback."
    )
