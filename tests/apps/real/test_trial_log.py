"""Verdicts are stored at once, can be undone, and are never lost."""

from pathlib import Path

import pytest
from page_text import render

from roboirg.apps.real.study.failure_choices import failure_choices
from roboirg.apps.real.study.trial_log import UNSCORED, VOID, WITHDRAWN, TrialLog, trial_metadata
from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.analysis.stats.cells import gather
from roboirg.evaluation.analysis.tables.paper_tables import make_table
from roboirg.evaluation.play.rollout_result import RolloutResult, make_record
from roboirg.evaluation.records.record_codec import encode, read_record
from roboirg.evaluation.records.store import RecordStore, read_records, read_results


def read(plan, folder):
    return TrialLog.read(plan, folder)


def played(trial):
    course = RolloutResult(outcome="error", error="infrastructure", cause=UNSCORED, steps=321)
    return make_record(trial.job, course, started_at="2026-01-01T00:00:00+00:00", duration_s=16.0)


def test_a_score_is_a_record_like_any_other(small):
    plan, folder = small
    first, second, third, _ = plan.trials
    trial_log = read(plan, folder)
    choices = failure_choices(second.episode)
    trial_log.score(first, "success", operator="ann", note="shaky")
    trial_log.score(second, choices[0].key, operator="ann")
    trial_log.score(third, "dropped", operator="ann", note="slipped")
    found = {record.identity: record for record in read_records(folder)}
    assert len(found) == 3
    record = found[first.job]
    assert (record.outcome, record.attribution, record.events) == ("success", None, ())
    assert trial_metadata(record) == {
        "action": "score", "operator": "ann", "note": "shaky", "trial": first.name,
        "plan": plan.fingerprint,
    }  # fmt: skip
    record = found[second.job]
    assert (record.outcome, record.attribution.failure) == ("failure", "wrong_place")
    assert record.attribution.kind == "grounding"
    assert record.cause == record.attribution.sentence
    record = found[third.job]
    assert (record.attribution.kind, record.attribution.failure) == ("execution", "dropped")
    assert "slipped" in record.cause
    assert record.plan == plan.fingerprint
    # All that reads records reads these.
    assert read_record(encode(record), Path(), 1) == record
    table = make_table("real", gather([("run", read_results(folder))]))
    assert table.rows
    assert "slipped" in render(read_records(folder))


def test_what_was_played_keeps_its_times_when_it_is_scored(small):
    plan, folder = small
    trial = plan.trials[0]
    trial_log = read(plan, folder)
    trial_log.add(trial, played(trial), {"robot": "arm"})
    assert read(plan, folder).state(trial.name) == "waiting"
    read(plan, folder).score(trial, "success", operator="ann")
    record = read(plan, folder).newest(trial.name)
    assert (record.steps, record.duration_s, record.outcome) == (321, 16.0, "success")
    assert trial_metadata(record)["robot"] == "arm"


def test_undo_brings_back_what_was_before(small):
    plan, folder = small
    first, second, *_ = plan.trials
    trial_log = read(plan, folder)
    trial_log.add(first, played(first), {"robot": "arm"})
    trial_log.score(second, "dropped", operator="ann")
    trial_log.score(first, "success", operator="ann")
    trial_log.score(first, "misplaced", operator="ann")
    steps = [
        (first.name, "scored", "success"),
        (first.name, "waiting", "error"),
        (second.name, "open", "error"),
    ]
    for name, state, outcome in steps:
        assert read(plan, folder).undo(operator="bob") == name
        now = read(plan, folder)
        assert now.state(name) == state
        newest = {one.identity: one for one in read_records(folder)}[plan.trial(name).job]
        assert newest.outcome == outcome
    # An undone score of a trial that was never played counts in no rate.
    assert newest.cause == WITHDRAWN
    with pytest.raises(InvalidValueError, match="no score to undo"):
        read(plan, folder).undo(operator="bob")
    # Everything that ever was is still in the file.
    assert len((folder / "records.jsonl").read_text().splitlines()) == 7


def test_a_score_that_was_played_over_is_not_taken_back(small):
    plan, folder = small
    trial = plan.trials[0]
    trial_log = read(plan, folder)
    trial_log.score(trial, "void", operator="ann", note="the lamp fell")
    assert read(plan, folder).state(trial.name) == "void"
    assert trial_log.newest(trial.name).cause == f"{VOID}; the lamp fell"
    trial_log.add(trial, played(trial), {})
    with pytest.raises(InvalidValueError, match="played again since"):
        read(plan, folder).undo(operator="ann")


def test_trials_come_in_order_those_that_were_played_first(small):
    plan, folder = small
    trial_log = read(plan, folder)
    assert trial_log.next_to_score() == plan.trials[0]
    trial_log.add(plan.trials[2], played(plan.trials[2]), {})
    assert trial_log.next_to_score() == plan.trials[2]
    trial_log.score(plan.trials[2], "success", operator="ann")
    assert trial_log.next_to_score() == plan.trials[0]
    for trial in plan.trials:
        trial_log.score(trial, "success", operator="ann")
    assert read(plan, folder).next_to_score() is None


def test_what_cannot_happen_is_refused_and_nothing_is_stored(small):
    plan, folder = small
    with pytest.raises(InvalidValueError, match="cannot fail by 'wrong_count'"):
        read(plan, folder).score(plan.trials[0], "wrong_count", operator="ann")
    assert not (folder / "records.jsonl").exists()


def test_the_page_and_the_loop_take_turns(small):
    plan, folder = small
    import threading

    store = RecordStore(folder)
    threading.Timer(0.3, store.close).start()
    read(plan, folder).score(plan.trials[0], "success", operator="ann")
    assert read(plan, folder).state(plan.trials[0].name) == "scored"
