"""A checkpoint's results are never another's: which version a policy has, and what refuses it."""

from __future__ import annotations

import linecache
import os
import sys
from pathlib import Path
from typing import Any

import pytest
from hosting_fakes import paper_plan, paper_runner
from run_fakes import comparable

from roboirg.core.errors import InvalidValueError
from roboirg.core.policy_ref import PolicyRef
from roboirg.policies.by_name.finding import policy_of, read_policy
from roboirg.policies.contract.policy_version import file_fingerprint
from roboirg.policies.opening import opened
from roboirg.records.record_codec import StoreError
from roboirg.records.store import read_records
from roboirg.runs.hosting.policy_opening import open_policy
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.run.executor import InProcess
from roboirg.runs.run.runner import run_plan

BODY = """
import os, pathlib
import numpy as np

class It:
    cameras = ()
    demonstration_frames = "none"
    {on_class}
    def __init__(self): {made}
    def reset(self, instruction, demonstration): {reset}
    def act(self, observation): return np.ones((24, 8))
"""
CHECKPOINT = 'os.environ["CKPT"]'
NUMBER_BEHIND_TEXT = {
    "on_class": "version = 'base'",
    "reset": f"self.version = float({CHECKPOINT})",
}


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "checkpointed", raising=False)
    monkeypatch.setenv("CKPT", "7")

    def write_policy(**parts: str) -> PolicyRef:
        (tmp_path / "checkpointed.py").write_text(code(**parts))
        return read_policy("checkpointed:It", "mine")

    return write_policy


def code(**parts: str) -> str:
    return BODY.format(**{"on_class": "", "made": "pass", "reset": "pass", **parts})


def found_here(**parts: str) -> PolicyRef:
    """Open a class in this process, as a policy's own process does."""
    namespace: dict[str, Any] = {"__name__": "no_module"}
    exec(code(**parts), namespace)  # noqa: S102 - as a notebook does
    return open_policy(policy_of(namespace["It"]))


def play(folder: Path) -> None:
    plan = paper_plan("mine=checkpointed:It", 1)
    plan = plan.model_copy(update={"policies": tuple(map(open_policy, plan.policies))})
    run_plan(plan, folder, paper_runner(plan, folder), InProcess())


@pytest.mark.parametrize(
    ("parts", "version"),
    [
        ({"made": f"self.version = {CHECKPOINT}"}, "7"),
        ({"on_class": f"version = property(lambda self: {CHECKPOINT})"}, "7"),
        ({"made": f"self.version = np.int64({CHECKPOINT})"}, "7"),
        ({"reset": f"self.version = pathlib.Path('ckpts', {CHECKPOINT})"}, "ckpts/7"),
        (NUMBER_BEHIND_TEXT, "7.0"),
    ],
)
def test_a_checkpoint_may_be_named_in_many_ways(parts, version, monkeypatch):
    monkeypatch.setenv("CKPT", "7")
    assert found_here(**parts).version == version


def test_another_checkpoint_does_not_get_into_the_folder(write, tmp_path, monkeypatch):
    write(**NUMBER_BEHIND_TEXT)
    for _ in range(2):  # the same one goes on
        play(tmp_path / "run")
    before = read_records(tmp_path / "run")
    assert {record.policy_version for record in before} == {"7.0"}

    monkeypatch.setenv("CKPT", "8")
    with pytest.raises(StoreError, match=r"mine whose policy version is 7\.0, but now it is 8\.0"):
        play(tmp_path / "run")

    write(made="self.version = 'b'", reset="raise KeyError('front')")
    with pytest.raises(StoreError, match=r"7.0, but the policy cannot be opened .*KeyError"):
        play(tmp_path / "run")
    assert list(map(comparable, read_records(tmp_path / "run"))) == list(map(comparable, before))


@pytest.mark.parametrize("value", ["None", "''", "(1, 2)", "True", "object()"])
def test_what_is_no_version_is_one_sentence(value):
    for parts in ({"made": f"self.version = {value}"}, {"on_class": f"version = {value}"}):
        with pytest.raises(InvalidValueError, match=r"version of It is .*; it must be a text, num"):
            found_here(**parts)


