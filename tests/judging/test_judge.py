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

PICKED = Fact("picked", "a")
PLACED = Fact("placed", "a", "target")
PRESSED = Fact("pressed", "button")


def stage_with_facts(expects, *forbids, lasting=0):
    primitive = Primitive("press", expects.subject)
    return Stage(expects, primitive, "do {at} it", forbids, points_at="a", lasting=lasting)


def test_doing_what_each_stage_expects_in_order_is_a_success():
    """A stage has the fact that it expects, then those that it
    forbids; each list holds the facts of one control step."""
    judge = judged(
        [stage_with_facts(PICKED, PRESSED), stage_with_facts(PLACED, PRESSED)],
        None,
        [],
        [PICKED],
        [PICKED],
        [PLACED],
    )
    assert judge.status is Status.SUCCESS
    assert judge.cause is None


def test_doing_what_the_second_stage_expects_does_not_complete_the_first():
    """Two stages, and one control step in which the fact that the second one expects holds."""
    assert judged([stage_with_facts(PICKED), stage_with_facts(PLACED)], None, [PLACED]).index == 0


def test_one_control_step_completes_at_most_one_stage():
    """Both stages expect the same fact, which holds in two steps."""
    judge = judged([stage_with_facts(PICKED), stage_with_facts(PICKED)], None, [PICKED])
    assert (judge.index, judge.status) == (1, Status.ONGOING)

    judge.update(1, frozenset([PICKED]))
    assert judge.status is Status.SUCCESS


def test_a_forbidden_fact_fails_even_if_the_expected_one_holds_too():
    """The stage expects a pick and forbids a press; both happen in the same step."""
    judge = judged([stage_with_facts(PICKED, PRESSED)], None, [PICKED, PRESSED])
    assert judge.status is Status.FAILURE
    assert judge.cause == "pressed button; expected: do it"


def test_a_fact_that_completes_a_stage_may_be_forbidden_by_the_next_one():
    """A stage has the fact that it expects, then those that it forbids. The
    fact has one step to go away; if it still holds then, the episode fails."""
    # The cube is picked, which the next stage forbids; it is gone by the next evaluation.
    judge = judged(
        [stage_with_facts(PICKED), stage_with_facts(PLACED, PICKED)], None, [PICKED], [PLACED]
    )
    assert judge.status is Status.SUCCESS
    assert (
        judged(
            [stage_with_facts(PICKED), stage_with_facts(PLACED, PICKED)],
            None,
            [PICKED],
            [PICKED],
        ).status
        is Status.FAILURE
    )


def test_a_verdict_never_changes():
    """The stage expects a pick and forbids a press; the other one comes a step later."""
    judge = judged([stage_with_facts(PICKED, PRESSED)], None, [PRESSED], [PICKED])
    judge.fail("too late")
    assert (judge.status, judge.cause) == (Status.FAILURE, "pressed button; expected: do it")

    judge = judged([stage_with_facts(PICKED, PRESSED)], None, [PICKED], [PRESSED])
    assert judge.status is Status.SUCCESS


def test_a_stage_that_has_to_last_starts_again_after_an_interruption():
    """The robot has to be still for three steps after the first one that shows it."""
    still = Fact("still", "robot")
    watch = [stage_with_facts(still, lasting=3)]
    assert judged(watch, None, *[[still]] * 3).status is Status.ONGOING
    assert judged(watch, None, *[[still]] * 4).status is Status.SUCCESS

    interrupted = [[still], [still], [], [still], [still]]
    assert judged(watch, None, *interrupted).status is Status.ONGOING
    assert judged(watch, None, *interrupted, [still]).status is Status.SUCCESS


facts = st.frozensets(st.sampled_from([PICKED, PLACED, PRESSED, Fact("still", "robot")]))


@given(st.lists(facts, max_size=20))
def test_the_facts_of_every_step_can_be_rebuilt_from_the_events(history):
    """An event is a change: a fact begins or ceases to hold."""
    before = frozenset()
    rebuilt = set()
    for step, now in enumerate(history):
        for event in changes(step, before, now):
            assert event.step == step
            (rebuilt.add if event.holds else rebuilt.remove)(event.fact)
        assert rebuilt == now
        before = now


@pytest.mark.parametrize("task", every_task())
@pytest.mark.parametrize("index", range(4))
def test_each_fact_that_a_task_forbids_fails_its_stage_with_a_cause(task, index):
    """Rules that are more than a fact are tested for each task elsewhere."""
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
