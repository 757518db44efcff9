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
def frame_of_two_policies(tmp_path_factory: pytest.TempPathFactory) -> pd.DataFrame:
    """Two policies and tasks, three episodes with two seeds in three settings."""
    folder = tmp_path_factory.mktemp("run")
    plan = make_plan(
        "listener,forgetful", tasks="PickXtimes,VideoUnmask",
        settings="explicit,direct,reasoning", episodes="3", policy_seeds="0,1",
    )  # fmt: skip
    store(folder, [make_record(job, "success") for job in plan.jobs()])
    return roboirg.results(folder)


@settings(max_examples=8)
@given(st.data())
def test_rates_counts_and_corrected_tests_are_those_of_pandas_and_statsmodels(
    frame_of_two_policies, data
):
    outcomes = st.sampled_from(["success", "failure", "error"])
    drawn = data.draw(
        st.lists(outcomes, min_size=len(frame_of_two_policies), max_size=len(frame_of_two_policies))
    )
    frame = frame_of_two_policies.assign(outcome=drawn)
    judged = frame[frame["outcome"] != "error"]
    judged = judged.assign(won=judged["outcome"] == "success")
    by = ["policy", "setting"]

    found = roboirg.measure(frame, by, against={"setting": "explicit"}, family=["policy"])

    assert [row.key for row in found] == list(frame.groupby(by, sort=False).groups)
    rates = judged.groupby([*by, "task"])["won"].mean().groupby(by).mean()
    for row in found:
        policy, setting = row.key
        own = judged[(judged["policy"] == policy) & (judged["setting"] == setting)]
        assert row.counts.trials == len(own)
        assert row.counts.successes == own["won"].sum()
        assert row.counts.errors == 3 * 2 * 2 - len(own)
        if own.empty:
            assert row.rate is None
        else:
            assert float(row.rate or 0) == pytest.approx(rates[row.key])
    for policy in ("listener", "forgetful"):
        check_holm([row for row in found if row.gap and row.key[0] == policy])


def check_holm(rows):
    """Check that p-values of a family are corrected as statsmodels corrects them."""
    from statsmodels.stats.multitest import multipletests

    if rows:
        _, corrected, *_ = multipletests([row.gap.p_value for row in rows], method="holm")
        assert [row.p_holm for row in rows] == pytest.approx(list(corrected))


def test_a_rate_pooled_over_settings_counts_all_of_their_rows_in_any_order(frame_of_two_policies):
    """By policy alone an episode has a row for each setting. Would find one kept of them."""
    rates = (
        frame_of_two_policies.groupby(["policy", "task"])["success"].mean().groupby("policy").mean()
    )
    for frame in (frame_of_two_policies, frame_of_two_policies[::-1]):
        for row in roboirg.measure(frame, ["policy"], pool=["instruction_options"]):
            assert float(row.rate or 0) == pytest.approx(rates[row.key[0]])
            assert row.counts.trials == (frame_of_two_policies["policy"] == row.key[0]).sum()


def test_implicit_and_resolved_instructions_are_pooled_only_if_the_call_asks_for_it(
    frame_of_two_policies,
):
    """All implicit ones are won, all resolved ones lost: 50 % would be the rate of neither."""
    resolved = frame_of_two_policies.assign(
        form="resolved", outcome="failure", instruction_options="resolved"
    )
    frame = pd.concat([frame_of_two_policies, resolved])
    with pytest.raises(
        InvalidValueError, match=r"values of form \(implicit, resolved\): add 'form'"
    ):
        roboirg.measure(frame, ["policy", "setting"])

    by_form = roboirg.measure(frame, ["policy", "setting", "form"])
    assert {(row.key[-1], row.rate) for row in by_form} == {("implicit", 1), ("resolved", 0)}

    both = roboirg.measure(frame, ["policy", "setting"], pool=["form", "instruction_options"])
    assert {(row.rate, row.counts.trials) for row in both} == {(Fraction(1, 2), 24)}


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"by": ["polcy"]}, "There is no column 'polcy'"),
        ({"by": ["policy"], "family": ["task"]}, "The column 'task' is not in by: policy."),
        ({"by": ["policy"], "against": {"setting": "direct"}}, "'setting' is not in by"),
        ({"by": ["setting"], "against": {"setting": "drect"}}, "no row with the setting 'drect'"),
        (
            {"by": ["setting"]},
            r"over several values of policy \(forgetful, listener\): add 'policy' to by",
        ),
        ({"by": ["policy", "setting"]}, "Several rows of a group are about"),
    ],
)
def test_a_call_that_asks_for_what_is_not_there_is_refused_with_the_reason(
    frame_of_two_policies, asked, words
):
    with pytest.raises(InvalidValueError, match=words):
        roboirg.measure(pd.concat([frame_of_two_policies, frame_of_two_policies]), **asked)


