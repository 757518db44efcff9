"""Honest runs hold; altered ones do not."""

import json
import re
import shutil
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from forgeries import FORGERIES, forge
from selection import slow_but
from typer.testing import CliRunner

from roboirg.apps.leaderboard import commands, record_check
from roboirg.apps.leaderboard.record_check import RecordCheck
from roboirg.apps.leaderboard.run_verification import Verification, verify_run
from roboirg.main import app
from roboirg.records.action_log import read_actions, write_actions
from roboirg.records.merging import merge_runs
from roboirg.records.run_files import PLAN_FILE
from roboirg.records.store import read_records
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.plan.stored_plans import read_plans
from roboirg.runs.play.rollout import EpisodeRunner
from roboirg.runs.run.executor import InProcess
from roboirg.runs.run.runner import run_plan

pytestmark = pytest.mark.sim


def play(folder, policies, **options):
    plan = make_plan(policies, **options)
    run_plan(plan, folder, EpisodeRunner(folder, plan=plan.fingerprint), InProcess())
    return folder


@pytest.fixture(scope="module")
def honest(tmp_path_factory):
    """Successes and failures in the shortest episodes that there are."""
    return play(
        tmp_path_factory.mktemp("honest"),
        ["listener", "forgetful"],
        tasks="StopCube",
        settings="contextual",
        episodes="2,",
        delivery="turns",
    )


def test_an_honest_run_holds(honest):
    """Two policies played two episodes here, so that each record is found again exactly."""
    found = verify_run(honest)

    assert found.holds, found
    assert found.verdicts == {"exact": found.records}
    assert not found.notes


def test_the_honest_run_has_a_success_and_a_failure(honest):
    """Or the tests below would not show both ways to change an outcome."""
    assert {record.outcome for record in read_records(honest)} == {"success", "failure"}


@pytest.fixture
def forged(honest, tmp_path):
    """A copy of the honest run, to be altered."""
    return Path(shutil.copytree(honest, tmp_path / "forged"))


QUICK = (
    "actions changed",
    "actions of another episode",
    "actions lost",
    "another file of actions",
    "why it failed",
    "explicit command",
    "version of the world",
    "version of the words",
)


@pytest.mark.parametrize("name", slow_but(QUICK, FORGERIES))
def test_what_was_altered_does_not_hold(name, forged):
    """forgeries.py has, by name, the change of a run and a part of the finding of `verify`."""
    forgery, words = FORGERIES[name]
    forge(forged, forgery, seed=name)

    (check, *_) = verify_run(forged).checks

    assert words in "\n".join(check.findings)


def test_of_a_flipped_event_both_sides_are_printed(forged):
    """The second event of the first record is said to be over (`holds` False) and was not."""

    def flip_the_second_event(lines, _folder, _rng):
        lines[0]["events"][1]["holds"] = False
        return lines

    forge(forged, flip_the_second_event)

    (check,) = verify_run(forged).checks
    (sentence,) = check.findings
    assert re.fullmatch(
        r"events, entry 2: .* EventRecord\(.*False\); .* EventRecord\(.*True\)\.", sentence
    )


@pytest.mark.parametrize(
    ("recorded", "expected", "sentence"),
    [
        ((1, 2, 3), (1, 5, 3), "goal, entry 2: the record says 2; it should be 5."),
        ((1,), (1, 5), "goal, entry 2: the record says None; it should be 5."),
        ({"a": 1, "b": (2, 4)}, {"a": 1, "b": (2, 3)}, "goal.b, entry 2: the record says 4; it s"),
    ],
    ids=["another value", "too few", "inside"],
)
def test_of_two_values_the_place_where_they_differ_is_named(recorded, expected, sentence):
    assert record_check._difference("goal", recorded, expected).startswith(sentence)


def with_all(**fields):
    """Return a change of the same fields of all records."""

    def change(lines, _folder, _rng):
        for line in lines:
            line.update(fields)
        return lines

    return change


@pytest.fixture
def run_in_other_words(forged):
    """The honest run, but that its plan and records are in words that this package lacks."""
    words = "StopCube/test@0a0a0a0a0a0a"
    plan = json.loads((forged / PLAN_FILE).read_bytes()) | {"words": [words]}
    (forged / PLAN_FILE).write_text(json.dumps(plan), "utf-8")
    (planned,) = read_plans(forged)

    def say_it_in_other_words(lines, _folder, _rng):
        for line in lines:
            line |= {"words": words, "plan": planned.fingerprint}
            line["metadata"]["words"] = words
        return lines

    forge(forged, say_it_in_other_words)
    return forged


def test_records_in_other_words_of_the_same_pool_hold_with_a_note(run_in_other_words):
    found = verify_run(run_in_other_words, sample=0.0)

    assert found.holds, (found.faults, found.checks)
    assert "in 2 of the records: this roboirg has other words" in "".join(found.notes)


