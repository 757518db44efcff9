"""Conditions say what they mean, for any course of events."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roboirg.core.conditions import All, Elapsed, Fact, FactCount, OccurrenceCount, absent
from roboirg.judging.fact_history import FactHistory

PICKED_A = Fact("picked", "a")
PICKED_B = Fact("picked", "b")
PRESSED = Fact("pressed", "button")
courses_of_facts = st.lists(
    st.frozensets(st.sampled_from([PICKED_A, PICKED_B, PRESSED])), min_size=1, max_size=15
)
"""The facts that hold at each step, from step 0 on."""
bounds = st.integers(0, 4)


def history_of(course):
    history = FactHistory()
    for step, facts in enumerate(course):
        history.update(step, facts)
    return history


@settings(max_examples=60)
@given(courses_of_facts, bounds, st.none() | bounds)
def test_fact_count_counts_which_facts_hold_at_the_last_step(course, least, most):
    """A course has the facts of each step. Counted are two picks, and at the last step alone;
    `least` and `most` are bounds of the count, and None is no bound."""
    condition = FactCount((PICKED_A, PICKED_B), least, most)

    holds = history_of(course).holds(condition)

    count = len(course[-1] & {PICKED_A, PICKED_B})
    assert holds == (count >= least and (most is None or count <= most))


@settings(max_examples=60)
@given(courses_of_facts, st.integers(1, 4), st.none() | st.integers(0, 15))
def test_occurrence_count_counts_how_often_facts_have_begun_to_hold(course, least, until):
    """A fact that holds for several steps in a row counts once. Only steps up to `until` count, if
    there is such a bound; the loop counts the same in the plainest way."""
    condition = OccurrenceCount((PICKED_A, PRESSED), least, until)

    holds = history_of(course).holds(condition)

    begun = 0
    before = frozenset()
    for step, now in enumerate(course):
        if until is None or step <= until:
            begun += len((now - before) & {PICKED_A, PRESSED})
        before = now
    assert holds == (begun >= least)


@settings(max_examples=60)
@given(courses_of_facts)
def test_a_fact_and_its_absence_exclude_each_other(course):
    """At the end of any course of facts, which has those of each step, one of the two holds, and
    never both."""
    history = history_of(course)

    assert history.holds(PICKED_A) != history.holds(absent(PICKED_A))
    assert not history.holds(All((PICKED_A, absent(PICKED_A))))


@settings(max_examples=60)
@given(courses_of_facts)
def test_all_holds_if_each_of_its_conditions_holds(course):
    """The course has the facts of each step. *All* asks for two picks, so it holds if both are
    among the facts of the last step."""
    both = All((PICKED_A, PICKED_B))

    assert history_of(course).holds(both) == ({PICKED_A, PICKED_B} <= course[-1])


def history_of_ten_steps():
    """Steps 0 to 9; a timer is started at step 3 and again, without effect, at step 5."""
    history = FactHistory()
    for step in range(10):
        history.update(step, frozenset())
        if step in {3, 5}:
            history.start_timer("pick")
    return history


@pytest.mark.parametrize(
    ("condition", "holds"),
    [
        (Elapsed(9), True),
        (Elapsed(10), False),
        (Elapsed(6, 6, timer="pick"), True),
        (Elapsed(0, 5, timer="pick"), False),
    ],
)
def test_elapsed_time_counts_from_the_reset_or_from_the_first_start_of_a_timer(condition, holds):
    """The two numbers are the least and the most steps, both included. It is step 9, and the timer
    "pick" was started at step 3, so 9 steps have passed since the reset and 6 on the timer; its
    second start, at step 5, has no effect."""
    assert history_of_ten_steps().holds(condition) == holds


def test_no_time_has_elapsed_of_a_timer_that_was_not_started():
    assert not FactHistory().holds(Elapsed(0, timer="pick"))


def test_an_elapsed_time_that_is_over_changes_after_the_last_step():
    """Ten steps, 0 to 9, have passed, so "0 to 5 steps" is false for ever: the next change must not
    be at a step that is still to be judged."""
    history = history_of_ten_steps()

    assert history.next_change(Elapsed(0, 5)) > 9
