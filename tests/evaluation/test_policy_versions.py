"""A checkpoint's results are never another's: which version a policy has, and what refuses it."""

from __future__ import annotations

import linecache
import os
from pathlib import Path
from typing import Any

import pytest
from evaluation_fakes import comparable
from hosting_fakes import paper_plan, paper_runner

from roboirg.core.errors import InvalidValueError
from roboirg.core.policy_ref import PolicyRef
from roboirg.evaluation.hosting.policy_opening import open_policy
from roboirg.evaluation.plan.plan_maker import make_plan
from roboirg.evaluation.records.record_codec import StoreError
from roboirg.evaluation.records.store import read_records
from roboirg.evaluation.run.executor import InProcess
from roboirg.evaluation.run.runner import run_plan
from roboirg.policies.by_name.finding import policy_of, read_policy
from roboirg.policies.contract.policy_version import file_fingerprint

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
SPELLINGS = {
    "on the object": {"made": f"self.version = {CHECKPOINT}"},
    "a property": {"on_class": f"version = property(lambda self: {CHECKPOINT})"},
    "a NumPy number": {"made": f"self.version = np.int64({CHECKPOINT})"},
    "a path": {"reset": f"self.version = pathlib.Path('ckpts', {CHECKPOINT})"},
    "a number behind a class's text": {
        "on_class": "version = 'base'", "reset": f"self.version = float({CHECKPOINT})",
    },
}  # fmt: skip
FOUND = {"on the object": "7", "a property": "7", "a NumPy number": "7", "a path": "ckpts/7",
         "a number behind a class's text": "7.0"}  # fmt: skip


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("CKPT", "7")

    def write_policy(**parts: str) -> PolicyRef:
        usual = {"on_class": "", "made": "pass", "reset": "pass"}
        (tmp_path / "checkpointed.py").write_text(BODY.format(**{**usual, **parts}))
        return read_policy("checkpointed:It", "mine")

    return write_policy


def play(folder: Path) -> None:
    plan = paper_plan("mine=checkpointed:It", 2)
    plan = plan.model_copy(update={"policies": tuple(map(open_policy, plan.policies))})
    run_plan(plan, folder, paper_runner(plan, folder), InProcess())