@pytest.mark.parametrize("outcome", ["Success", "success ", True, 1, None])
def test_an_unknown_outcome_is_refused_rather_than_counted_as_a_failure(
    frame_of_two_policies, outcome
):
    frame = frame_of_two_policies.astype({"outcome": object})
    frame.loc[0, "outcome"] = outcome
    with pytest.raises(InvalidValueError, match=f"'outcome' has (no value|{outcome!r};)"):
        roboirg.measure(frame, ["policy", "setting"])


@pytest.mark.parametrize("name", ["task", "episode", "policy_seed"])
def test_a_row_without_task_episode_or_seed_is_refused(frame_of_two_policies, name):
    with pytest.raises(InvalidValueError, match=f"{name!r} has no value in some row"):
        roboirg.measure(frame_of_two_policies.assign(**{name: pd.NA}), ["policy", "setting"])


def test_a_column_that_stands_twice_is_refused(frame_of_two_policies):
    frame = pd.concat([frame_of_two_policies, frame_of_two_policies[["task"]]], axis=1)
    with pytest.raises(InvalidValueError, match="several columns 'task'"):
        roboirg.measure(frame, ["policy", "setting"])


def test_an_average_weighs_its_tasks_equally_and_a_suite_has_one_of_its_own():
    """Nine episodes of PickXtimes weigh as much as one of BinFill, which is of the same suite.

    A task without a suite counts among all tasks: 2 of 4 are won there.
    """
    results = [
        *make_results("1" * 9, task="PickXtimes"),
        *make_results("0", task="BinFill"),
        *make_results("0", task="VideoUnmask"),
        *make_results("1", task="SomethingElse"),
    ]
    found = summarize(cells_of(frame_of(results)))
    rates = {key.scope: summary.rate for key, summary in found.items()}
    tasks = {"PickXtimes": 1, "BinFill": 0, "VideoUnmask": 0, "SomethingElse": 1}

    assert rates == {
        **tasks,
        "counting": Fraction(1, 2),
        "permanence": 0,
        ALL_TASKS: Fraction(1, 2),
    }
    assert list(rates)[-1] == ALL_TASKS


def test_p_values_are_corrected_for_both_forms_and_the_forms_are_compared():
    """Of 20 explicit wins all, direct none, and its *resolved* form, which names all, 15.

    Would find p-values that ignore that two tests were made.
    """
    results = [
        *make_results("1" * 20),
        *make_results("0" * 20, "direct"),
        *make_results("1" * 15 + "0" * 5, "direct", form="resolved"),
    ]
    summaries = summarize(cells_of(frame_of(results)))
    explicit = [summary for key, summary in summaries.items() if key.options == REFERENCE_OPTIONS]

    direct = [
        summary for key, summary in summaries.items() if key.options == InstructionOptions("direct")
    ]

    assert [(summary.gap, summary.p_holm, summary.second_gap) for summary in explicit] == [
        (None, None, None)
    ] * 3
    assert explicit[0].interval == pytest.approx((0.832, 1), abs=1e-3)  # 19 / (19 + 1.96²)
    # An exact test of 20 episodes, all to one side, has p = 2 / 2^20; of two tests: times 2.
    assert [summary.p_holm for summary in direct] == pytest.approx([2 * 2 / 2**20] * 3)
    assert [summary.gap.value for summary in direct] == [-1] * 3
    assert direct[0].second_gap.value == -0.75
    assert direct[0].second_gap.overlap == (0, 0, 15, 5)


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
