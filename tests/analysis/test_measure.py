"""Rates, gaps and corrected tests: against pandas and statsmodels, and by hand."""

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
def test_rates_counts_and_corrected_tests_are_those_of_pandas_and_statsmodels(
    frame_of_two_policies, outcomes
):
    """A rate is the mean over tasks of the share of successes, where errors do not count.

    Hypothesis draws the 72 outcomes of two policies in three settings, so each policy and setting
    has 12 trials: 2 tasks, 3 episodes and 2 policy seeds. pandas computes the expected rates,
    statsmodels the p-values after Holm.
    """
    frame = frame_of_two_policies.assign(outcome=outcomes)
    judged = frame[frame["outcome"] != "error"]
    by = ["policy", "setting"]

    found = roboirg.measure(frame, by, against={"setting": "explicit"}, family=["policy"])

    assert [row.key for row in found] == list(frame.groupby(by, sort=False).groups)
    for row in found:
        policy, setting = row.key
        own = judged[(judged["policy"] == policy) & (judged["setting"] == setting)]
        won = own["outcome"] == "success"
        assert row.counts.trials == len(own)
        assert row.counts.successes == won.sum()
        assert row.counts.errors == 12 - len(own)
        if own.empty:
            assert row.rate is None
        else:
            assert float(row.rate) == pytest.approx(won.groupby(own["task"]).mean().mean())
    for policy in ("listener", "forgetful"):
        check_holm([row for row in found if row.gap and row.key[0] == policy])


def check_holm(rows):
    """Check that p-values of a family are corrected as statsmodels corrects them."""
    from statsmodels.stats.multitest import multipletests

    if rows:
        _, corrected, *_ = multipletests([row.gap.p_value for row in rows], method="holm")
        assert [row.p_holm for row in rows] == pytest.approx(list(corrected))


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


def test_implicit_and_resolved_instructions_have_rates_of_their_own(frame_of_two_forms):
    found = roboirg.measure(frame_of_two_forms, ["policy", "setting", "form"])

    assert {(row.key[-1], row.rate) for row in found} == {("implicit", 1), ("resolved", 0)}


def test_implicit_and_resolved_instructions_are_pooled_if_the_call_asks_for_it(frame_of_two_forms):
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


RESULTS_IN_TWO_FORMS = [
    *make_results("1" * 20, "explicit"),
    *make_results("0" * 20, "direct"),
    *make_results("1" * 15 + "0" * 5, "direct", form="resolved"),
]
"""Of 20 explicit wins all, direct none, and its *resolved* form, which names all, 15."""


def test_an_explicit_rate_has_an_interval_and_no_gap():
    """The interval of 20 of 20 begins at 19 / (19 + 1.96²) = 0.832: one episode might be lost."""
    explicit = summary_of_all_tasks(RESULTS_IN_TWO_FORMS, REFERENCE_OPTIONS)

    assert explicit.interval == pytest.approx((0.832, 1), abs=1e-3)
    assert explicit.gap is None
    assert explicit.second_gap is None
    assert explicit.p_holm is None


def test_p_values_are_corrected_for_both_forms_and_the_forms_are_compared():
    """An exact test of 20 episodes, all to one side, has p = 2 / 2^20; of two tests twice that.

    Would find p-values that ignore that two tests were made.
    """
    direct = summary_of_all_tasks(RESULTS_IN_TWO_FORMS, InstructionOptions("direct"))

    assert direct.gap.value == -1
    assert direct.p_holm == pytest.approx(2 * 2 / 2**20)
    assert direct.second_gap.value == -0.75
    assert direct.second_gap.overlap == (0, 0, 15, 5)


def test_a_suite_with_a_single_task_does_not_raise_the_p_values_of_suites_that_are_shown():
    """Of two tasks of counting and one of permanence, 8 explicit wins each are lost when direct."""
    results = []
    for task in ("PickXtimes", "BinFill", "VideoUnmask"):
        results += make_results("1" * 8, task=task)
        results += make_results("0" * 8, "direct", task=task)

    found = summarize(cells_of(frame_of(results)))

    corrected = {key.scope: summary.p_holm for key, summary in found.items() if summary.gap}
    assert corrected["counting"] == pytest.approx(2 / 2**16)
    assert corrected["permanence"] == pytest.approx(2 / 2**8)
