"""What a user's own code raises is one sentence, with file and line of that code."""

import ast
import re
import sys
from importlib.metadata import EntryPoint
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


@pytest.fixture
def record_after_raise_in(monkeypatch, tmp_path):
    """Return what plays an episode in which a hook of `throwing` raises, and returns its record.

    Where the policy cannot even be opened, there is no record; then the reason stands as its cause.
    """
    step = hosting_fakes.FakeWorld.step_chunk

    def step_and_speak(world, rows):
        *found, info = step(world, rows)
        return *found, {**info, "heard": [{"text": "Go on.", "step": 1}]}

    monkeypatch.setattr(hosting_fakes.FakeWorld, "step_chunk", step_and_speak)

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
    "hook",
    ["import", "__init__", "needs", "version", "reset", "act", "hear", "metadata", "subgoal"],
)
def test_an_error_of_a_users_policy_is_recorded_with_the_file_and_line_that_raised_it(
    record_after_raise_in, hook
):
    """The module throwing.py raises in one of its methods, in line 12, wherever it is called."""
    record = record_after_raise_in(hook)

    assert record.cause.endswith(f": ValueError: from {hook} (throwing.py, line 12)")
    assert "Traceback" in record.details


def test_a_users_module_that_exits_is_an_error_like_any_other(record_after_raise_in):
    record = record_after_raise_in("class body")
    assert record.cause.endswith(": SystemExit: from class body (throwing.py, line 12)")


@pytest.mark.parametrize(
    "hook", ["planner's __init__", "planner's reset", "planner's plan", "follow"]
)
def test_an_error_of_a_users_planner_or_hands_is_recorded_with_file_and_line(
    record_after_raise_in, hook
):
    record = record_after_raise_in(hook, THROWING_PLANNER)
    assert record.cause.endswith(f": ValueError: from {hook} (throwing.py, line 12)")


@pytest.mark.parametrize(
    ("hook", "spec"), [("act", THROWING_POLICY), ("planner's plan", THROWING_PLANNER)]
)
def test_an_error_in_a_process_of_its_own_is_recorded_with_file_and_line(
    record_after_raise_in, hook, spec
):
    """The policy raises ValueError in one of its methods (`hook`), on line 12 of throwing.py."""
    record = record_after_raise_in(hook, spec, process="own")

    assert record.cause.endswith(f": ValueError: from {hook} (throwing.py, line 12)")
    assert "Traceback" in record.details


@pytest.mark.parametrize(
    "run",
    [
        lambda: ast.literal_eval("1+"),
        lambda: exec(compile("1/0", "<made by a library>", "exec"), {}),  # noqa: S102
    ],
    ids=["parsed", "compiled"],
)
def test_an_error_in_code_that_has_no_file_is_placed_where_that_code_was_run(run):
    with pytest.raises((SyntaxError, ZeroDivisionError)) as raised:
        run()

    assert re.search(r"test_errors_of_others\.py, line \d+", one_line(raised.value))


@pytest.mark.parametrize("hook", ["usage", "close"])
def test_an_error_after_the_verdict_changes_no_outcome_and_stays_in_the_details(
    record_after_raise_in, hook
):
    """A policy is asked for its usage, and closed, when its episode has been judged."""
    record = record_after_raise_in(hook)
    assert (record.outcome, record.cause) == ("success", None)
    assert f"from {hook}" in record.details


@pytest.mark.parametrize("process", ["shared", "own"])
@pytest.mark.parametrize(
    ("hook", "keys"),
    [
        ("act", "observation has front_rgb, instruction, joint_positions"),
        ("reset", "demonstration has front_rgb, joint_positions"),
    ],
)
def test_the_error_of_a_key_that_is_missing_lists_the_keys_that_are_there(
    record_after_raise_in, hook, keys, process
):
    record = record_after_raise_in(f"a key in {hook}", process=process)

    assert record.cause == f"policy: KeyError: 'front'; the {keys} (throwing.py, line 15)"


@pytest.fixture
def add_command(monkeypatch):
    """Return what adds a command of another package, of a name and a place in `throwing`."""
    monkeypatch.setenv("HOOK", "command")
    monkeypatch.delitem(sys.modules, "throwing", raising=False)
    monkeypatch.setattr(cli.app, "registered_commands", list(cli.app.registered_commands))
    return lambda name, place: cli._add_outside(EntryPoint(name, place, cli.COMMANDS))


def test_a_command_of_another_package_that_raises_prints_one_sentence(add_command, roboirg):
    """The command *theirs* is that of throwing.py, which raises ValueError on line 12."""
    add_command("theirs", "throwing:command")

    assert roboirg("theirs").err == (
        "roboirg: ValueError: from command (throwing.py, line 12); PYTHONDEVMODE=1 shows the "
        "traceback.\n"
    )


def test_an_entry_point_of_commands_that_is_no_command_prints_one_sentence(add_command, capsys):
    """It is a text."""
    add_command("none", "throwing:__doc__")

    printed = capsys.readouterr().err
    assert printed.startswith("roboirg: no command none: throwing:__doc__: TypeError: ")
    assert printed.count("\n") == 1