def test_one_that_differs_in_each_process_gives_no_verdict(write, tmp_path):
    write(made="self.version = os.getpid()")
    play(tmp_path)

    (record,) = read_records(tmp_path)

    assert record.outcome == "error"
    assert "must be the same in every process" in str(record.cause)


def test_a_policy_that_cannot_begin_has_a_problem():
    ref = found_here(made="self.version = 'b'", reset="raise KeyError('front')")
    assert (ref.version, ref.problem) == ("unknown", "reset(): KeyError: 'front'")


def test_a_command_opens_each_policy_once(write, tmp_path):
    note = tmp_path / "opened"
    write(reset=f"open({str(note)!r}, 'a').write(instruction)")

    make_plan(["mine=checkpointed:It", "random"], tasks="PickXtimes", episodes="2")

    assert note.read_text() == "Put the red cube on the target."


def test_a_version_that_cannot_be_read_is_not_taken_for_none():
    for value in ("self.nett.name", 'os.environ["NOT_SET"]'):
        with pytest.raises(InvalidValueError, match="version of It cannot be read"):
            found_here(on_class=f"version = property(lambda self: {value})")


def test_versions_that_differ_in_what_a_name_cannot_hold_are_two():
    values = (r"'a\n'", r"'a\\n'", r"'a\udc80'", "'a?'")
    assert len({found_here(made=f"self.version = {value}").version for value in values}) == 4


def test_without_a_version_another_class_or_part_of_a_system_is_another(write, tmp_path):
    write()
    file = tmp_path / "checkpointed.py"
    file.write_text(
        file.read_text()
        + """
class Other(It): pass
class Hands(It):
    def follow(self, subgoal): pass
class Planner:
    version = property(lambda self: self.late)
    def reset(self, instruction, demonstration): self.late = "set late"
    def plan(self, observation, step): return None
class Slots:
    __slots__ = ("reports",)
    def reset(self, instruction, demonstration): pass
    def plan(self, observation, step): return None
"""
    )
    planner = "planner:checkpointed:Planner"
    hands = "?hands=checkpointed:Hands"
    specs = ("checkpointed:It", "checkpointed:Other", planner + hands,
             f"planner:checkpointed:Slots{hands}")  # fmt: skip
    found = [opened(read_policy(spec)).version for spec in specs]
    file.write_text(file.read_text() + "\n")  # the code of the class has changed

    found += [opened(read_policy(spec)).version for spec in specs]

    assert len(set(found)) == 8
    assert found[2].partition(" + ")[0] == "set late"
    assert open_policy(read_policy(planner)).version == "set late + scripted hands"
    assert "unknown" not in "".join(found)


def test_two_versions_that_nobody_could_read_are_not_one(write, tmp_path):
    write(reset="assert 'red cube on the target' not in instruction")
    plan = paper_plan("mine=checkpointed:It", 1, policy_process="shared")
    plan = plan.model_copy(update={"policies": tuple(map(opened, plan.policies))})
    run_plan(plan, tmp_path, paper_runner(plan, tmp_path), InProcess())

    with pytest.raises(StoreError, match="cannot be opened to read its version"):
        run_plan(plan, tmp_path, paper_runner(plan, tmp_path), InProcess())


def test_a_class_of_this_process_is_made_anew_in_each_run(monkeypatch):
    class Batched:
        def __init__(self) -> None:
            self.version = os.environ["CKPT"]

        def begin(self, instruction: str, demonstration: object) -> None: ...

        def act_batch(self, states: object, observations: object) -> None: ...

    for checkpoint in ("7", "8"):
        monkeypatch.setenv("CKPT", checkpoint)
        assert open_policy(policy_of(Batched)).version == checkpoint


def test_a_class_of_a_notebook_that_changes_is_another():
    found = []
    for value in ("1", "2", "1"):
        cell = f"class It:\n    def act(self): return {value}\n"
        place = f"<cell {len(found)}>"
        linecache.cache[place] = len(cell), None, cell.splitlines(keepends=True), place
        namespace: dict[str, Any] = {"__name__": "no_module"}
        exec(compile(cell, place, "exec"), namespace)  # noqa: S102 - as a notebook does
        found.append(file_fingerprint(namespace["It"]))

    assert None not in found
    assert found[0] == found[2] != found[1]
