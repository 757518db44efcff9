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
    found = verify_run(honest)
    assert found.holds, found
    assert found.verdicts == {"exact": found.records}
    assert not found.notes

    outcomes = {record.outcome for record in read_records(honest)}
    assert outcomes == {"success", "failure"}


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
    forgery, words = FORGERIES[name]
    forge(forged, forgery, seed=name)

    (found, *_) = verify_run(forged).checks

    assert words in "\n".join(found.findings)


def test_of_a_flipped_event_both_sides_are_printed(forged):
    def flipped(lines, _folder, _rng):
        lines[0]["events"][1]["holds"] = False
        return lines

    forge(forged, flipped)
    (found,) = verify_run(forged).checks
    (sentence,) = found.findings

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


def test_records_in_other_words_of_the_same_pool_are_checked_but_for_their_words(
    forged,
):
    words = "StopCube/test@0a0a0a0a0a0a"
    plan = json.loads((forged / PLAN_FILE).read_bytes()) | {"words": [words]}
    (forged / PLAN_FILE).write_text(json.dumps(plan), "utf-8")
    (planned,) = read_plans(forged)

    def in_other_words(lines, folder, rng):
        for line in lines:
            line |= {"words": words, "plan": planned.fingerprint}
            line["metadata"]["words"] = words
        return lines

    forge(forged, in_other_words)
    found = verify_run(forged, sample=0.0)

    assert found.holds, (found.faults, found.checks)
    assert "in 2 of the records: this roboirg has other words" in "".join(found.notes)

    def heard_later(lines, folder, rng):
        lines[0]["instruction"][0]["step"] = 7
        return lines

    forge(forged, heard_later)
    assert "instruction, entry 1: the record says" in str(verify_run(forged).checks)

    forge(forged, FORGERIES["failure to success"][0])
    assert "outcome: the record says 'success'" in str(verify_run(forged).checks)


def test_a_record_has_the_words_of_its_plan_and_of_its_metadata(forged):
    def reworded(lines, folder, rng):
        lines[0]["words"] = "StopCube/test@0a0a0a0a0a0a"
        return lines

    forge(forged, reworded)

    found = verify_run(forged, sample=0.0)

    assert found.faults[0] == "1 record in words that the plan does not name."
    assert found.faults[1].startswith("The records have several words of StopCube/test: ")
    assert "words: the record says 'StopCube/test@0a0a0a0a0a0a'; it should" in str(found.checks)


@pytest.mark.parametrize("words", ["StopCube/train@0a0a0a0a0a0a", "anything", "none"])
def test_words_of_another_pool_or_of_no_name_do_not_excuse_from_checking(forged, words):
    forge(forged, with_all(words=words))
    found = verify_run(forged)

    assert not found.holds
    assert f"words: the record says '{words}', which are no words of" in str(found.checks)


def test_an_episode_of_the_plan_that_was_left_out_is_named(honest, forged):
    lines = (forged / "records.jsonl").read_bytes().splitlines(keepends=True)
    (forged / "records.jsonl").write_bytes(b"".join(lines[1:]))
    found = verify_run(forged, sample=0.0)
    assert found.missing == (read_records(honest)[0].slug,)
    assert not found.holds

    plan = json.loads((forged / PLAN_FILE).read_bytes()) | {"video": "all"}
    (forged / PLAN_FILE).write_text(json.dumps(plan), "utf-8")
    assert verify_run(forged, sample=0.0).faults == ("1 record from no plan that is kept.",)

    (forged / PLAN_FILE).unlink()
    found = verify_run(forged, sample=0.0)
    assert found.faults == ("1 record from no plan that is kept.",)
    assert not found.holds

    # Words that were said in another part of the discourse are other words, played or not.
    forge(forged, FORGERIES["other stage"][0])
    (check,) = verify_run(forged, sample=0.0).checks
    assert FORGERIES["other stage"][1] in check.findings[0]


OTHER_PROCESSOR = {"processor": "x86_64 OtherMaker 1"}