@pytest.mark.parametrize("spelling", SPELLINGS)
def test_another_checkpoint_does_not_get_into_the_folder(
    spelling: str, write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ref = write(**SPELLINGS[spelling])
    assert open_policy(ref).version == FOUND[spelling]
    for _ in range(2):  # the same one goes on
        play(tmp_path / "run")
    before = read_records(tmp_path / "run")
    assert {record.policy_version for record in before} == {FOUND[spelling]}
    monkeypatch.setenv("CKPT", "8")
    with pytest.raises(StoreError, match=rf"version {FOUND[spelling]}, but the policy is now vers"):
        play(tmp_path / "run")
    assert list(map(comparable, read_records(tmp_path / "run"))) == list(map(comparable, before))


@pytest.mark.parametrize("value", ["None", "''", "(1, 2)", "True", "object()"])
def test_what_is_no_version_is_one_sentence(value: str, write) -> None:
    for parts in ({"made": f"self.version = {value}"}, {"on_class": f"version = {value}"}):
        with pytest.raises(InvalidValueError, match=r"version of It is .*; it must be a text, num"):
            open_policy(write(**parts))


def test_one_that_differs_in_each_process_gives_no_verdict(write, tmp_path: Path) -> None:
    write(made="self.version = os.getpid()")
    play(tmp_path)
    assert {record.outcome for record in read_records(tmp_path)} == {"error"}
    assert "must be the same in every process" in str(read_records(tmp_path)[0].cause)


def test_a_policy_that_cannot_begin_is_not_taken_for_an_earlier_one(write, tmp_path: Path) -> None:
    write(made="self.version = 'a'")
    play(tmp_path)
    ref = open_policy(write(made="self.version = 'b'", reset="raise KeyError('front')"))
    assert (ref.version, ref.problem) == ("unknown", "reset(): KeyError: 'front'")
    with pytest.raises(StoreError, match=r"version a, but the policy cannot be opened .*KeyError"):
        play(tmp_path)
    with pytest.raises(InvalidValueError, match=r"cannot be made: ValueError: no GPU"):
        open_policy(write(made="raise ValueError('no GPU')"))


def test_a_command_opens_each_policy_once(write, tmp_path: Path) -> None:
    note = tmp_path / "opened"
    write(reset=f"open({str(note)!r}, 'a').write(instruction)")
    make_plan(["mine=checkpointed:It", "random"], tasks="PickXtimes", episodes="2")
    assert note.read_text() == "Put the red cube on the target."


def test_a_version_that_cannot_be_read_is_not_taken_for_none(write) -> None:
    for value in ("self.nett.name", 'os.environ["NOT_SET"]'):
        ref = write(on_class=f"version = property(lambda self: {value})")
        with pytest.raises(InvalidValueError, match="version of It cannot be read"):
            open_policy(ref)


def test_versions_that_differ_in_what_a_name_cannot_hold_are_two(write) -> None:
    values = (r"'a\n'", r"'a\\n'", r"'a\udc80'", "'a?'")
    assert len({open_policy(write(made=f"self.version = {one}")).version for one in values}) == 4


def test_without_a_version_another_class_or_part_of_a_system_is_another(
    write, tmp_path: Path
) -> None:
    write()
    parts = """
class Other(It): pass
class Hands(It):
    def follow(self, subgoal): pass
class Planner:
    {slots}
    def reset(self, instruction, demonstration): {reset}
    def plan(self, observation, step): return None
"""
    file = tmp_path / "checkpointed.py"
    before, found = file.read_text(), list[str]()
    planner = "planner:checkpointed:Planner"
    for slots, reset in (
        ("__slots__ = ('reports',)", "pass"),
        ("version = property(lambda self: self.late)", "self.late = 'set late'"),
    ):
        file.write_text(before + parts.format(slots=slots, reset=reset))
        for spec in (f"{planner}?hands=checkpointed:Hands", planner, "checkpointed:It",
                     "checkpointed:Other"):  # fmt: skip
            found.append(open_policy(read_policy(spec)).version)
    assert len(set(found)) == 8
    assert (found[4].partition(" + ")[0], found[5]) == ("set late", "set late + scripted hands")
    assert "unknown" not in "".join(found)


def test_two_versions_that_nobody_could_read_are_not_one(write, tmp_path: Path) -> None:
    write(reset="assert 'red cube on the target' not in instruction")
    plan = paper_plan("mine=checkpointed:It", 1, policy_process="shared")
    plan = plan.model_copy(update={"policies": tuple(map(open_policy, plan.policies))})
    run_plan(plan, tmp_path, paper_runner(plan, tmp_path), InProcess())
    with pytest.raises(StoreError, match="cannot be opened to read its version"):
        run_plan(plan, tmp_path, paper_runner(plan, tmp_path), InProcess())


def test_a_class_of_this_process_is_made_anew_in_each_run(monkeypatch: pytest.MonkeyPatch) -> None:
    class Batched:
        def __init__(self) -> None:
            self.version = os.environ["CKPT"]

        def begin(self, instruction: str, demonstration: object) -> None: ...

        def act_batch(self, states: object, observations: object) -> None: ...

    for checkpoint in ("7", "8"):
        monkeypatch.setenv("CKPT", checkpoint)
        assert open_policy(policy_of(Batched)).version == checkpoint


def test_a_class_of_a_notebook_that_changes_is_another() -> None:
    found = []
    for value in ("1", "2", "1"):
        cell, place = f"class It:\n    def act(self): return {value}\n", f"<cell {len(found)}>"
        linecache.cache[place] = len(cell), None, cell.splitlines(keepends=True), place
        namespace: dict[str, Any] = {"__name__": "no_module"}
        exec(compile(cell, place, "exec"), namespace)  # noqa: S102 - as a notebook does
        found.append(file_fingerprint(namespace["It"]))
    assert None not in found
    assert found[0] == found[2] != found[1]
