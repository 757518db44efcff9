"""Verdicts are stored at once, can be corrected, and are never lost."""

import pytest
from made_records import make_record

from roboirg.apps.real.pages.score_server import _select_trial
from roboirg.apps.real.study.failure_choices import failure_choices
from roboirg.apps.real.study.trial_log import VOID, TrialLog, trial_metadata
from roboirg.core.errors import InvalidValueError
from roboirg.records.store import RecordStore, read_records


def read(plan, folder):
    return TrialLog.read(plan, folder)


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

    record = found[first.identity]
    assert (record.outcome, record.attribution, record.events) == ("success", None, ())
    assert record.robot == "a robot"
    assert trial_metadata(record) == {
        "operator": "ann", "note": "shaky", "trial": first.name,
        "plan": plan.fingerprint,
    }  # fmt: skip

    wrong = found[second.identity]
    dropped = found[third.identity]
    assert (wrong.outcome, wrong.cause) == ("failure", wrong.attribution.sentence)
    assert (wrong.attribution.kind, wrong.attribution.failure) == ("grounding", "wrong_place")
    assert (dropped.attribution.kind, dropped.attribution.step) == ("execution", None)
    assert "slipped" in dropped.cause
    assert dropped.plan == plan.fingerprint


def test_the_newest_score_counts_and_all_stay_in_the_file(small):
    plan, folder = small
    trial = plan.trials[0]
    film = "a.mp4"  # the operator names the video once
    for number, choice in enumerate(("success", "misplaced", "void", "success"), 1):
        note = f"note {number}"
        read(plan, folder).score(trial, choice, operator="ann", note=note, video=film)
        film = ""
        now = read(plan, folder)
        assert now.state(trial.name) == ("void" if choice == "void" else "scored")
        assert now.revision(trial.name) == number

    (newest,) = read_records(folder)

    assert (newest.outcome, newest.cause, newest.attribution) == ("success", None, None)
    assert (newest.error, newest.video) == (None, "a.mp4")
    assert trial_metadata(newest)["note"] == "note 4"
    assert len((folder / "records.jsonl").read_text().splitlines()) == 4


def test_trials_come_in_order_and_void_is_a_verdict(small):
    plan, folder = small
    trial_log = read(plan, folder)
    for trial in plan.trials:
        assert trial_log.next_to_score() == trial
        trial_log.score(trial, "void", operator="ann", note="the lamp fell")

    last = read(plan, folder)

    assert last.next_to_score() is None
    assert _select_trial(last, "") == plan.trials[-1]
    assert last.state(plan.trials[0].name) == "void"
    assert last.newest(plan.trials[0].name).cause == f"{VOID}; the lamp fell"


def test_what_simulation_played_is_no_score(small):
    plan, folder = small
    record = make_record(plan.trials[0].job, "success")

    with RecordStore(folder) as store:
        store.append(record)

    assert read(plan, folder).state(plan.trials[0].name) == "open"


def test_what_cannot_happen_is_refused_and_nothing_is_stored(small):
    plan, folder = small
    with pytest.raises(InvalidValueError, match="cannot fail by 'wrong_count'"):
        read(plan, folder).score(plan.trials[0], "wrong_count", operator="ann")
    assert not (folder / "records.jsonl").exists()
