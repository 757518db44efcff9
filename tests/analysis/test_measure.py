"""Rates, gaps and corrected tests: against pandas, and by hand."""

from __future__ import annotations

from fractions import Fraction

import pandas as pd
import pytest
from flat_jobs import frame_of, make_results
from hypothesis import given, settings
from hypothesis import strategies as st
from made_records import make_record
from page_text import store

import roboirg
from roboirg.analysis.measures.measure import ALL_TASKS, summarize
from roboirg.analysis.results.option_labels import REFERENCE_OPTIONS
from roboirg.analysis.results.run_cells import cells_of
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.stats.paired_tests import Overlap


@pytest.fixture(scope="module")
def frame_of_two_policies(tmp_path_factory):
    """72 trials that all succeed: 2 policies, 2 tasks, 3 settings, 3 episodes, 2 policy seeds."""
    folder = tmp_path_factory.mktemp("run")
    plan = make_plan(
        "listener,forgetful", tasks="PickXtimes,VideoUnmask",
        settings="explicit,direct,reasoning", episodes="3", policy_seeds="0,1",
    )  # fmt: skip
    store(folder, [make_record(job, "success") for job in plan.jobs()])
    return roboirg.results(folder)


OUTCOMES_OF_72_TRIALS = st.lists(
    st.sampled_from(["success", "failure", "error"]), min_size=72, max_size=72
)


@settings(max_examples=8)
@given(OUTCOMES_OF_72_TRIALS)
def test_rates_and_counts_are_those_of_pandas(frame_of_two_policies, outcomes):
    """Two policies played three settings, each in 12 trials: 2 tasks, 3 episodes, 2 policy seeds.

    Hypothesis draws the 72 outcomes, among them errors, which do not count. pandas computes the
    expected rate, the mean over tasks of the share of successes.
    """
    frame = frame_of_two_policies.assign(outcome=outcomes)
    groups = frame.groupby(["policy", "setting"], sort=False)

    found = roboirg.measure(frame, ["policy", "setting"])

    assert [row.key for row in found] == list(groups.groups)
    for row in found:
        group = groups.get_group(row.key)
        judged = group[group["outcome"] != "error"]
        is_won = judged["outcome"] == "success"
        rate = is_won.groupby(judged["task"]).mean().mean()  # NaN if nothing was judged
        assert row.counts.successes == is_won.sum()
        assert row.counts.trials == len(judged)
        assert row.counts.errors == 12 - len(judged)
        assert float("nan" if row.rate is None else row.rate) == pytest.approx(rate, nan_ok=True)


def test_p_values_are_corrected_together_within_a_family():
    """A family is a policy here. Of 6 episodes explicit wins all (1), other settings lose some (0).

    An exact paired test of n episodes that differ to the same side has p = 2 / 2**n. Policy a loses
    6 in direct and 4 in reasoning; Holm's correction for two tests doubles the smaller p-value.
    Policy b loses 5 in direct, its only test.
    """
    frame = frame_of(
        make_results("111111", "explicit", policy="a"),
        make_results("000000", "direct", policy="a"),
        make_results("110000", "reasoning", policy="a"),
        make_results("111111", "explicit", policy="b"),
        make_results("100000", "direct", policy="b"),
    )

    found = roboirg.measure(
        frame, ["policy", "setting"], against={"setting": "explicit"}, family=["policy"]
    )

    corrected = {row.key: row.p_holm for row in found if row.key[1] != "explicit"}
    assert corrected == pytest.approx(
        {("a", "direct"): 2 * 2 / 2**6, ("a", "reasoning"): 2 / 2**4, ("b", "direct"): 2 / 2**5}
    )


