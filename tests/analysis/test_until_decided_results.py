"""What tables, comparisons and the page make of a run that stopped when it was decided."""

import pytest
from made_records import make_record
from run_fakes import FakePlay, changed, fake_run, small_plan

from roboirg.analysis.measures.breakdowns import BREAKDOWNS, break_down
from roboirg.analysis.measures.comparison import compare, compare_settings
from roboirg.analysis.measures.comparison_text import sentences
from roboirg.analysis.measures.measure import summarize
from roboirg.analysis.page.evidence_paths import evidence_paths
from roboirg.analysis.results.run_cells import cells_of
from roboirg.analysis.results.sources import Source
from roboirg.analysis.results.stored_side import against_stored
from roboirg.analysis.run_results import Results
from roboirg.core.errors import InvalidValueError
from roboirg.records.merging import merge_runs
from roboirg.runs.plan.plan_sections import StopRule
from roboirg.runs.plan.stored_plans import write_plan
from roboirg.runs.run.executor import InProcess
from roboirg.runs.run.runner import run_plan


@pytest.fixture(scope="module")
def stopped_run(tmp_path_factory):
    """Return the folder of a run over 50 scenes that stopped after 16.

    Explicit always succeeds, and direct in 7 of the 16.
    """
    folder = tmp_path_factory.mktemp("stopped")
    plan = changed(small_plan(50), stop=StopRule())
    fake_run(folder, plan)
    return folder


def test_episodes_that_need_not_be_played_have_an_outcome_of_their_own(stopped_run):
    """Of 2 x 50 planned episodes 2 x 16 count; none is missing."""
    outcomes = list(Source(stopped_run).frame["outcome"])

    assert outcomes.count("spared") == 2 * (50 - 16)
    assert outcomes.count("missing") == 0
    assert outcomes.count("success") == 16 + 7


def test_results_from_after_the_decision_count_nowhere(tmp_path):
    """A full run that is given the rule afterwards has the table of one that stopped."""
    full = small_plan(50)
    fake_run(tmp_path, full)

    fake_run(tmp_path, changed(full, stop=StopRule()))

    outcomes = list(Source(tmp_path).frame["outcome"])
    assert outcomes.count("spared") == 2 * (50 - 16)


def test_rates_of_a_stopped_run_have_neither_interval_nor_p_value(stopped_run):
    """Both are for a number of episodes that does not depend on the results."""
    summaries = summarize(cells_of(Source(stopped_run).frame))

    assert len(summaries) > 0
    for summary in summaries.values():
        assert summary.interval is None
        assert summary.gap is None
        assert summary.p_holm is None


def test_the_table_marks_a_stopped_run_and_prints_what_was_found(stopped_run):
    table = Results(stopped_run).table("main", "markdown")

    assert "random (until decided)" in table
    assert "43.75 ‡" in table
    assert "Until decided: random, direct to explicit: explicit is better, −56.3 points" in table
    assert "random has no headline number" not in table


def test_gaps_by_kind_of_words_of_a_stopped_run_have_neither_interval_nor_p_value(stopped_run):
    """Their episodes are those of the run, whose number depends on the results, too."""
    rows = break_down(Source(stopped_run).frame, BREAKDOWNS["difficulty"])

    assert len(rows) > 0
    for row in rows:
        assert row.rate is not None
        assert (row.interval, row.gap, row.p_holm) == (None, None, None)


def test_the_page_draws_the_evidence_from_the_first_scene_to_the_last_look(stopped_run):
    """The drawing is 600 wide for 50 planned scenes, so that the 16th is at 192.

    It ends above the dashed line, where a single comparison is decided: lower numbers are higher.
    """
    (path,) = evidence_paths([Source(stopped_run)])

    corners = path.points.split()
    last_left, last_height = corners[-1].split(",")
    assert corners[0] == "0.0,120.0"
    assert len(corners) == 1 + 16
    assert last_left == "192.0"
    assert float(last_height) < path.mark


def test_a_comparison_of_a_stopped_run_prints_only_what_holds_at_any_time(stopped_run):
    comparison = compare_settings(Source(stopped_run).frame)

    text = "\n".join(sentences(comparison, "random", "random"))

    assert "direct: explicit is better, −56.3 points, p = 0.043 after 16 of 50 scenes" in text
    assert "exact paired test" not in text
    assert "68 trials need not be played: what is compared was decided before." in text
    assert "Incomplete" not in text


def test_a_comparison_prints_of_uneven_tasks_what_the_stopped_run_printed(tmp_path):
    """Of PickXtimes there are 20 scenes, which oracle wins, and of BinFill 2, which it loses.

    The sum over scenes is decided for oracle, while each task counts a half in the points.
    """

    def play(job):
        if (job.policy == "oracle") == (job.task == "PickXtimes"):
            return make_record(job, "success")
        return make_record(job, "failure", "picked the wrong cube")

    stored = changed(small_plan(20), settings="direct")
    folder = tmp_path / "new"
    run_plan(stored, tmp_path, play, InProcess())
    run_plan(changed(stored, tasks="BinFill", episodes="2"), tmp_path, play, InProcess())
    new = changed(stored, policies="oracle", tasks="PickXtimes,BinFill")
    run_plan(against_stored(new, str(tmp_path), folder), folder, play, InProcess())

    first = Source(folder, policies=("oracle",)).frame
    second = Source(folder, policies=("random",)).frame
    lines = list(sentences(compare(first, second), "oracle", "random"))

    (compared,) = Source(folder).stopping.compared
    printed = compared.sentence.removeprefix("direct, oracle to random: ")
    assert "(of the sum over scenes, as tasks differ in size) after" in printed
    assert f"direct: {printed}" in lines


