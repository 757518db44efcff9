"""Conditions say what they mean, for any course of events."""

import itertools

from hypothesis import given, settings
from hypothesis import strategies as st

from roboirg.core.conditions import All, Elapsed, Fact, FactCount, OccurrenceCount, absent
from roboirg.judging.fact_history import FactHistory

A, B, C = Fact("picked", "a"), Fact("picked", "b"), Fact("pressed", "button")
courses = st.lists(st.frozensets(st.sampled_from([A, B, C])), min_size=1, max_size=15)
bounds = st.integers(0, 4)


def followed(course):
    history = FactHistory()
    for step, facts in enumerate(course):
        history.update(step, facts)
    return history


@settings(max_examples=60)
@given(courses, bounds, st.none() | bounds)
def test_counts_are_of_now(course, least, most):
    now = sum(fact in course[-1] for fact in (A, B))
    wanted = now >= least and (most is None or now <= most)
    assert followed(course).holds(FactCount((A, B), least, most)) == wanted


@settings(max_examples=60)
@given(courses, st.integers(1, 4), st.none() | st.integers(0, 15))
def test_beginnings_are_counted_as_they_happen(course, least, until):
    kept = [frozenset(), *(course if until is None else course[: until + 1])]
    begun = sum(
        fact in now and fact not in before
        for before, now in itertools.pairwise(kept)
        for fact in (A, C)
    )
    assert followed(course).holds(OccurrenceCount((A, C), least, until)) == (begun >= least)


@settings(max_examples=60)
@given(courses)
def test_a_fact_and_its_absence_exclude_each_other(course):
    history = followed(course)
    assert history.holds(A) != history.holds(absent(A))
    assert history.holds(All((A, B))) == (history.holds(A) and history.holds(B))
    assert not history.holds(All((A, absent(A))))


def test_time_is_counted_from_reset_or_from_a_timer_that_starts_once():
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