@pytest.mark.parametrize("step", [1, -1], ids=["in order", "turned round"])
def test_a_rate_pooled_over_settings_counts_all_of_their_rows_in_any_order(
    frame_of_two_policies, step
):
    """A policy has 36 trials, of which it loses the 12 in the setting direct: 24 of 36.

    An episode has a row for each of three settings. Would find that one of them is kept.
    """
    is_direct = frame_of_two_policies["setting"] == "direct"
    outcomes = is_direct.map({True: "failure", False: "success"})
    frame = frame_of_two_policies.assign(outcome=outcomes)[::step]

    found = roboirg.measure(frame, ["policy"], pool=["instruction_options"])

    counts = {row.key[0]: (row.counts.successes, row.counts.trials, row.rate) for row in found}
    assert counts == {
        "listener": (24, 36, Fraction(2, 3)),
        "forgetful": (24, 36, Fraction(2, 3)),
    }


@pytest.fixture(scope="module")
def frame_of_two_forms(frame_of_two_policies):
    """The 72 trials with implicit instructions, which are won, and as many resolved ones, lost."""
    resolved = frame_of_two_policies.assign(
        form="resolved", outcome="failure", instruction_options="resolved"
    )
    return pd.concat([frame_of_two_policies, resolved])


def test_rates_of_implicit_and_resolved_instructions_are_refused_if_nothing_keeps_them_apart(
    frame_of_two_forms,
):
    """All implicit ones are won, all resolved ones lost: 50 % would be the rate of neither."""
    with pytest.raises(
        InvalidValueError, match=r"values of form \(implicit, resolved\): add 'form'"
    ):
        roboirg.measure(frame_of_two_forms, ["policy", "setting"])


def test_implicit_and_resolved_instructions_are_pooled_if_the_call_asks_for_it(frame_of_two_forms):
    """In each policy and setting 12 implicit trials are won and 12 resolved ones lost: 12 of 24."""
    pool = ["form", "instruction_options"]

    found = roboirg.measure(frame_of_two_forms, ["policy", "setting"], pool=pool)

    assert {(row.rate, row.counts.trials) for row in found} == {(Fraction(1, 2), 24)}


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"by": ["polcy"]}, "There is no column 'polcy'"),
        (
            {"by": ["policy"], "family": ["task"]},
            "The column 'task' is not in by: policy.",
        ),
        (
            {"by": ["policy"], "against": {"setting": "direct"}},
            "'setting' is not in by",
        ),
        (
            {"by": ["setting"], "against": {"setting": "drect"}},
            "no row with the setting 'drect'",
        ),
        (
            {"by": ["setting"]},
            r"over several values of policy \(forgetful, listener\): add 'policy' to by",
        ),
    ],
    ids=[
        "unknown column",
        "a family outside of by",
        "a reference outside of by",
        "unknown reference",
        "two policies in a group",
    ],
)
def test_a_call_that_asks_for_what_is_not_there_is_refused_with_the_reason(
    frame_of_two_policies, asked, words
):
    with pytest.raises(InvalidValueError, match=words):
        roboirg.measure(frame_of_two_policies, **asked)


def test_two_rows_about_the_same_trial_are_refused(frame_of_two_policies):
    twice = pd.concat([frame_of_two_policies, frame_of_two_policies])

    with pytest.raises(InvalidValueError, match="Several rows of a group are about"):
        roboirg.measure(twice, ["policy", "setting"])


@pytest.mark.parametrize(
    ("outcome", "reason"),
    [("Success", "'outcome' has 'Success';"), (True, "has True;"), (None, "has no value")],
)
def test_an_unknown_outcome_is_refused_rather_than_counted_as_a_failure(
    frame_of_two_policies, outcome, reason
):
    """The first of 72 rows has it. Known outcomes are success, failure and error."""
    frame = frame_of_two_policies.astype({"outcome": object})
    frame.loc[0, "outcome"] = outcome

    with pytest.raises(InvalidValueError, match=reason):
        roboirg.measure(frame, ["policy", "setting"])


@pytest.mark.parametrize("name", ["task", "episode", "policy_seed"])
def test_a_row_without_task_episode_or_seed_is_refused(frame_of_two_policies, name):
    frame = frame_of_two_policies.assign(**{name: pd.NA})

    with pytest.raises(InvalidValueError, match=f"{name!r} has no value in some row"):
        roboirg.measure(frame, ["policy", "setting"])