def test_a_full_run_is_compared_by_both_kinds_of_p_value(tmp_path):
    """The plan of 16 scenes was fixed before, so the exact test holds, too."""
    fake_run(tmp_path, small_plan(16))

    comparison = compare_settings(Source(tmp_path).frame)

    text = "\n".join(sentences(comparison, "random", "random"))
    assert "exact paired test" in text
    assert "However often one looked: direct p = " in text


def test_the_results_of_a_stored_policy_are_copied_once_and_become_a_side(tmp_path):
    """The stored policy ``random`` has played; ``oracle`` is the one that is to be compared."""
    stored = changed(small_plan(8), settings="direct")
    fake_run(tmp_path / "stored", stored)
    plan = changed(small_plan(8, policies=("oracle",)), settings="direct", stop=StopRule())
    folder = tmp_path / "new"

    first = against_stored(plan, str(tmp_path / "stored"), folder)
    again = against_stored(plan, f"{tmp_path / 'stored'}:random", folder)
    fake_run(folder, first)

    assert first == again
    assert first.stop.against == "random"
    (compared,) = Source(folder).stopping.compared
    assert compared.name == "direct, oracle to random"
    assert compared.decision.scenes == 8
    assert len(Source(folder).results) == 16


ORACLE_ALONE = small_plan(2, policies=("oracle",))


@pytest.mark.parametrize(
    ("stored", "plan", "complaint"),
    [
        (small_plan(2), small_plan(2), "give that another one with --policy NAME=SPEC"),
        (
            changed(small_plan(2), max_steps=100),
            ORACLE_ALONE,
            "no result of an episode of this plan",
        ),
        (
            small_plan(2),
            small_plan(2, policies=("oracle", "listener")),
            "this plan has several: oracle, listener",
        ),
    ],
    ids=["the same policy", "fewer steps than the plan allows", "a plan of two policies"],
)
def test_a_stored_side_that_cannot_be_compared_with_a_plan_is_refused(
    tmp_path, stored, plan, complaint
):
    """Results of a policy of the same name, for example, could not be told from the new ones."""
    fake_run(tmp_path / "stored", stored)

    with pytest.raises(InvalidValueError, match=complaint):
        against_stored(plan, str(tmp_path / "stored"), tmp_path / "new")


def test_results_that_an_earlier_plan_left_in_the_folder_are_no_trials(tmp_path):
    """The stored policy has seeds 0 and 1 there, and silent controls; the plan has seed 0 alone."""
    earlier = changed(small_plan(8, seeds=2), settings="direct", arms="told,silent")
    fake_run(tmp_path, earlier)
    plan = changed(
        small_plan(8, policies=("oracle",)), settings="direct", stop=StopRule(against="random")
    )

    fake_run(tmp_path, plan)

    source = Source(tmp_path)
    counts = {len(jobs) for scenes in source.stopping.trials.values() for jobs in scenes.values()}
    assert counts == {1}
    assert set(source.frame["arm"]) == {"told"}


def test_only_scenes_that_the_stored_policy_has_are_played(tmp_path):
    """It has played 4 of the 8 scenes, and one of these ended in an error that it had tries for."""
    stored = changed(small_plan(4), settings="direct")

    def play(job):
        if job.episode == 0:
            return make_record(job, "error", "lost", error="connection")
        return FakePlay()(job)

    run_plan(stored, tmp_path / "stored", play, InProcess())
    again = changed(stored, tries=9)
    plan = changed(small_plan(8, policies=("oracle",)), settings="direct", stop=StopRule(), tries=9)
    folder = tmp_path / "new"
    run_plan(again, folder, play, InProcess())
    plan = against_stored(plan, str(tmp_path / "stored"), folder)

    summary = fake_run(folder, plan)

    assert (summary.played, summary.spared) == (4, 4)
    (compared,) = Source(folder).stopping.compared
    assert not compared.is_open
    assert compared.decision.scenes == 3


def test_a_merged_run_is_still_marked(stopped_run, tmp_path):
    """A merged folder has the plans of its parts, but none of its own."""
    merge_runs([stopped_run], tmp_path / "merged")

    rows = summarize(cells_of(Source(tmp_path / "merged").frame))

    assert len(rows) > 0
    for row in rows.values():
        assert row.key.policy_run.is_until_decided
        assert row.interval is None


def test_results_of_a_run_that_played_task_by_task_have_no_bounds(tmp_path):
    """The first 8 of 16 scenes are no random half, so they do not say where the rest lies."""
    plan = small_plan(16)
    fake_run(tmp_path, small_plan(8))
    write_plan(plan, tmp_path)

    (figures,) = compare_settings(Source(tmp_path).frame).anytime

    assert figures.interval is None
    assert figures.text.endswith("after 8 of 16 scenes")