def test_steps_of_utterances_are_checked_in_records_in_other_words(run_in_other_words):
    """`run_in_other_words` says that it is in words of a file that is not here, so its sentences
    cannot be made anew to compare them.

    But the first one is heard at step 0 in any words; the first record now says step 7.
    """

    def hear_it_at_step_7(lines, _folder, _rng):
        lines[0]["instruction"][0]["step"] = 7
        return lines

    forge(run_in_other_words, hear_it_at_step_7)

    assert "instruction, entry 1: the record says" in str(verify_run(run_in_other_words).checks)


def test_outcomes_are_checked_in_records_in_other_words(run_in_other_words):
    forge(run_in_other_words, FORGERIES["failure to success"][0])

    assert "outcome: the record says 'success'" in str(verify_run(run_in_other_words).checks)


def test_a_record_has_the_words_of_its_plan_and_of_its_metadata(forged):
    """`forged` is a copy of an honest run of two records. The first one now names other words (the
    pool of StopCube's test split, and a hash) than when it was played.

    That contradicts three things: the plan, which names the words of all its records; the second
    record, of the same pool; and the words that its own metadata name.
    """

    def reword_the_first(lines, _folder, _rng):
        lines[0]["words"] = "StopCube/test@0a0a0a0a0a0a"
        return lines

    forge(forged, reword_the_first)

    found = verify_run(forged, sample=0.0)
    against_plan, against_second = found.faults
    assert against_plan == "1 record in words that the plan does not name."
    assert against_second.startswith("The records have several words of StopCube/test: ")
    assert "words: the record says 'StopCube/test@0a0a0a0a0a0a'; it should" in str(found.checks)


@pytest.mark.parametrize("words", ["StopCube/train@0a0a0a0a0a0a", "anything", "none"])
def test_words_of_another_pool_or_of_no_name_do_not_excuse_from_checking(forged, words):
    """All records name words that are none of the test split's.

    Words of somebody else's file may be unknown here, but these names don't make them so.
    """
    forge(forged, with_all(words=words))
    found = verify_run(forged)

    assert not found.holds
    assert f"words: the record says '{words}', which are no words of" in str(found.checks)


def test_an_episode_of_the_plan_that_was_left_out_is_named(honest, forged):
    """The first of two records is removed; the plan has both, so the first one is missing."""
    _, second_line = (forged / "records.jsonl").read_bytes().splitlines(keepends=True)
    (forged / "records.jsonl").write_bytes(second_line)

    found = verify_run(forged, sample=0.0)

    assert found.missing == (read_records(honest)[0].slug,)
    assert not found.holds


def test_records_of_another_plan_than_the_stored_one_do_not_hold(forged):
    """The stored plan is changed (videos of all), so its fingerprint is no more that of the
    records.
    """
    plan = json.loads((forged / PLAN_FILE).read_bytes()) | {"video": "all"}
    (forged / PLAN_FILE).write_text(json.dumps(plan), "utf-8")

    assert verify_run(forged, sample=0.0).faults == ("2 records from no plan that is kept.",)


OTHER_PROCESSOR = {"processor": "x86_64 OtherMaker 1"}


def shift_end_states(run, by, *, is_hash_changed=True, **changes):
    """Move the end state of the first record by so much, of the second by half, and change more.

    A record has a hash of its end state, which is then another one, unless it is left as it was.
    """
    if is_hash_changed:
        changes["end_state"] = "0" * 64

    def shift(lines, folder, _rng):
        for place, line in enumerate(lines, start=1):
            log = read_actions(folder, line["action_log"])
            moved = replace(log, end_state=log.end_state + by / place)
            line |= {"action_log": write_actions(moved, folder), **changes}
        return lines

    forge(run, shift)


def test_on_another_processor_a_run_may_end_a_little_elsewhere(forged):
    """Records name another processor, and the first one's end state is 0.001 off.

    That is within the tolerance for other processors; the deviation is reported.
    """
    shift_end_states(forged, by=0.001, **OTHER_PROCESSOR)

    found = verify_run(forged)

    assert found.holds
    assert found.verdicts["tolerant"] == found.records
    assert found.deviation == pytest.approx(0.001)


def test_on_the_same_processor_no_run_may_end_elsewhere(forged):
    """End states are 0.001 off, and the records name this machine's processor."""
    shift_end_states(forged, by=0.001)
    assert not verify_run(forged).holds


@pytest.mark.parametrize(
    ("by", "changes", "excused"),
    [
        pytest.param(0.1, {"steps": 1, "events": []}, True, id="steps and events"),
        pytest.param(0.1, {"steps": 1}, True, id="steps"),
        pytest.param(0.001, {"is_hash_changed": False}, True, id="hash of other numbers"),
        pytest.param(0.1, {"seed": 1}, False, id="seed, which no processor changes"),
    ],
)
def test_larger_differences_of_another_processor_do_not_hold_and_a_note_may_excuse_them(
    forged, by, changes, excused
):
    """Records of another processor differ by more than the tolerance, or in more than the end.

    Motion decides how many steps an episode takes and what happens in it, so a note may excuse such
    records. The seed of the scene comes before any motion, and is never excused.
    """
    shift_end_states(forged, by=by, **OTHER_PROCESSOR, **changes)

    found = verify_run(forged)

    assert not found.holds
    assert any("another kind of processor" in note for note in found.notes) is excused