def test_a_column_that_stands_twice_is_refused(frame_of_two_policies):
    frame = pd.concat([frame_of_two_policies, frame_of_two_policies[["task"]]], axis=1)

    with pytest.raises(InvalidValueError, match="several columns 'task'"):
        roboirg.measure(frame, ["policy", "setting"])


def test_an_average_weighs_its_tasks_equally_and_a_suite_has_one_of_its_own():
    """Nine episodes of PickXtimes weigh as much as one of BinFill, which is of the same suite.

    A task without a suite counts among all tasks: 2 of 4 are won there.
    """
    results = [
        *make_results("111111111", task="PickXtimes"),
        *make_results("0", task="BinFill"),
        *make_results("0", task="VideoUnmask"),
        *make_results("1", task="SomethingElse"),
    ]

    found = summarize(cells_of(frame_of(results)))

    rates = {key.scope: summary.rate for key, summary in found.items()}
    assert rates == {
        "PickXtimes": 1,
        "BinFill": 0,
        "VideoUnmask": 0,
        "SomethingElse": 1,
        "counting": Fraction(1, 2),
        "permanence": 0,
        ALL_TASKS: Fraction(1, 2),
    }
    assert list(rates)[-1] == ALL_TASKS


def summary_of_all_tasks(results, options):
    """Return what is measured of some instruction options over all tasks."""
    (found,) = [
        summary
        for key, summary in summarize(cells_of(frame_of(results))).items()
        if key.scope == ALL_TASKS and key.options == options
    ]
    return found


def test_an_explicit_rate_has_an_interval_and_no_gap():
    """All 20 explicit episodes are won (1), and the same ones are lost in direct (0).

    The interval of 20 of 20 begins at 19 / (19 + 1.96²) = 0.832: one episode might be lost. A gap
    is to explicit, so explicit itself has none.
    """
    results = [*make_results("1" * 20, "explicit"), *make_results("0" * 20, "direct")]

    explicit = summary_of_all_tasks(results, REFERENCE_OPTIONS)

    assert explicit.interval == pytest.approx((0.832, 1), abs=1e-3)
    assert (explicit.gap, explicit.second_gap, explicit.p_holm) == (None, None, None)


def test_implicit_instructions_are_compared_with_explicit_ones_and_with_their_resolved_form():
    """Of 20 episodes explicit wins all (1), direct none (0), and its resolved form the first 15.

    The resolved form says what the direct one leaves open. So the gap of direct to explicit is -1,
    the second one, to the resolved form, -15 / 20. An exact test of 20 episodes, all to one side,
    has p = 2 / 2**20; as the resolved form is tested, too, Holm's correction doubles it.
    """
    results = [
        *make_results("1" * 20, "explicit"),
        *make_results("0" * 20, "direct"),
        *make_results("1" * 15 + "0" * 5, "direct", form="resolved"),
    ]

    direct = summary_of_all_tasks(results, InstructionOptions("direct"))

    assert (direct.gap.value, direct.second_gap.value) == (-1, -15 / 20)
    assert direct.p_holm == pytest.approx(2 * 2 / 2**20)
    assert direct.second_gap.overlap == Overlap(both=0, only_first=0, only_second=15, neither=5)


def test_a_suite_with_a_single_task_does_not_raise_the_p_values_of_suites_that_are_shown():
    """In each task, 8 episodes are won in explicit (1) and lost in direct (0).

    The suite *counting* has two of the tasks, so 16 episodes differ, and the exact test has p =
    2 / 2**16. The suite *permanence* has VideoUnmask alone, with p = 2 / 2**8; as it is shown as a
    task and not as a suite, it is no second test for which Holm's correction would double p.
    """
    results = []
    for task in ("PickXtimes", "BinFill", "VideoUnmask"):
        results += make_results("1" * 8, "explicit", task=task)
        results += make_results("0" * 8, "direct", task=task)

    found = summarize(cells_of(frame_of(results)))

    corrected = {key.scope: summary.p_holm for key, summary in found.items() if summary.gap}
    assert corrected["counting"] == pytest.approx(2 / 2**16)
    assert corrected["permanence"] == pytest.approx(2 / 2**8)
