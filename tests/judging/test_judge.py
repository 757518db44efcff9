"""The judge's rule, driven by synthetic facts."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from staged import judged

from roboirg.core.conditions import Fact, facts_of
from roboirg.core.episode import Primitive, Stage
from roboirg.judging import Status, changes, plain_subgoal
from roboirg.judging.judge import describe_object
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import get_episode

PICKED = Fact("picked", "a")
PLACED = Fact("placed", "a", "target")
PRESSED = Fact("pressed", "button")
STILL = Fact("still", "robot")


def stage(expects, *forbids, lasting=0):
    """Return a stage with the fact that completes it, and those that fail it."""
    primitive = Primitive("press", expects.subject)
    return Stage(expects, primitive, "do {at} it", forbids, points_at="a", lasting=lasting)


def judge_of(*stages):
    """Return a function from the facts of each control step to the judge that has seen them."""

    def after(*steps):
        return judged(stages, None, *steps)

    return after


def test_doing_what_each_stage_expects_in_order_is_a_success():
    """`stage(expected, forbidden)` is a step of the plan, and each list has the facts of one
    moment. The pick lasts for two moments, then the cube is placed; the button is never pressed."""
    after = judge_of(stage(PICKED, PRESSED), stage(PLACED, PRESSED))

    judge = after([], [PICKED], [PICKED], [PLACED])

    assert judge.status is Status.SUCCESS
    assert judge.cause is None


def test_doing_what_the_second_stage_expects_does_not_complete_the_first():
    """Two stages, a pick and then a placement. Only the facts of one moment are seen: the
    placement. It leaves the first stage, of index 0, due."""
    after = judge_of(stage(PICKED), stage(PLACED))

    assert after([PLACED]).index == 0


def test_one_control_step_completes_at_most_one_stage():
    """Both stages expect the same fact, which holds at one step, and then at two."""
    after = judge_of(stage(PICKED), stage(PICKED))

    assert after([PICKED]).index == 1
    assert after([PICKED], [PICKED]).status is Status.SUCCESS


def test_a_forbidden_fact_fails_even_if_the_expected_one_holds_too():
    """`stage(expected, forbidden)` is a step of the plan, with the words *do it*. It expects a pick
    and forbids to press the button; at the only moment both hold, and what is forbidden is tested
    first."""
    after = judge_of(stage(PICKED, PRESSED))

    judge = after([PICKED, PRESSED])

    assert judge.status is Status.FAILURE
    assert judge.cause == "pressed button; expected: do it"


def test_a_fact_that_completes_a_stage_and_is_forbidden_by_the_next_one_has_a_step_to_go_away():
    """The first stage expects a pick, which the second one forbids. The pick may hold at the moment
    that completes the first stage, but not at the next one."""
    after = judge_of(stage(PICKED), stage(PLACED, PICKED))

    assert after([PICKED], [PLACED]).status is Status.SUCCESS
    assert after([PICKED], [PICKED]).status is Status.FAILURE


def test_a_verdict_never_changes():
    """The stage expects a pick and forbids to press the button. The press of the first moment fails
    it; neither the pick of the second one nor another failure changes that."""
    after = judge_of(stage(PICKED, PRESSED))
    judge = after([PRESSED], [PICKED])

    judge.fail("too late")

    assert (judge.status, judge.cause) == (Status.FAILURE, "pressed button; expected: do it")


def test_a_success_stays_one_whatever_comes_after():
    """The stage expects a pick and forbids to press the button. The pick of the first moment
    completes the task; the press comes at the second one."""
    after = judge_of(stage(PICKED, PRESSED))

    assert after([PICKED], [PRESSED]).status is Status.SUCCESS


def test_a_stage_that_lasts_three_steps_is_complete_at_the_fourth_that_shows_its_fact():
    """Each list has the facts of a moment. Three steps have passed between the first and the fourth
    moment at which the robot is still."""
    after = judge_of(stage(STILL, lasting=3))

    assert after([STILL], [STILL], [STILL]).status is Status.ONGOING
    assert after([STILL], [STILL], [STILL], [STILL]).status is Status.SUCCESS


def test_a_stage_that_has_to_last_starts_again_after_an_interruption():
    """The robot must be still for three steps, which four moments in a row show. After two moments
    and a movement, two and three more are too few and, with the one that ends the interruption,
    enough."""
    after = judge_of(stage(STILL, lasting=3))
    interrupted = [[STILL], [STILL], []]

    assert after(*interrupted, [STILL], [STILL]).status is Status.ONGOING
    assert after(*interrupted, [STILL], [STILL], [STILL]).status is Status.SUCCESS


facts_of_a_step = st.frozensets(st.sampled_from([PICKED, PLACED, PRESSED, STILL]))


@given(st.lists(facts_of_a_step, max_size=20))
def test_the_facts_of_every_step_can_be_rebuilt_from_the_events(history):
    """`history` has the facts of up to 20 steps, any of four. `changes` returns the events of a
    step: which facts have begun to hold since the step before, and which have ceased. To add and
    remove these, from no facts on, must give the facts of each step."""
    before = frozenset()
    rebuilt = set()
    for step, now in enumerate(history):
        for event in changes(step, before, now):
            assert event.step == step
            if event.holds:
                rebuilt.add(event.fact)
            else:
                rebuilt.remove(event.fact)
        assert rebuilt == now
        before = now


TASKS_THAT_FORBID_FACTS = sorted({*every_task()} - {"StopCube", "PutInBox", "PickByCount"})
"""The three others have rules about counts or times only, which are tested for each of them."""


@pytest.mark.parametrize("task", TASKS_THAT_FORBID_FACTS)
def test_each_fact_that_a_task_forbids_fails_its_stage_with_a_cause(task):
    """A stage forbids facts, such as a pick of another cube, or rules, which have tests of their
    own. Each fact comes together with what the stage expects, when this stage is due: it fails all
    the same, and the cause names the object and what was expected, as in *picked up the red cube;
    expected: pick up the blue cube*."""
    episode = get_episode(task, "test", 3)

    for due in episode.stages:
        for wrong in due.forbids:
            if isinstance(wrong, Fact):
                judge = judged([due], episode.scene, [wrong, *facts_of(due.expects)])
                assert judge.status is Status.FAILURE, wrong
                assert describe_object(wrong.subject, episode.scene) in judge.cause
                assert plain_subgoal(due) in judge.cause
