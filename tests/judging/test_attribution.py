"""Why episodes failed: failures of known cause, the smallest inputs, and anything at all."""

from __future__ import annotations

import functools
import re
from types import SimpleNamespace
from typing import cast, get_args

import confusion
import pytest
from cause_making import play_cause, read_courses
from hypothesis import given, settings
from hypothesis import strategies as st
from made_causes import CAUSES
from staged import Staged

from roboirg.core.conditions import Fact, Rule, facts_of
from roboirg.core.episode import Episode
from roboirg.core.failures import FAILURES, FailureName
from roboirg.evaluation.play.episode_record import declared_intent
from roboirg.evaluation.records.record import Record
from roboirg.judging import DeclaredIntent, FailureAttribution, Status, attribute_failure
from roboirg.tasks import every_task
from roboirg.tasks.splits.fingerprint import NOT_COUNTED, fingerprint, plain
from roboirg.tasks.splits.splits import get_episode

TASKS = tuple(sorted(every_task()))
SAMPLE = [("test", index) for index in range(12)] + [("train", index) for index in range(4)]
"""Six easy, four medium and four hard episodes, at least."""
MADE = read_courses(confusion.HALVES["development"])
NAMES = sorted({str(one.failure) for one in MADE if one.kind not in ("success", "unscored")})
classes = functools.cache(lambda: confusion.classes(MADE))


# Failures whose cause is known


def test_kinds_are_right_where_the_cause_is_known() -> None:
    """More than of causes that the rules did not know."""
    found = confusion.scores(MADE)
    assert found.of_decided >= 0.95
    assert found.of_causes >= 0.9
    assert found.undecided <= 0.05
    assert found.kept_undecided >= 0.95


@pytest.mark.parametrize("name", NAMES)
def test_names_are_right_where_the_cause_is_known(name: str) -> None:
    many, kinds, names = classes()[name]
    assert kinds >= 0.8 * many
    assert names >= 0.6 * many


@pytest.mark.parametrize("half", [half for half, path in confusion.HALVES.items() if path.exists()])
def test_the_document_has_the_tables(half: str) -> None:
    text = confusion.DOCUMENT.read_text()
    assert confusion.put_in(text, "failures", confusion.failures_table()) == text
    courses = read_courses(confusion.HALVES[half])
    assert confusion.put_in(text, half, confusion.table(courses)) == text


@pytest.mark.sim
@pytest.mark.parametrize(
    "name", ["snatches_at_a_wrong_thing", "presses_beside_in_time", "opens_half_way", "trembles"]
)
def test_what_is_stored_is_what_the_simulator_does(name: str) -> None:
    """Attempts come from motion, not from the file."""
    stored = next(one for one in MADE if one.cause == name)
    cause = next(one for one in CAUSES if one.name == name)
    played = play_cause(cause, stored.episode)
    assert played is not None
    assert confusion.attribute(played) == confusion.attribute(stored)
    assert {one.fact for one in played.attempts} == {one.fact for one in stored.attempts}


def test_every_failure_is_of_a_kind_and_is_shown_to_users() -> None:
    assert get_args(FailureName) == tuple(FAILURES)


# The smallest inputs


def staged(task: str, picks: int = 1) -> Staged:
    """The first episode of a task with so many picks."""
    for index in range(50):
        episode = get_episode(task, "test", index)
        kinds = [stage.primitive.kind for stage in episode.stages]
        others = len(episode.scene.of_kind("cube")) > 1 or task.endswith("Unmask")
        if sum(kind.startswith("pick") for kind in kinds) == picks and others:
            return Staged(episode)
    raise AssertionError(task)


def first(play: Staged) -> str:
    return play.episode.stages[0].primitive.subject


def other(play: Staged) -> str:
    kind = play.episode.scene[first(play)].kind
    return next(o.name for o in play.episode.scene.of_kind(kind) if o.name != first(play))


def says(play: Staged, failure: str, subject: str | None = None) -> None:
    found = play.finding()
    assert found is not None
    check(play, found)
    assert (found.failure, found.subject) == (failure, subject or found.subject)


def test_one_of_several_grasps_missed_without_notice_is_no_count_error() -> None:
    play = staged("PickXtimes", 2)
    play.miss(first(play)).let_go_of_nothing("target").play(play.episode.stages[:2]).press()
    says(play, "missed_grasp", first(play))


def test_a_miss_that_was_noticed_excuses_no_count() -> None:
    play = staged("PickXtimes", 2)
    play.miss(first(play)).play(play.episode.stages[:2]).press()
    says(play, "wrong_count")


def test_all_grasps_missed_is_no_count_error_and_none_tried_is() -> None:
    play = staged("PickXtimes", 2)
    for _ in range(2):
        play.miss(first(play)).let_go_of_nothing("target")
    says(play.press(), "missed_grasp", first(play))
    says(staged("PickXtimes", 2).press(), "wrong_count")


def test_attempts_at_a_wrong_thing_are_the_wrong_thing() -> None:
    for end in (Staged.rest, Staged.press):
        play = staged("PickXtimes")
        says(end(play.miss(other(play)).miss(other(play))), "wrong_object", other(play))


