"""A checkpoint's results are never another's: which version a policy has, and what refuses it."""

import linecache
import os
import sys

import pytest
from hosting_fakes import fake_world_plan, fake_world_runner

from roboirg.core.errors import InvalidValueError
from roboirg.policies.by_name.finding import policy_of, read_policy
from roboirg.policies.contract.policy_version import file_fingerprint
from roboirg.policies.opening import opened
from roboirg.records.record_codec import StoreError
from roboirg.records.store import read_records
from roboirg.runs.hosting.policy_opening import open_policy
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.run.executor import InProcess
from roboirg.runs.run.runner import run_plan

CODE_OF_A_POLICY = """
import os, pathlib
import numpy as np

class It:
    cameras = ()
    demonstration_frames = "none"
    {on_class}
    def __init__(self): {made}
    def reset(self, instruction, demonstration): {reset}
    def act(self, observation): return np.ones((24, 8))
{other_classes}
"""
CHECKPOINT_VARIABLE = 'os.environ["CKPT"]'


@pytest.fixture
def write_policy_module(tmp_path, monkeypatch):
    """Return what writes the module `checkpointed`, with a class `It` that has some code in parts.

    The parts are its class body, `__init__` and `reset`; other classes may follow it.
    """
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "checkpointed", raising=False)
    monkeypatch.setenv("CKPT", "7")

    def write_policy(**parts):
        (tmp_path / "checkpointed.py").write_text(code(**parts))

    return write_policy


def code(**parts):
    """Return the code of the class `It`, in which the parts that are not given do nothing."""
    nothing = {"on_class": "", "made": "pass", "reset": "pass", "other_classes": ""}
    return CODE_OF_A_POLICY.format(**{**nothing, **parts})


def policy_opened_here(**parts):
    """Open a class in this process, as a policy's own process does."""
    namespace = {"__name__": "no_module"}
    exec(code(**parts), namespace)  # noqa: S102 - as a notebook does
    return open_policy(policy_of(namespace["It"]))


def play_one_episode(folder, **options):
    """Play an episode of the policy that was written, under the name *mine*, if it is missing."""
    plan = fake_world_plan("mine=checkpointed:It", 1, **options)
    plan = plan.model_copy(update={"policies": tuple(map(open_policy, plan.policies))})
    run_plan(plan, folder, fake_world_runner(plan, folder), InProcess())


@pytest.mark.parametrize(
    ("parts", "version"),
    [
        ({"made": f"self.version = {CHECKPOINT_VARIABLE}"}, "7"),
        ({"on_class": f"version = property(lambda self: {CHECKPOINT_VARIABLE})"}, "7"),
        ({"made": f"self.version = np.int64({CHECKPOINT_VARIABLE})"}, "7"),
        ({"reset": f"self.version = pathlib.Path('ckpts', {CHECKPOINT_VARIABLE})"}, "ckpts/7"),
        (
            {
                "on_class": "version = 'base'",
                "reset": f"self.version = float({CHECKPOINT_VARIABLE})",
            },
            "7.0",
        ),
    ],
)
def test_a_policy_may_give_its_version_as_text_number_or_path_when_made_or_reset(
    parts, version, monkeypatch
):
    """Here the version is that of a checkpoint, which the environment variable CKPT names.

    `parts` is code of a policy's class, in its body, its `__init__` (made) and its `reset`. What
    `reset` sets counts more than the version of the class.
    """
    monkeypatch.setenv("CKPT", "7")
    assert policy_opened_here(**parts).version == version


def test_a_run_does_not_go_on_with_a_policy_whose_version_cannot_be_read(
    write_policy_module, tmp_path
):
    """A run has played an episode of a policy with version *a*. Then its code was changed: it
    raises an error in its `reset`, after which its version would be read, so it may be any."""
    write_policy_module(made="self.version = 'a'")
    play_one_episode(tmp_path)

    write_policy_module(made="self.version = 'b'", reset="raise KeyError('front')")

    with pytest.raises(StoreError, match=r" a, but the policy cannot be opened .*KeyError"):
        play_one_episode(tmp_path)


