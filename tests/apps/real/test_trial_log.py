"""Verdicts are stored at once, can be corrected, and are never lost."""

import pytest
from made_records import fill, make_record

from roboirg.apps.real.pages.score_server import _select_trial
from roboirg.apps.real.study.failure_choices import failure_choices
from roboirg.apps.real.study.trial_log import VOID, TrialLog, trial_metadata
from roboirg.core.errors import InvalidValueError
from roboirg.records.store import read_records


@pytest.fixture
def trial_log(small):
    """The scores of a study of four trials, of which none is scored."""
    plan, folder = small
    return TrialLog.read(plan, folder)


def test_a_success_is_a_record_with_the_operators_note(small, trial_log):
    plan, folder = small
    trial_log.score(plan.trials[0], "success", operator="ann", note="shaky")

    (record,) = read_records(folder)

    assert record.identity == plan.trials[0].identity
    assert (record.outcome, record.attribution, record.robot) == ("success", None, "a robot")
    assert trial_metadata(record) == {
        "operator": "ann", "note": "shaky", "trial": plan.trials[0].name,
        "plan": plan.fingerprint,
    }  # fmt: skip


def test_a_failure_of_grounding_is_a_record_with_its_attribution(small, trial_log):
    """The first choice of the task PutInBox is a wrong place."""
    plan, folder = small
    trial = plan.trials[1]
    choice = failure_choices(trial.episode)[0]
    trial_log.score(trial, choice.key, operator="ann")

    (record,) = read_records(folder)

    assert (record.outcome, record.cause) == ("failure", record.attribution.sentence)
    assert (record.attribution.kind, record.attribution.failure) == ("grounding", "wrong_place")


def test_a_failure_of_execution_is_a_record_with_the_note_as_its_cause(small, trial_log):
    plan, folder = small
    trial_log.score(plan.trials[2], "dropped", operator="ann", note="slipped")

    (record,) = read_records(folder)

    assert (record.attribution.kind, record.attribution.step) == ("execution", None)
    assert "slipped" in record.cause
    assert record.plan == plan.fingerprint


def test_the_newest_score_counts_and_all_stay_in_the_file(small):
    """The operator names the video once."""
    plan, folder = small
    trial = plan.trials[0]
    TrialLog.read(plan, folder).score(trial, "misplaced", operator="ann", video="a.mp4")
    TrialLog.read(plan, folder).score(trial, "success", operator="ann", note="after all")

    (newest,) = read_records(folder)

    assert (newest.outcome, newest.cause, newest.attribution) == ("success", None, None)
    assert newest.video == "a.mp4"
    assert trial_metadata(newest)["note"] == "after all"
    assert len((folder / "records.jsonl").read_text().splitlines()) == 2


@pytest.mark.parametrize(("choice", "state"), [("success", "scored"), ("void", "void")])
def test_a_trial_that_is_scored_twice_is_at_its_second_revision(small, choice, state):
    plan, folder = small
    trial = plan.trials[0]
    TrialLog.read(plan, folder).score(trial, "misplaced", operator="ann")
    TrialLog.read(plan, folder).score(trial, choice, operator="ann")

    trial_log = TrialLog.read(plan, folder)

    assert trial_log.state(trial.name) == state
    assert trial_log.revision(trial.name) == 2


def test_trials_come_in_order_and_none_is_next_when_all_are_scored(small, trial_log):
    """The page then shows the last one."""
    plan, _ = small
    for trial in plan.trials:
        assert trial_log.next_to_score() == trial
        trial_log.score(trial, "void", operator="ann")

    assert trial_log.next_to_score() is None
    assert _select_trial(trial_log, "") == plan.trials[-1]


def test_a_void_trial_has_the_operators_note_as_its_cause(small, trial_log):
    plan, _ = small
    trial_log.score(plan.trials[0], "void", operator="ann", note="the lamp fell")

    assert trial_log.newest(plan.trials[0].name).cause == f"{VOID}; the lamp fell"


def test_what_simulation_played_is_no_score(small):
    plan, folder = small
    fill(folder, make_record(plan.trials[0].job, "success"))

    assert TrialLog.read(plan, folder).state(plan.trials[0].name) == "open"


def test_a_failure_that_the_task_cannot_have_is_refused_and_not_stored(small, trial_log):
    """PutInBox has nothing to count."""
    plan, folder = small
    with pytest.raises(InvalidValueError, match="cannot fail by 'wrong_count'"):
        trial_log.score(plan.trials[0], "wrong_count", operator="ann")

    assert not (folder / "records.jsonl").exists()
