"""Conditions say what they mean, for any course of events."""

import itertools

from hypothesis import given, settings
from hypothesis import strategies as st

from roboirg.core.conditions import All, Elapsed, Fact, FactCount, OccurrenceCount, absent
from roboirg.judging.fact_history import FactHistory

PICKED_A = Fact("picked", "a")
PICKED_B = Fact("picked", "b")
PRESSED = Fact("pressed", "button")
lists_of_simultaneous_facts = st.lists(
    st.frozensets(st.sampled_from([PICKED_A, PICKED_B, PRESSED])), min_size=1, max_size=15
)
bounds = st.integers(0, 4)


def history_of(course):
    history = FactHistory()
    for step, facts in enumerate(course):
        history.update(step, facts)
    return history


@settings(max_examples=60)
@given(lists_of_simultaneous_facts, bounds, st.none() | bounds)
def test_fact_count_counts_which_facts_hold_at_the_last_step(course, least, most):
    """`least` and `most` are bounds of the count; None is no bound."""
    now = sum(fact in course[-1] for fact in (PICKED_A, PICKED_B))
    wanted = now >= least and (most is None or now <= most)
    assert history_of(course).holds(FactCount((PICKED_A, PICKED_B), least, most)) == wanted


@settings(max_examples=60)
@given(lists_of_simultaneous_facts, st.integers(1, 4), st.none() | st.integers(0, 15))
def test_occurrence_count_counts_how_often_facts_have_begun_to_hold(course, least, until):
    """Up to the step `until`, if there is one."""
    considered = course if until is None else course[: until + 1]
    begun = 0
    for before, now in itertools.pairwise([frozenset(), *considered]):
        begun += sum(fact in now - before for fact in (PICKED_A, PRESSED))

    assert history_of(course).holds(OccurrenceCount((PICKED_A, PRESSED), least, until)) == (
        begun >= least
    )


@settings(max_examples=60)
@given(lists_of_simultaneous_facts)
def test_a_fact_and_its_absence_exclude_each_other(course):
    """`absent(fact)` is the condition that a fact does not hold, `All` that several do."""
    history = history_of(course)
    assert history.holds(PICKED_A) != history.holds(absent(PICKED_A))
    assert history.holds(All((PICKED_A, PICKED_B))) == (
        history.holds(PICKED_A) and history.holds(PICKED_B)
    )
    assert not history.holds(All((PICKED_A, absent(PICKED_A))))


def test_elapsed_time_counts_from_the_reset_or_from_the_first_start_of_a_timer():
    """Ten steps, 0 to 9; the timer is started at step 3 and again, without effect, at step 5."""
    history = FactHistory()
    assert not history.holds(Elapsed(0, timer="pick"))

    for step in range(10):
        history.update(step, frozenset())
        if step in {3, 5}:
            history.start_timer("pick")
    assert history.holds(Elapsed(9))
    assert not history.holds(Elapsed(10))
    assert history.holds(Elapsed(6, 6, timer="pick"))
    assert not history.holds(Elapsed(0, 5, timer="pick"))
    assert history.next_change(Elapsed(0, 5)) > history.step