@pytest.mark.parametrize("value", ["None", "''", "(1, 2)", "True", "object()"])
@pytest.mark.parametrize("part", ["made", "on_class"])
def test_a_version_that_is_neither_text_nor_number_is_refused(part, value):
    name = {"made": "self.version", "on_class": "version"}[part]

    with pytest.raises(InvalidValueError, match=r"version of It is .*; it must be a text, num"):
        policy_opened_here(**{part: f"{name} = {value}"})


def test_a_policy_whose_version_differs_from_process_to_process_gets_no_verdict(
    write_policy_module, tmp_path
):
    """The policy takes the number of its process for its version. It is read in one process before
    the run and in another one when it plays, so the episode ends in an error."""
    write_policy_module(made="self.version = os.getpid()")

    play_one_episode(tmp_path)

    (record,) = read_records(tmp_path)
    assert record.outcome == "error"
    assert "must be the same in every process" in record.cause


def test_a_policy_whose_reset_raises_is_opened_with_the_error_as_its_problem():
    ref = policy_opened_here(made="self.version = 'b'", reset="raise KeyError('front')")
    assert (ref.version, ref.problem) == ("unknown", "reset(): KeyError: 'front'")


def test_making_a_plan_opens_each_policy_once(write_policy_module, tmp_path):
    """To read its version, a policy is opened and reset with a made-up instruction; as this may
    take minutes, it is done once. The policy writes each instruction that it gets to a file."""
    note = tmp_path / "opened"
    write_policy_module(reset=f"open({str(note)!r}, 'a').write(instruction)")

    make_plan(["mine=checkpointed:It", "random"], tasks="PickXtimes", episodes="2")

    assert note.read_text() == "Put the red cube on the target."


@pytest.mark.parametrize("value", ["self.nett.name", 'os.environ["NOT_SET"]'])
def test_a_policy_whose_version_raises_is_refused_rather_than_taken_for_one_without(value):
    with pytest.raises(InvalidValueError, match="version of It cannot be read"):
        policy_opened_here(on_class=f"version = property(lambda self: {value})")


def test_versions_that_differ_only_in_unprintable_characters_stay_different():
    """Versions are escaped for records. The four are an *a* with a line break, with a backslash and
    an n, with half a character (a lone surrogate), and with a question mark; would find two that
    are escaped alike."""
    escaped = set()
    for value in (r"'a\n'", r"'a\\n'", r"'a\udc80'", "'a?'"):
        escaped.add(policy_opened_here(made=f"self.version = {value}").version)

    assert len(escaped) == 4


THREE_CLASSES_WITHOUT_A_VERSION = """
class Other(It): pass
class Hands(It):
    def follow(self, subgoal): pass
class Slots:
    __slots__ = ("reports",)
    def reset(self, instruction, demonstration): pass
    def plan(self, observation, step): return None
"""


@pytest.mark.parametrize(
    "policy",
    [
        "checkpointed:It",
        "checkpointed:Other",
        "planner:checkpointed:Slots?hands=checkpointed:Hands",
    ],
)
def test_a_policy_without_a_version_gets_another_one_when_its_module_changes(
    write_policy_module, policy
):
    """No class of the module `checkpointed` declares a version, so it follows from their code.

    The last policy is a planner, an object without attributes of its own, with what follows its
    subgoals, its hands. Each is opened before and after a comment is added to the module.
    """
    write_policy_module(other_classes=THREE_CLASSES_WITHOUT_A_VERSION)
    before = opened(read_policy(policy)).version

    write_policy_module(other_classes=THREE_CLASSES_WITHOUT_A_VERSION + "# changed")
    after = opened(read_policy(policy)).version

    assert before != after
    assert "unknown" not in before + after


