"""Every task, every way to fail: events played without a simulator, judged by the real judge."""

from __future__ import annotations

import contextlib
import re
from pathlib import Path
from typing import get_args

import pytest
from attribution_cases import CASES, Case, NotOfferedError
from hypothesis import given, settings
from hypothesis import strategies as st
from staged import Staged
from syrupy.assertion import SnapshotAssertion

from roboirg.core.conditions import Fact, Rule, facts_of
from roboirg.core.episode import Episode
from roboirg.core.failures import FAILURES, FailureName
from roboirg.judging import FailureAttribution, Status, attribute_failure
from roboirg.tasks import every_task
from roboirg.tasks.splits.fingerprint import NOT_COUNTED, fingerprint, plain
from roboirg.tasks.splits.splits import get_episode

DOCUMENT = (Path(__file__).parents[2] / "docs" / "attribution.md").read_text()
TASKS = tuple(sorted({task for one in CASES for task in one.tasks}))
SAMPLE = [("test", index) for index in range(12)] + [("train", index) for index in range(4)]
"""Six easy, four medium and four hard episodes, at least."""

each_case = pytest.mark.parametrize(
    ("task", "one"),
    [
        pytest.param(task, one, id=f"{task}-{one.failure}-{one.play.__name__}")
        for one in CASES
        for task in one.tasks
    ],
)


def played(task: str, one: Case) -> list[Staged]:
    """The case in every episode of the sample that offers what it needs."""
    found = []
    # Words that name a side in a certain way are rare.
    for where in (*SAMPLE, *(("train", index) for index in range(4, 100))):
        if found and where not in SAMPLE:
            break
        staged = Staged(get_episode(task, *where))
        with contextlib.suppress(NotOfferedError):
            one.play(staged)
            found.append(staged)
    return found


@each_case
def test_each_way_to_fail_is_told(task: str, one: Case, snapshot: SnapshotAssertion) -> None:
    """With the object, the step and the words: as stored, of the last episode."""
    courses = played(task, one)
    assert courses, "no episode of the sample offers it"
    for staged in courses:
        found = staged.finding()
        assert found is not None
        assert found.failure == one.failure, (staged.episode.key, found, staged.judge.cause)
        assert (staged.judge.status is Status.FAILURE) == one.early
        check(staged, found)
    assert f"{found.step} {found.subject}: {found.sentence}" == snapshot


def check(staged: Staged, found: FailureAttribution) -> None:
    """What holds of every finding."""
    assert found.kind == FAILURES[found.failure].kind
    assert 0 <= found.step <= staged.step - staged.turn
    assert re.fullmatch(r"[A-Z].*[^.]\.", found.sentence)
    if found.subject is not None:
        assert found.subject in {item.name for item in staged.episode.scene.objects}


def test_every_task_has_the_failures_that_the_document_says_and_no_others() -> None:
    rows = re.findall(r"^\| ((?:\w+(?:, )?)+) \| ((?:`\w+`(?:, )?)+) \|$", DOCUMENT, re.MULTILINE)
    documented = {
        task: set(re.findall(r"\w+", failures))
        for names, failures in rows
        for task in names.split(", ")
    }
    tried = {task: {one.failure for one in CASES if task in one.tasks} for task in TASKS}
    assert tried == documented
    assert set(documented) == set(every_task())


def test_every_failure_is_defined_once_in_the_document() -> None:
    defined = re.findall(r"^\| (?:grounding|execution)? ?\| `(\w+)` \|", DOCUMENT, re.MULTILINE)
    assert tuple(defined) == tuple(FAILURES) == get_args(FailureName)


@pytest.mark.parametrize("task", TASKS)
def test_a_pose_that_cannot_be_reached_and_what_came_before(task: str) -> None:
    staged = Staged(get_episode(task, "test", 3)).tick(5)
    found = staged.finding(timed_out=False, cause="no way to (9, 9, 9)")
    assert found == FailureAttribution(
        "execution", "unreachable", None, 5, "Could not reach a pose: no way to (9, 9, 9)."
    )
    assert staged.finding(timed_out=False) is None


# Who does what is meant, and who does something else perfectly


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("where", SAMPLE, ids=lambda where: f"{where[0]}-{where[1]}")
def test_a_success_has_no_attribution(task: str, where: tuple[str, int]) -> None:
    episode = get_episode(task, *where)
    staged = Staged(episode).play(episode.stages)
    assert staged.judge.status is Status.SUCCESS
    assert staged.finding() is None
    assert staged.finding(timed_out=False) is None


episodes = st.builds(get_episode, st.sampled_from(TASKS), st.just("test"), st.integers(0, 49))


@given(episodes, st.floats(0, 1, exclude_max=True))
@settings(max_examples=80)
def test_right_acts_that_stop_early_fail_by_execution(episode: Episode, share: float) -> None:
    staged = Staged(episode).play(episode.stages)
    end = staged.turn + int(share * (staged.step - staged.turn))
    events = [event for event in staged.events if event.step <= end]
    found = attribute_failure(
        episode, events, timed_out=True, policy_start_step=staged.turn, elapsed_steps=end
    )
    assert found is not None
    assert found.kind == "execution"
    assert found.step <= end - staged.turn