@pytest.mark.parametrize(
    ("by", "changes", "holds", "excused"),
    [
        (0.001, {}, False, False),
        (0.001, OTHER_PROCESSOR, True, False),
        (0.1, {**OTHER_PROCESSOR, "steps": 1, "events": []}, False, True),  # motion decides these
        (0.1, {**OTHER_PROCESSOR, "seed": 1}, False, False),  # no processor changes that
        (0.1, {**OTHER_PROCESSOR, "steps": 1}, False, True),
        (0.001, {**OTHER_PROCESSOR, "end_state": None}, False, True),  # a hash of other numbers
    ],
)
def test_only_other_processors_may_end_a_little_elsewhere(forged, by, changes, holds, excused):
    def shift(lines, folder, rng):
        for place, line in enumerate(lines, start=1):  # the first is farthest
            log = read_actions(folder, line["action_log"])
            moved = replace(log, end_state=log.end_state + by / place)
            line["action_log"] = write_actions(moved, folder)
            new = {"end_state": "0" * 64, **changes}
            if new["end_state"] is None:
                del new["end_state"]
            line.update(new)
        return lines

    forge(forged, shift)

    found = verify_run(forged)

    assert found.holds is holds
    slugs = [check.slug for check in found.checks]
    assert slugs == sorted(slugs)
    assert found.verdicts["tolerant"] == (found.records if holds else 0)
    assert found.deviation == pytest.approx(by if holds else 0)
    assert any("another kind of processor" in note for note in found.notes) is excused


def test_a_merged_run_holds_by_the_plans_of_its_parts(honest, tmp_path):
    """By all plans: each of these has the episodes of one policy only."""
    parts = [tmp_path / policy for policy in ("listener", "forgetful")]
    for part in parts:
        shutil.copytree(honest, part)
        plan = json.loads((part / PLAN_FILE).read_bytes()) | {"policies": [part.name]}
        (part / PLAN_FILE).write_text(json.dumps(plan), "utf-8")
        (read,) = read_plans(part)
        forge(part, with_all(plan=read.fingerprint))
    merge_runs(parts, tmp_path / "merged")

    found = verify_run(tmp_path / "merged")

    assert found.holds, found
    assert not found.notes


def test_a_sample_is_drawn_again_from_its_seed(honest):
    told = []
    found = verify_run(honest, sample=0.5, seed=3, progress=lambda *now: told.append(now))

    assert told == [(1, 2), (2, 2)]
    assert found.verdicts["exact"] == found.records // 2
    assert found.holds


def test_what_is_printed_of_a_verification(capsys, snapshot):
    """At most twenty of each kind, and how many there are besides."""
    checks = tuple(RecordCheck(f"check-{n}", ("one.", "two.")) for n in range(23))
    verdicts = Counter({"exact": 30, "tolerant": 4})
    verdicts["not replayed"] = 26
    missing = tuple(f"missing-{n}" for n in range(22))
    commands._print(Verification(60, checks, missing, verdicts, 0.0123, 2, ("A note.",)))

    commands._print(Verification(2, (), (), Counter({"exact": 1, "not replayed": 1})))

    assert capsys.readouterr().out == snapshot


@pytest.mark.usefixtures("in_this_process")
def test_the_command_tells_what_does_not_hold(honest, forged):
    def verify(run, share):
        words = ["leaderboard", "verify", str(run), "--sample", share]
        return CliRunner().invoke(app, words)

    for share, played in (("10%", "1 was"), ("1.0", "2 were")):
        good = verify(honest, share)
        assert good.exit_code == 0, good.output
        assert f"2 records; {played} played again" in good.output

    forge(forged, FORGERIES["failure to success"][0])
    bad = verify(forged, "100%")
    assert bad.exit_code == 2
    assert "outcome: the record says 'success'; it should be 'failure'" in bad.output
    assert "1 thing does not hold." in bad.output
    for share in ("many", "5", "0%", "101%", "nan"):
        assert f"{share!r}; give one such as 5%" in str(verify(honest, share).exception)