def test_two_classes_of_a_module_without_a_version_have_different_ones(write_policy_module):
    """The version of both follows from the same file, and from the name of the class."""
    write_policy_module(other_classes="class Other(It): pass")

    it = opened(read_policy("checkpointed:It")).version
    other = opened(read_policy("checkpointed:Other")).version

    assert it != other


@pytest.mark.parametrize(
    ("policy", "version"),
    [
        ("planner:checkpointed:Planner", "set late + scripted hands"),
        ("planner:checkpointed:Planner?hands=checkpointed:Hands", "set late + hands-2"),
    ],
)
def test_a_hierarchical_policy_has_the_versions_of_planner_and_hands(
    write_policy_module, policy, version
):
    """A planner names subgoals, and its hands act on them: those of a user, or scripted ones of the
    benchmark. The planner here sets its version in its `reset` alone."""
    write_policy_module(
        other_classes="""
class Planner:
    def reset(self, instruction, demonstration): self.version = "set late"
    def plan(self, observation, step): return None
class Hands(It):
    version = "hands-2"
    def follow(self, subgoal): pass
"""
    )

    assert open_policy(read_policy(policy)).version == version


def test_a_policy_whose_version_cannot_be_read_cannot_go_on_in_its_run(
    write_policy_module, tmp_path
):
    """To read its version, a policy is opened with a made-up instruction, on which this one fails.

    It plays an episode all the same, with the version *unknown*. The same command is refused then,
    as two unknown versions may be of two checkpoints.
    """
    write_policy_module(reset="assert instruction != 'Put the red cube on the target.'")
    play_one_episode(tmp_path, policy_process="shared")

    with pytest.raises(StoreError, match="cannot be opened to read its version"):
        play_one_episode(tmp_path, policy_process="shared")


def test_a_run_whose_policy_could_not_be_opened_goes_on_once_it_can(write_policy_module, tmp_path):
    """A policy lacks its weights at first, so that its episode ends in an error.

    Then it has them, and the same command plays the episode again. The error is of an unknown
    version, which is not another one.
    """
    write_policy_module(reset="raise OSError('no weights')")
    play_one_episode(tmp_path)
    write_policy_module()

    play_one_episode(tmp_path)

    (record,) = read_records(tmp_path)
    assert record.outcome != "error"
    assert record.policy_version != "unknown"


@pytest.mark.parametrize("checkpoint", ["7", "8"])
def test_the_version_of_a_class_in_this_process_is_read_when_it_is_opened(monkeypatch, checkpoint):
    """An object of the class takes the value of CKPT, the name of a checkpoint, as its version. It
    is set after the policy was made of the class; would find the version of a checkpoint that was
    loaded for an earlier run."""

    class Batched:
        def __init__(self):
            self.version = os.environ["CKPT"]

        def begin(self, instruction, demonstration): ...

        def act_batch(self, states, observations): ...

    policy = policy_of(Batched)
    monkeypatch.setenv("CKPT", checkpoint)

    assert open_policy(policy).version == checkpoint


def class_of_a_notebook_cell(code, number):
    """Execute a cell that defines a class ``It``, as IPython does, and return the class."""
    place = f"<cell {number}>"
    linecache.cache[place] = len(code), None, code.splitlines(keepends=True), place
    namespace = {"__name__": "no_module"}
    exec(compile(code, place, "exec"), namespace)  # noqa: S102 - as a notebook does
    return namespace["It"]


def test_a_policy_class_of_a_notebook_is_another_after_its_cell_was_changed():
    """A class without a version gets one from its code (a fingerprint). In a notebook that is the
    code of a cell: it is executed, changed and executed, and changed back, which gives the first
    fingerprint again."""
    code = "class It:\n    def act(self): return 1\n"
    changed = "class It:\n    def act(self): return 2\n"

    first = file_fingerprint(class_of_a_notebook_cell(code, 1))
    second = file_fingerprint(class_of_a_notebook_cell(changed, 2))
    third = file_fingerprint(class_of_a_notebook_cell(code, 3))

    assert first is not None
    assert first == third
    assert second not in (first, None)