def test_a_merged_run_holds_by_the_plans_of_its_parts(honest, tmp_path):
    """`honest` is a run of two policies. A part has the plan of one of them, and all records, which
    name their plan by its fingerprint; merged, they have two plans and each record once."""
    parts = [tmp_path / "listener", tmp_path / "forgetful"]
    for part in parts:
        shutil.copytree(honest, part)
        plan = json.loads((part / PLAN_FILE).read_bytes()) | {"policies": [part.name]}
        (part / PLAN_FILE).write_text(json.dumps(plan), "utf-8")
        (stored_plan,) = read_plans(part)
        forge(part, with_all(plan=stored_plan.fingerprint))
    merge_runs(parts, tmp_path / "merged")

    found = verify_run(tmp_path / "merged")

    assert found.holds, found
    assert not found.notes


def test_of_a_sample_of_one_half_one_of_two_records_is_played_again(honest):
    """`honest` is a run of two records. Both are read, of which `progress` tells; whatever the seed
    draws, one is played again, and ends exactly as recorded."""
    progress = []

    found = verify_run(honest, sample=0.5, seed=3, progress=lambda *now: progress.append(now))

    assert progress == [(1, 2), (2, 2)]
    assert found.verdicts["exact"] == 1
    assert found.holds


def test_what_is_printed_of_a_verification(capsys):
    """34 of 60 records were played again; one has two findings, and one of the plan is missing."""
    found = Verification(
        records=60,
        checks=(RecordCheck("PickXtimes-7", ("one.", "two.")),),
        missing=("StopCube-3",),
        verdicts=Counter({"exact": 30, "tolerant": 4, "not replayed": 26}),
        deviation=0.0123,
        errors=2,
        notes=("A note.",),
    )

    expected = """\
60 records; 34 were played again from stored actions.
End states equal bit for bit: 30.
End states from other processors equal within 0.02 (m, rad, s): 4; the largest difference is 0.01.
2 records ended in an error: actions do not show whether a policy raised one, and the rates leave such episodes out.
A note.
does not hold: PickXtimes-7: one.
does not hold: PickXtimes-7: two.
has no record: StopCube-3
2 things do not hold.
"""  # noqa: E501

    commands._print(found)

    assert capsys.readouterr().out == expected


def test_more_than_20_findings_are_counted_instead_of_printed(capsys):
    """23 records have a finding, and 22 episodes of the plan have no record."""
    checks = tuple(RecordCheck(f"check-{number}", ("one.",)) for number in range(23))
    missing = tuple(f"missing-{number}" for number in range(22))

    commands._print(Verification(45, checks, missing))

    printed = capsys.readouterr().out
    assert printed.count("does not hold: ") == printed.count("has no record: ") == 20
    assert printed.endswith("… and 2 more.\n… and 3 more records.\n45 things do not hold.\n")


def test_a_verification_without_findings_says_that_it_holds(capsys):
    """One of two records was played again, so it is not said that *everything* holds."""
    verdicts = Counter({"exact": 1, "not replayed": 1})

    commands._print(Verification(records=2, checks=(), missing=(), verdicts=verdicts))

    assert capsys.readouterr().out.endswith(" bit for bit: 1.\nAll that was checked holds.\n")


def verified(run, share):
    """Return what came of ``roboirg leaderboard verify`` with a sample of this share."""
    return CliRunner().invoke(app, ["leaderboard", "verify", str(run), "--sample", share])


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize(("share", "played"), [("10%", "1 was"), ("1.0", "2 were")])
def test_the_command_says_how_many_records_were_played_again(honest, share, played):
    """The run has two records. 10 % of them is at least one; 1.0 is all."""
    done = verified(honest, share)

    assert done.exit_code == 0, done.output
    assert f"2 records; {played} played again" in done.output


@pytest.mark.usefixtures("in_this_process")
def test_the_command_says_what_does_not_hold(forged):
    """The forgery makes a failure a success. One thing doesn't hold, and the exit code is 2."""
    forge(forged, FORGERIES["failure to success"][0])

    done = verified(forged, "100%")

    assert done.exit_code == 2
    assert "outcome: the record says 'success'; it should be 'failure'" in done.output
    assert "1 thing does not hold." in done.output


@pytest.mark.parametrize("share", ["many", "5", "0%", "101%", "nan"])
def test_the_command_refuses_a_share_that_is_none(honest, share):
    """A share is from above 0 % to 100 %, or a number up to 1."""
    assert f"{share!r}; give one such as 5%" in str(verified(honest, share).exception)