@given(episodes, st.data())
@settings(max_examples=120)
def test_taking_one_thing_for_another_is_a_grounding_failure_or_none(
    episode: Episode, data: st.DataObject
) -> None:
    starts = [
        index
        for index, stage in enumerate(episode.stages)
        if stage.primitive.kind not in {"put_down", "press_below"}
        and stage.primitive.subject != "robot"
    ]
    begin = data.draw(st.sampled_from(starts))
    primitive = episode.stages[begin].primitive
    carried = primitive.kind in {"place_on", "drop_into", "put_into", "move_over"}
    right = str(primitive.place) if carried else primitive.subject
    kind = episode.scene[right].kind
    wrong = data.draw(st.sampled_from([item.name for item in episode.scene.of_kind(kind)]))
    staged = Staged(episode).play(episode.stages[:begin])
    for stage in episode.stages[begin:]:
        staged.do(stage, {right: wrong, wrong: right})
    found = staged.set(Fact("still", "robot")).tick(150).finding()
    assert (found is None) == (staged.judge.status is Status.SUCCESS)
    assert found is None or found.kind == "grounding"
    assert right != wrong or found is None


# Anything at all


def anything(episode: Episode) -> st.SearchStrategy[list[frozenset[Fact]]]:
    """Courses of facts of which most make no sense, though they are about what is there."""
    asked = {fact for stage in episode.stages for fact in facts_of(stage.expects)}
    asked |= {f for stage in episode.stages for one in stage.forbids for f in facts_of(one)}
    names = sorted({fact.subject for fact in asked} & {o.name for o in episode.scene.objects})
    touches = [Fact(kind, name) for name in names for kind in ("reached", "held", "lying")]
    some = st.sampled_from([*sorted(asked, key=str), *touches, Fact("still", "robot")])
    return st.lists(st.frozensets(some, max_size=4), max_size=25)


@given(episodes, st.data(), st.booleans())
@settings(max_examples=120)
def test_whatever_happens_there_is_one_attribution_of_a_failure_and_none_else(
    episode: Episode, data: st.DataObject, timed_out: bool
) -> None:
    done = data.draw(st.integers(0, len(episode.stages) - 1))
    staged = Staged(episode).play(episode.stages[:done])
    for facts in data.draw(anything(episode)):
        lasting = {fact for fact in staged.now if fact.kind == "binned"}
        staged.now = lasting | facts
        staged.tick(data.draw(st.integers(1, 40)))
    found = staged.finding(timed_out=timed_out)
    failed = staged.judge.status is Status.FAILURE
    assert (found is not None) == (failed or (timed_out and staged.judge.status is Status.ONGOING))
    if found is not None:
        check(staged, found)
        assert found == staged.finding(timed_out=timed_out)


# Details


def test_what_shows_late_is_dated_when_it_was_done() -> None:
    episode = next(
        found
        for found in (get_episode("BinFill", "test", index) for index in range(50))
        if len(found.goal.texts("colors")) < len({c.color for c in found.scene.of_kind("cube")})
        and len(found.stages) >= 7
    )
    named = episode.goal.texts("colors")
    wrong = next(c.name for c in episode.scene.of_kind("cube") if c.color not in named)
    staged = Staged(episode).lift(wrong).fill(wrong, "bin")
    done = staged.step
    found = staged.play(episode.stages[2:]).finding()
    assert staged.judge.status is Status.FAILURE
    assert found is not None
    assert (found.failure, found.subject) == ("wrong_object", wrong)
    assert staged.turn + found.step == done < staged.step


def test_a_misplaced_release_is_dated_and_the_right_ones_before_it_are_not_the_cause() -> None:
    episodes = (get_episode("BinFill", "test", index) for index in range(50))
    episode = next(found for found in episodes if len(found.stages) == 5)
    second = episode.stages[2].primitive.subject
    staged = Staged(episode).play(episode.stages[:2]).lift(second).drop(second)
    done = staged.step
    found = staged.press().finding()
    assert staged.judge.status is Status.FAILURE
    assert found is not None
    assert (found.failure, found.subject) == ("dropped", second)
    assert staged.turn + found.step == done
    episode = next(
        found
        for found in (get_episode("PickXtimes", "test", index) for index in range(50))
        if len(found.stages) == 5
    )
    cube = episode.stages[0].primitive.subject
    staged = Staged(episode).play(episode.stages[:2]).lift(cube).put(cube)
    done = staged.step
    found = staged.press().finding()
    assert found is not None
    assert found.failure == "misplaced"
    assert staged.turn + found.step == done - 1


def test_rules_name_their_failure_where_their_facts_cannot_tell() -> None:
    """A rule without a name has to be about acts that `mistake` can place."""
    for task in every_task():
        for index in range(4):
            stages = get_episode(task, "test", index).stages
            rules = {one for s in stages for one in s.forbids if isinstance(one, Rule)}
            for rule in rules:
                if rule.failure is None:
                    assert {fact.kind for fact in facts_of(rule)} <= {
                        "pressed",
                        "over",
                        "picked",
                        "binned",
                    }, rule
                else:
                    assert rule.failure in FAILURES


def test_how_a_failure_is_described_is_no_part_of_an_episode_s_identity() -> None:
    named, other = Rule(Fact("pressed", "b"), "x", "wrong_time"), Rule(Fact("pressed", "b"), "y")
    assert plain(named) == plain(other)
    assert plain(named) != plain(named._replace(condition=Fact("pressed", "c")))
    assert {("Rule", "cause"), ("Rule", "failure")} == NOT_COUNTED
    assert fingerprint([get_episode("StopCube", "test", 0)])
