"""Honest runs hold; altered ones do not."""

from __future__ import annotations

import json
import random
import shutil
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from forgeries import FORGERIES, UNWATCHED, Forgery, Lines, forge
from selection import slow_but
from typer.testing import CliRunner

from roboirg.apps.leaderboard import commands
from roboirg.apps.leaderboard.record_check import RecordCheck
from roboirg.apps.leaderboard.run_verification import Verification, verify_run
from roboirg.evaluation.plan.plan_maker import make_plan
from roboirg.evaluation.play.rollout import EpisodeRunner
from roboirg.evaluation.records.action_log import read_actions, write_actions
from roboirg.evaluation.records.merging import merge_runs
from roboirg.evaluation.records.run_files import PLAN_FILE
from roboirg.evaluation.records.store import read_records
from roboirg.evaluation.run.executor import InProcess
from roboirg.evaluation.run.runner import run_plan
from roboirg.language import LANGUAGE_VERSIONS
from roboirg.main import app

pytestmark = pytest.mark.sim


def play(folder: Path, policies: list[str], **options: object) -> Path:
    plan = make_plan(policies, **options)  # type: ignore[arg-type]
    run_plan(plan, folder, EpisodeRunner(folder, plan=plan.fingerprint), InProcess())
    return folder


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Successes and failures in the shortest episodes that there are."""
    return play(
        tmp_path_factory.mktemp("honest"),
        ["listener", "forgetful"],
        tasks="StopCube",
        settings="contextual",
        episodes="1,",
        delivery="turns",
    )


def test_an_honest_run_holds(honest: Path) -> None:
    found = verify_run(honest)
    assert found.holds, found
    assert found.verdicts == {"exact": found.records}
    assert not found.notes
    outcomes = {one.outcome for one in read_records(honest)}
    assert outcomes == {"success", "failure"}


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
def test_what_was_altered_does_not_hold(name: str, honest: Path, tmp_path: Path) -> None:
    forged = tmp_path / "forged"
    shutil.copytree(honest, forged)
    forgery, words = FORGERIES[name]
    forge(forged, forgery, random.Random(name))
    (found, *_) = verify_run(forged).checks
    assert words in "\n".join(found.findings)


def in_words(words: str) -> Forgery:
    """Return a change that makes records of language 4 of them, with a name of words."""

    def change(lines: Lines, _folder: Path, _rng: random.Random) -> Lines:
        for line in lines:
            line["options"]["language"] = 4
            line.update(language_version=LANGUAGE_VERSIONS[4], words=words)
        return lines

    return change


def test_words_that_are_not_installed_are_not_checked_and_the_verdict_is(
    honest: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "other"
    shutil.copytree(honest, folder)
    (folder / PLAN_FILE).unlink()
    forge(folder, in_words("StopCube/test@0a0a0a0a0a0a"), random.Random(0))
    found = verify_run(folder)
    assert (found.holds, found.verdicts) == (True, {"exact": found.records})
    note = f"were not checked in {found.records} of the records: this roboirg has other words."
    assert found.notes[-1] == f"Words, and why episodes failed, {note}"
    printed = CliRunner().invoke(app, ["leaderboard", "verify", str(folder)]).output
    assert printed.endswith("All that was checked holds.\n")
    forge(folder, FORGERIES["failure to success"][0], random.Random(0))
    assert not verify_run(folder).holds


@pytest.mark.parametrize("words", ["StopCube/train@0a0a0a0a0a0a", "anything", "none"])
def test_words_of_another_pool_or_of_no_name_do_not_excuse_from_checking(
    honest: Path, tmp_path: Path, words: str
) -> None:
    shutil.copytree(honest, tmp_path / "forged")
    (tmp_path / "forged" / PLAN_FILE).unlink()
    forge(tmp_path / "forged", in_words(words), random.Random(0))
    found = verify_run(tmp_path / "forged")
    assert not found.holds
    assert f"words: the record says '{words}', which are no words of" in str(found.checks)


@pytest.mark.parametrize("words", ["StopCube/test@0a0a0a0a0a0a", "@0a0a0a0a0a0a"])
def test_a_record_of_language_3_with_words_of_another_does_not_hold(
    honest: Path, tmp_path: Path, words: str
) -> None:
    def with_words(lines: Lines, _folder: Path, _rng: random.Random) -> Lines:
        return [{**line, "words": words} for line in lines]

    shutil.copytree(honest, tmp_path / "forged")
    forge(tmp_path / "forged", with_words, random.Random(0))
    (check, _) = verify_run(tmp_path / "forged", sample=0.0).checks
    assert check.findings[0].startswith(f"words: the record says {words!r}")


def test_a_record_from_before_attempts_were_watched_for_holds(honest: Path, tmp_path: Path) -> None:
    shutil.copytree(honest, tmp_path / "older")
    forge(tmp_path / "older", UNWATCHED, random.Random(0))
    assert verify_run(tmp_path / "older").holds


def test_an_episode_of_the_plan_that_was_left_out_is_named(honest: Path, tmp_path: Path) -> None:
    shorter = tmp_path / "shorter"
    shutil.copytree(honest, shorter)
    lines = (shorter / "records.jsonl").read_bytes().splitlines(keepends=True)
    (shorter / "records.jsonl").write_bytes(b"".join(lines[1:]))
    found = verify_run(shorter, sample=0.0)
    assert found.missing == (read_records(honest)[0].slug,)
    assert not found.holds
    (shorter / "plan.json").unlink()
    found = verify_run(shorter, sample=0.0)
    assert found.holds
    assert found.notes == ("From no plan that is kept: 1 record.",)
    # Words that were said in another part of the discourse are other words, played or not.
    forge(shorter, FORGERIES["other stage"][0], random.Random(0))
    (check,) = verify_run(shorter, sample=0.0).checks
    assert FORGERIES["other stage"][1] in check.findings[0]


def test_only_other_processors_may_end_a_little_elsewhere(honest: Path, tmp_path: Path) -> None:
    def shift(by: float, end_state: str = "0" * 64, **changes: object) -> Forgery:
        def forgery(lines: Lines, folder: Path, rng: random.Random) -> Lines:
            for place, one in enumerate(lines, start=1):  # the first is farthest
                log = read_actions(folder, one["action_log"])
                moved = replace(log, end_state=log.end_state + by / place)
                one.update(action_log=write_actions(moved, folder), **changes)
                one.update(end_state=end_state or one["end_state"])
            return lines

        return forgery

    other = {"processor": "x86_64 OtherMaker 1"}
    for by, changes, holds, excused in (
        (0.001, {}, False, False),
        (0.001, other, True, False),
        (0.1, {**other, "steps": 1, "events": []}, False, True),  # motion decides these
        (0.1, {**other, "seed": 1}, False, False),  # no processor changes that
        (0.1, {**other, "steps": 1}, False, True),
        (0.001, {**other, "end_state": ""}, False, True),  # the hash is of other numbers
    ):
        folder = tmp_path / "-".join([str(by), *changes])
        shutil.copytree(honest, folder)
        forge(folder, shift(by, **changes), random.Random(0))
        found = verify_run(folder)
        assert found.holds is holds
        assert [one.slug for one in found.checks] == sorted(one.slug for one in found.checks)
        assert found.verdicts["tolerant"] == holds * found.records
        assert found.deviation == pytest.approx(by * holds)
        assert any("another kind of processor" in note for note in found.notes) is excused


def test_a_merged_run_holds_by_the_plans_of_its_parts(honest: Path, tmp_path: Path) -> None:
    """By all plans: each of these has the episodes of one policy only."""
    parts = [tmp_path / policy for policy in ("listener", "forgetful")]
    for part in parts:
        shutil.copytree(honest, part)
        plan = json.loads((part / PLAN_FILE).read_bytes()) | {"policies": [part.name]}
        (part / PLAN_FILE).write_text(json.dumps(plan), "utf-8")
    merge_runs(parts, tmp_path / "merged")
    found = verify_run(tmp_path / "merged")
    assert found.holds, found
    assert not found.notes


def test_a_sample_is_drawn_again_from_its_seed(honest: Path) -> None:
    told: list[tuple[int, int]] = []
    found = verify_run(honest, sample=0.5, seed=3, progress=lambda *now: told.append(now))
    assert told == [(1, 2), (2, 2)]
    assert found.verdicts["exact"] == found.records // 2
    assert found.holds


def test_what_is_printed_of_a_verification(
    capsys: pytest.CaptureFixture[str], snapshot: object
) -> None:
    """At most twenty of each kind, and how many there are besides."""
    checks = tuple(RecordCheck(f"check-{n}", ("one.", "two.")) for n in range(23))
    verdicts = Counter({"exact": 30, "tolerant": 4})
    verdicts["not replayed"] = 26
    missing = tuple(f"missing-{n}" for n in range(22))
    commands._print(Verification(60, checks, missing, verdicts, 0.0123, 2, ("A note.",)))
    commands._print(Verification(2, (), (), Counter({"exact": 1, "not replayed": 1})))
    assert capsys.readouterr().out == snapshot


@pytest.fixture
def cli() -> CliRunner:
    return CliRunner()


@pytest.mark.usefixtures("in_this_process")
def test_the_command_tells_what_does_not_hold(honest: Path, tmp_path: Path, cli: CliRunner) -> None:
    for share, played in (("10%", "1 was"), ("1.0", "2 were")):
        good = cli.invoke(app, ["leaderboard", "verify", str(honest), "--sample", share])
        assert good.exit_code == 0, good.output
        assert f"2 records; {played} played again" in good.output
    forged = tmp_path / "forged"
    shutil.copytree(honest, forged)
    forge(forged, FORGERIES["failure to success"][0], random.Random(0))
    bad = cli.invoke(app, ["leaderboard", "verify", str(forged)])
    assert bad.exit_code == 2
    assert "outcome: the record says 'success'; it should be 'failure'" in bad.output
    assert "1 thing does not hold." in bad.output
    for share in ("many", "5", "0%", "101%", "nan"):
        wrong = cli.invoke(app, ["leaderboard", "verify", str(honest), "--sample", share])
        assert wrong.exit_code != 0
        assert f"{share!r}; give one such as 5%" in str(wrong.exception)
