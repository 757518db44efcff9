"""The judge's rule, driven by synthetic facts."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from staged import judged

from roboirg.core.conditions import Fact, Rule, facts_of
from roboirg.core.episode import Primitive, Stage
from roboirg.judging import Judge, Status, changes, plain_subgoal
from roboirg.judging.judge import describe_object
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import get_episode

A = Fact("picked", "a")
B = Fact("placed", "a", "target")
BAD = Fact("pressed", "button")


def stage(expects: Fact, *forbids: Fact, lasting: int = 0) -> Stage:
    primitive = Primitive("press", expects.subject)
    return Stage(expects, primitive, "do {at} it", forbids, points_at="a", lasting=lasting)


def test_stages_complete_in_order():
    judge = judged([stage(A, BAD), stage(B, BAD)], None, [], [A], [A], [B])
    assert judge.status is Status.SUCCESS
    assert judge.cause is None


def test_a_later_stage_does_not_complete_early():
    assert judged([stage(A), stage(B)], None, [B]).index == 0


def test_an_evaluation_ends_one_stage_at_most():
    judge = judged([stage(A), stage(A)], None, [A])
    assert (judge.index, judge.status) == (1, Status.ONGOING)

    judge.update(1, frozenset([A]))
    assert judge.status is Status.SUCCESS


def test_what_is_forbidden_counts_before_what_is_expected():
    judge = judged([stage(A, BAD)], None, [A, BAD])
    assert judge.status is Status.FAILURE
    assert judge.cause == "pressed button; expected: do it"


def test_what_ends_a_stage_is_not_held_against_the_next_in_the_same_step():
    # The cube is picked, which the next stage forbids; it is gone by the next evaluation.
    judge = judged([stage(A), stage(B, A)], None, [A], [B])
    assert judge.status is Status.SUCCESS
    assert judged([stage(A), stage(B, A)], None, [A], [A]).status is Status.FAILURE


def test_verdicts_are_final():
    judge = judged([stage(A, BAD)], None, [BAD], [A])
    judge.fail("too late")
    assert (judge.status, judge.cause) == (Status.FAILURE, "pressed button; expected: do it")

    judge = judged([stage(A, BAD)], None, [A], [BAD])
    assert judge.status is Status.SUCCESS


def test_lasting_stages_count_from_the_first_evaluation_and_start_again():
    still = Fact("still", "robot")
    watch = [stage(still, lasting=3)]
    assert judged(watch, None, *[[still]] * 3).status is Status.ONGOING
    assert judged(watch, None, *[[still]] * 4).status is Status.SUCCESS

    interrupted = [[still], [still], [], [still], [still]]
    assert judged(watch, None, *interrupted).status is Status.ONGOING
    assert judged(watch, None, *interrupted, [still]).status is Status.SUCCESS


facts = st.frozensets(st.sampled_from([A, B, BAD, Fact("still", "robot")]))


@given(st.lists(facts, max_size=20))
def test_events_tell_the_same_story_as_the_facts(history):
    before: frozenset[Fact] = frozenset()
    rebuilt: set[Fact] = set()
    for step, now in enumerate(history):
        for event in changes(step, before, now):
            assert event.step == step
            (rebuilt.add if event.holds else rebuilt.remove)(event.fact)
        assert rebuilt == now
        before = now


@pytest.mark.parametrize("task", every_task())
@pytest.mark.parametrize("index", range(4))
def test_every_forbidden_fact_of_every_stage_fails(task, index):
    episode = get_episode(task, "test", index)
    for number, stage in enumerate(episode.stages):
        for wrong in stage.forbids:
            if isinstance(wrong, Rule):
                continue  # driven by the rule tests of each task
            judge = Judge(episode.stages, episode.scene)
            judge.index = number
            judge.update(0, frozenset([wrong, *facts_of(stage.expects)]))
            assert judge.status is Status.FAILURE
            assert describe_object(wrong.subject, episode.scene) in str(judge.cause)
            assert plain_subgoal(stage) in str(judge.cause)
