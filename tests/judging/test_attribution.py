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
from staged import Staged, named_facts

from roboirg.core.conditions import Fact, Rule
from roboirg.core.episode import Episode
from roboirg.core.failures import FAILURES, FailureName
from roboirg.judging import DeclaredIntent, FailureAttribution, Status, attribute_failure
from roboirg.records.record import Record
from roboirg.runs.play.episode_record import declared_intent
from roboirg.tasks import every_task
from roboirg.tasks.splits.fingerprint import NOT_COUNTED, fingerprint, plain
from roboirg.tasks.splits.splits import get_episode

TASKS = tuple(sorted(every_task()))
SAMPLE = [("test", index) for index in range(12)] + [("train", index) for index in range(4)]
"""Six easy, four medium and four hard episodes, at least."""
MADE = read_courses(confusion.HALVES["development"])
NAMES = sorted({str(made.failure) for made in MADE if made.kind not in ("success", "unscored")})
classes = functools.cache(lambda: confusion.classes(MADE))


# Failures whose cause is known


def test_kinds_are_right_where_the_cause_is_known():
    """More than of causes that the rules did not know."""
    found = confusion.scores(MADE)
    assert found.of_decided >= 0.95
    assert found.of_causes >= 0.9
    assert found.undecided <= 0.05
    assert found.kept_undecided >= 0.95


@pytest.mark.parametrize("name", NAMES)
def test_names_are_right_where_the_cause_is_known(name):
    many, kinds, names = classes()[name]
    assert kinds >= 0.8 * many
    assert names >= 0.6 * many


@pytest.mark.parametrize("half", [half for half, path in confusion.HALVES.items() if path.exists()])
def test_the_document_has_the_tables(half):
    text = confusion.DOCUMENT.read_text()
    assert confusion.put_in(text, "failures", confusion.failures_table()) == text

    courses = read_courses(confusion.HALVES[half])
    assert confusion.put_in(text, half, confusion.table(courses)) == text


@pytest.mark.sim
@pytest.mark.parametrize(
    "name",
    ["takes_the_nearest_of_another_kind", "presses_beside_in_time", "opens_half_way", "trembles"],
)
def test_what_is_stored_is_what_the_simulator_does(name):
    """Facts and attempts come from motion, not from the file.

    On another family of processors the motion, and so the step, may be another.
    """
    stored = next(made for made in MADE if made.cause == name)
    cause = next(cause for cause in CAUSES if cause.name == name)
    played = play_cause(cause, stored.episode)
    assert played is not None

    found = confusion.attribute(played)
    expected = confusion.attribute(stored)
    assert found._replace(step=0) == expected._replace(step=0)
    assert {attempt.fact for attempt in played.attempts} == {
        attempt.fact for attempt in stored.attempts
    }
    assert {event.fact for event in played.events} == {event.fact for event in stored.events}


def test_every_failure_is_of_a_kind_and_is_shown_to_users():
    assert get_args(FailureName) == tuple(FAILURES)


# The smallest inputs


def staged(task: str, index: int) -> Staged:
    return Staged(get_episode(task, "test", index))


def says(play: Staged, failure: str) -> None:
    found = play.finding()
    assert found is not None
    check(play, found)
    assert found.failure == failure


def test_a_miss_that_was_noticed_excuses_no_count():
    play = staged("PickXtimes", 18)  # the blue cube, twice
    play.miss("cube_blue").play(play.episode.stages[:2]).press()
    says(play, "wrong_count")


def test_a_wrong_container_put_back_before_the_press_is_no_wrong_one():
    play = staged("ButtonUnmask", 0)  # container_0 is meant
    says(play.lift("container_1").put("container_1").rest(), "stopped")


def test_fingers_that_close_between_two_things_decide_nothing():
    both = (Fact("clutched", "cube_blue"), Fact("clutched", "cube_red"))
    says(staged("PickXtimes", 2).attempt(*both).rest(), "ambiguous_act")


def test_a_wrong_thing_only_touched_is_no_attempt():
    play = staged("PickXtimes", 2)  # the blue cube is meant
    says(play.reach("cube_red").set(off=(Fact("reached", "cube_red"),)).rest(), "no_attempt")


@pytest.mark.parametrize(
    ("late", "failure"), [(0.3, "mistimed"), (-0.7, "ambiguous_act"), (-1.0, "wrong_time")]
)
def test_when_the_moving_cube_is_stopped(late, failure):
    play = staged("StopCube", 0)
    interval = play.episode.scene.motions[0].interval  # type: ignore[union-attr]
    moment = play.episode.stages[-1].primitive.steps + round(late * interval)
    says(play.hover().until(moment - 2).press(), failure)


@pytest.mark.parametrize(
    ("intent", "failure"),
    [
        (DeclaredIntent(True, None), "no_answer"),
        (DeclaredIntent(True, {"color": "purple", "repeats": 1}), "misunderstood"),
        (DeclaredIntent(verdicts=((0, "right"), (5, "wrong_thing"))), "wrong_object"),
        (DeclaredIntent(verdicts=((0, "right"),)), "not_followed"),
    ],
)
def test_what_was_declared_comes_before_acts(intent, failure):
    play = staged("PickXtimes", 2).rest()
    play.intent = intent
    says(play, failure)


@pytest.mark.parametrize("understood", ["the red one", {"confidence": 0.9}, ["red"], 3])
def test_what_another_policy_calls_understood_is_no_goal(understood):
    record = SimpleNamespace(
        policy_metadata={"understood": understood}, goal={"color": "red"}, subgoals=()
    )
    assert declared_intent(cast("Record", record)) is None


