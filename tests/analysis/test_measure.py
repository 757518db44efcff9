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
from roboirg.stats.intervals import wilson_interval


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> pd.DataFrame:
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
def test_measure_is_what_pandas_gives(played, data):
    outcomes = st.sampled_from(["success", "failure", "error"])
    drawn = data.draw(st.lists(outcomes, min_size=len(played), max_size=len(played)))
    frame = played.assign(outcome=drawn)
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


def test_rows_of_several_settings_are_pooled_in_any_order(played):
    """By policy alone an episode has a row for each setting; none gets lost."""
    rates = played.groupby(["policy", "task"])["success"].mean().groupby("policy").mean()
    for frame in (played, played[::-1]):
        for row in roboirg.measure(frame, ["policy"], pool=["instruction_options"]):
            assert float(row.rate or 0) == pytest.approx(rates[row.key[0]])
            assert row.counts.trials == (played["policy"] == row.key[0]).sum()


def test_a_rate_is_over_both_forms_only_if_the_call_names_them(played):
    """Implicit ones are won, resolved ones lost: 50 % is no success of either."""
    resolved = played.assign(form="resolved", outcome="failure", instruction_options="resolved")
    frame = pd.concat([played, resolved])
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
def test_a_wrong_question_is_one_sentence(played, asked, words):
    with pytest.raises(InvalidValueError, match=words):
        roboirg.measure(pd.concat([played, played]), **asked)


@pytest.mark.parametrize("outcome", ["Success", "success ", True, 1, None])
def test_an_outcome_that_is_none_is_no_failure(played, outcome):
    frame = played.astype({"outcome": object})
    frame.loc[0, "outcome"] = outcome
    with pytest.raises(InvalidValueError, match=f"'outcome' has (no value|{outcome!r};)"):
        roboirg.measure(frame, ["policy", "setting"])


@pytest.mark.parametrize("name", ["task", "episode", "policy_seed"])
def test_a_row_of_no_trial_is_refused(played, name):
    with pytest.raises(InvalidValueError, match=f"{name!r} has no value in some row"):
        roboirg.measure(played.assign(**{name: pd.NA}), ["policy", "setting"])


def test_a_column_that_stands_twice_is_refused(played):
    frame = pd.concat([played, played[["task"]]], axis=1)
    with pytest.raises(InvalidValueError, match="several columns 'task'"):
        roboirg.measure(frame, ["policy", "setting"])


def test_averages_are_unweighted_and_suites_stand_by_themselves():
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


def test_gaps_are_corrected_in_three_families_and_forms_compared():
    """All of 20 are won in explicit, none in direct, 15 in its resolved form."""
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
    assert explicit[0].interval == wilson_interval(20, 20)
    # An exact test of 20 episodes that differ, all to one side, next to that of the resolved form.
    assert [summary.p_holm for summary in direct] == pytest.approx([2 * 2 / 2**20] * 3)
    assert [summary.gap.value for summary in direct] == [-1] * 3
    assert direct[0].second_gap.value == -0.75
    assert direct[0].second_gap.overlap == (0, 0, 15, 5)