def test_a_wrong_container_put_back_before_the_press_is_no_wrong_one() -> None:
    play = staged("ButtonUnmask")
    meant = play.episode.stages[1].primitive.subject
    wrong = next(c.name for c in play.episode.scene.of_kind("container") if c.name != meant)
    says(play.lift(wrong).put(wrong).rest(), "stopped")


def test_fingers_that_close_between_two_things_decide_nothing() -> None:
    play = staged("PickXtimes")
    both = (Fact("clutched", first(play)), Fact("clutched", other(play)))
    says(play.attempt(*both).rest(), "ambiguous_act")


def test_a_wrong_thing_only_touched_is_no_attempt() -> None:
    play = staged("PickXtimes")
    says(play.reach(other(play)).set(off=(Fact("reached", other(play)),)).rest(), "no_attempt")


def test_a_press_beside_the_button_is_a_missed_press() -> None:
    play = staged("ButtonUnmask")
    container = play.episode.stages[1].primitive.subject
    says(play.tick(40).press_beside().lift(container).rest(), "missed_press", "button")


def test_a_thing_that_falls_is_dropped_wherever_it_lands() -> None:
    play = staged("VideoPlaceOrder")
    place = play.episode.stages[1].primitive.place
    wrong = next(one.name for one in play.episode.scene.of_kind("target") if one.name != place)
    says(play.lift(first(play)).drop(first(play), wrong), "dropped", first(play))


@pytest.mark.parametrize(
    ("late", "failure"), [(0.3, "mistimed"), (-0.7, "ambiguous_act"), (-1.0, "wrong_time")]
)
def test_when_the_moving_cube_is_stopped(late: float, failure: str) -> None:
    play = Staged(get_episode("StopCube", "test", 0))
    interval = play.episode.scene.motions[0].interval  # type: ignore[union-attr]
    moment = play.episode.stages[-1].primitive.steps + round(late * interval)
    says(play.hover().until(moment - 2).press(), failure)


def test_hands_that_stop_or_do_nothing_decide_nothing() -> None:
    says(staged("PickXtimes").rest(), "no_attempt")
    play = staged("PickXtimes")
    says(play.play(play.episode.stages[:-1]).hover().rest(), "stopped")
    play = staged("PickXtimes")
    says(play.lift(first(play)).tick(300), "out_of_time")


@pytest.mark.parametrize(
    ("intent", "failure"),
    [
        (DeclaredIntent(True, None), "no_answer"),
        (DeclaredIntent(True, {"color": "purple", "repeats": 1}), "misunderstood"),
        (DeclaredIntent(verdicts=((0, "right"), (5, "wrong_thing"))), "wrong_object"),
        (DeclaredIntent(verdicts=((0, "right"),)), "not_followed"),
    ],
)
def test_what_was_declared_comes_before_acts(intent: DeclaredIntent, failure: str) -> None:
    play = staged("PickXtimes").rest()
    play.intent = intent
    says(play, failure)


@pytest.mark.parametrize("understood", ["the red one", {"confidence": 0.9}, ["red"], 3])
def test_what_another_policy_calls_understood_is_no_goal(understood: object) -> None:
    record = SimpleNamespace(
        policy_metadata={"understood": understood}, goal={"color": "red"}, subgoals=()
    )
    assert declared_intent(cast("Record", record)) is None


def test_who_understood_and_missed_failed_by_execution() -> None:
    play = staged("PickXtimes")
    play.intent = DeclaredIntent(True, dict(play.episode.goal.as_mapping()))
    says(play.miss(first(play)).rest(), "missed_grasp")


def check(staged: Staged, found: FailureAttribution) -> None:
    """What holds of every finding."""
    assert found.kind == FAILURES[found.failure].kind
    assert 0 <= found.step <= staged.step - staged.turn
    assert re.fullmatch(r"[A-Z].*[^.]\.", found.sentence)
    if found.subject is not None:
        assert found.subject in {item.name for item in staged.episode.scene.objects}


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
def test_right_acts_that_stop_early_are_no_grounding_failure(
    episode: Episode, share: float
) -> None:
    staged = Staged(episode).play(episode.stages)
    end = staged.turn + int(share * (staged.step - staged.turn))
    events = [event for event in staged.events if event.step <= end]
    found = attribute_failure(
        episode, events, timed_out=True, policy_start_step=staged.turn, elapsed_steps=end
    )
    assert found is not None
    assert found.kind != "grounding"
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
    found = staged.rest().finding()
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


def test_how_a_failure_is_described_is_no_part_of_an_episode_s_identity() -> None:
    named, other = Rule(Fact("pressed", "b"), "x", "wrong_time"), Rule(Fact("pressed", "b"), "y")
    assert plain(named) == plain(other)
    assert plain(named) != plain(named._replace(condition=Fact("pressed", "c")))
    assert {("Rule", "cause"), ("Rule", "failure")} == NOT_COUNTED
    assert fingerprint([get_episode("StopCube", "test", 0)])