def check(play: Staged, found: FailureAttribution) -> None:
    """What holds of every finding."""
    assert found.kind == FAILURES[found.failure].kind
    assert 0 <= found.step <= play.step - play.turn
    assert re.fullmatch(r"[A-Z].*[^.]\.", found.sentence)
    if found.subject is not None:
        assert found.subject in {item.name for item in play.episode.scene.objects}


@pytest.mark.parametrize("task", TASKS)
def test_a_pose_that_cannot_be_reached_and_what_came_before(task):
    play = staged(task, 3).tick(5)
    found = play.finding(timed_out=False, cause="no way to (9, 9, 9)")

    assert found == FailureAttribution(
        "execution", "unreachable", None, 5, "Could not reach a pose: no way to (9, 9, 9)."
    )
    assert play.finding(timed_out=False) is None


def test_an_episode_that_ends_in_its_demonstration_has_a_failure() -> None:
    episode = get_episode("VideoPlaceOrder", "test", 1)
    found = attribute_failure(episode, [], timed_out=True, policy_start_step=0, elapsed_steps=50)
    assert found is not None
    assert found.failure == "no_attempt"


# Who does what is meant, and who does something else perfectly


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("where", SAMPLE, ids=lambda where: f"{where[0]}-{where[1]}")
def test_a_success_has_no_attribution(task, where):
    episode = get_episode(task, *where)
    play = Staged(episode).play(episode.stages)

    assert play.judge.status is Status.SUCCESS
    assert play.finding() is None
    assert play.finding(timed_out=False) is None


episodes = st.builds(get_episode, st.sampled_from(TASKS), st.just("test"), st.integers(0, 49))


@given(episodes, st.floats(0, 1, exclude_max=True))
@settings(max_examples=80)
def test_right_acts_that_stop_early_are_no_grounding_failure(episode, share):
    play = Staged(episode).play(episode.stages)
    end = play.turn + int(share * (play.step - play.turn))
    events = [event for event in play.events if event.step <= end]

    found = attribute_failure(
        episode, events, timed_out=True, policy_start_step=play.turn, elapsed_steps=end
    )

    assert found is not None
    assert found.kind != "grounding"
    assert found.step <= end - play.turn


@given(episodes, st.data())
@settings(max_examples=120)
def test_taking_one_thing_for_another_is_a_grounding_failure_or_none(episode, data):
    begin = data.draw(st.sampled_from(stages_with_a_thing(episode)))
    primitive = episode.stages[begin].primitive
    right = primitive.subject
    if primitive.kind in {"place_on", "drop_into", "put_into", "move_over"}:
        right = str(primitive.place)
    alike = episode.scene.of_kind(episode.scene[right].kind)
    wrong = data.draw(st.sampled_from([item.name for item in alike]))

    play = Staged(episode).play(episode.stages[:begin])
    for stage in episode.stages[begin:]:
        play.do(stage, {right: wrong, wrong: right})
    found = play.rest().finding()

    assert (found is None) == (play.judge.status is Status.SUCCESS)
    if found is not None:
        assert found.kind == "grounding"
        assert right != wrong


def stages_with_a_thing(episode: Episode) -> list[int]:
    """Return the places of the stages that take a thing or go to one."""
    found = []
    for index, stage in enumerate(episode.stages):
        primitive = stage.primitive
        if primitive.kind not in {"put_down", "press_below"} and primitive.subject != "robot":
            found.append(index)
    return found


# Anything at all


def anything(episode: Episode) -> st.SearchStrategy[list[frozenset[Fact]]]:
    """Courses of facts of which most make no sense, though they are about what is there."""
    asked = sorted(set(named_facts(episode.stages)), key=str)
    objects = {thing.name for thing in episode.scene.objects}
    touches = []
    for name in sorted(objects & {fact.subject for fact in asked}):
        touches += [Fact(kind, name) for kind in ("reached", "held", "lying")]
    fact = st.sampled_from([*asked, *touches, Fact("still", "robot")])
    return st.lists(st.frozensets(fact, max_size=4), max_size=25)


@given(episodes, st.data(), st.booleans())
@settings(max_examples=120)
def test_whatever_happens_there_is_one_attribution_of_a_failure_and_none_else(
    episode, data, timed_out
):
    done = data.draw(st.integers(0, len(episode.stages) - 1))
    play = Staged(episode).play(episode.stages[:done])
    for facts in data.draw(anything(episode)):
        lasting = {fact for fact in play.now if fact.kind == "binned"}
        play.now = lasting | facts
        play.tick(data.draw(st.integers(1, 40)))
    found = play.finding(timed_out=timed_out)

    failed = play.judge.status is Status.FAILURE

    assert (found is not None) == (failed or (timed_out and play.judge.status is Status.ONGOING))
    if found is not None:
        check(play, found)
        assert found == play.finding(timed_out=timed_out)


# Details


def test_what_shows_late_is_dated_when_it_was_done():
    play = staged("BinFill", 2)  # green cubes are meant, three or more
    play.lift("cube_blue_0").fill("cube_blue_0", "bin")
    done = play.step

    found = play.play(play.episode.stages[2:]).finding()

    assert play.judge.status is Status.FAILURE
    assert found is not None
    assert (found.failure, found.subject) == ("wrong_object", "cube_blue_0")
    assert play.turn + found.step == done < play.step


def test_how_a_failure_is_described_is_no_part_of_an_episode_s_identity():
    named = Rule(Fact("pressed", "b"), "x", "wrong_time")
    other = Rule(Fact("pressed", "b"), "y")

    assert plain(named) == plain(other)
    assert plain(named) != plain(named._replace(condition=Fact("pressed", "c")))
    assert {("Rule", "cause"), ("Rule", "failure")} == NOT_COUNTED
    assert fingerprint([get_episode("StopCube", "test", 0)])
