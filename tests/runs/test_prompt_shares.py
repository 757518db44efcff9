"""Cut prompts in plans, dry runs, records and reports."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest
from flat_jobs import job_of
from made_records import make_record
from plan_files import plan_file
from typer.testing import CliRunner

from roboirg import main
from roboirg.core.errors import InvalidValueError
from roboirg.policies.by_name.finding import read_policy
from roboirg.policies.planners.systems import all_systems
from roboirg.policies.prompt_length.prompt_audit import PromptLimit, most_tokens
from roboirg.records.record import IDENTITY, Job
from roboirg.records.record_codec import encode, read_record
from roboirg.runs.job_instruction import PreparedJob, instruct_job
from roboirg.runs.plan.plan_file import read_plan_file
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.play.episode_record import audit_record, utterances_at
from roboirg.runs.play.prompt_shares import (
    audit_job,
    check_prompt,
    prompt_shares,
    sent_messages,
    share_text,
    warning_lines,
)
from roboirg.runs.play.rollout import EpisodeRunner

SYSTEMS = [f"system:{name}" for name in all_systems()]
EXACT = PromptLimit(64, 0, most_tokens, "some.model")
LONG = {"setting": "contextual", "distractors": 16}


def job(**fields: object) -> Job:
    usual = {"policy": "random", "task": "PickXtimes", "split": "test", "episode": 0}
    return job_of(**{**usual, "setting": "direct", **fields})


def test_no_system_of_the_paper_cuts_an_instruction_of_the_papers_plan():
    options = {**read_plan_file("paper"), "policy_seeds": "0", "episodes": "0,29"}
    options.pop("policies", None)
    plan = make_plan(SYSTEMS, **options)

    shares = prompt_shares(plan.jobs())

    assert [share.policy for share in shares] == SYSTEMS
    for share in shares:
        assert share.limit.tokens >= 64
        assert set(share.settings) == {"explicit", "direct", "reasoning", "contextual", "spatial"}
        assert {share_text(verdicts) for verdicts in share.settings.values()} == {"0 %"}
    assert not list(warning_lines(shares))


def test_options_that_add_words_are_cut():
    plan = make_plan(
        ["a=system:pi0.5", "b=openpi://localhost:1?prompt_tokens=1000", "random"],
        settings="explicit,contextual",
        tasks="PickXtimes",
        distractors=16,
    )
    cut, whole, silent = prompt_shares(plan.jobs())
    assert share_text(cut.settings["contextual"]) == "100 %"
    assert share_text(cut.settings["explicit"]) == "0 %"
    assert share_text(whole.settings["contextual"]) == "0 %"
    assert silent.limit is None

    line, other = warning_lines(
        [
            cut,
            whole,
            silent,
            whole._replace(settings={"direct": Counter(unknown=1, heard=1)}),
        ]
    )
    assert line.startswith("a reads 64 tokens of a prompt")
    assert line.endswith("contextual 100 %.")
    assert other.endswith("instructions does not reach it: direct 0–50 %.")


def test_every_job_is_counted_by_its_own_words_and_limit():
    """Of another episode, task, split, form, delivery, arm or limit the words are others."""
    options = {"settings": "explicit,contextual", "forms": "implicit,resolved", "episodes": "0-2"}
    options |= {"tasks": "StopCube,BinFill", "in_turns": "contextual", "arms": "told,silent"}
    specs = [f"p{tokens}=openpi://localhost:1?prompt_tokens={tokens}" for tokens in (40, 60, 80)]
    jobs = [
        played
        for split in ("test", "val")
        for played in make_plan(specs, split=split, **options).jobs()
    ]
    shares = prompt_shares(jobs)
    limits = {share.policy: share.limit for share in shares}

    each = Counter(
        (played.policy, played.setting, audit_job(played, limits[played.policy])[1])
        for played in jobs
    )

    assert each == {
        (share.policy, setting, verdict): count
        for share in shares
        for setting, verdicts in share.settings.items()
        for verdict, count in verdicts.items()
    }


@pytest.mark.parametrize(
    ("counts", "text"),
    [
        ({"heard": 4}, "0 %"),
        ({"cut": 1, "heard": 3}, "25 %"),
        ({"cut": 1, "unknown": 1, "heard": 2}, "25–50 %"),
        ({"unknown": 1, "heard": 999}, "0–<1 %"),
    ],
)
def test_shares_are_between_bounds(counts, text):
    assert share_text(Counter(counts)) == text  # type: ignore[arg-type]


def test_messages_are_what_is_heard_at_once():
    assert sent_messages("abc", (0, 0, 0)) == (("a", "b", "c"),)
    assert sent_messages("abcd", (0, 16, 16, None)) == (("a",), ("b", "c"))


def test_in_turns_each_message_has_the_whole_budget():
    at_once = job(**LONG)
    in_turns = job(**LONG, delivery="turns")
    assert audit_job(at_once, EXACT)[1] == "cut"

    audit, verdict = audit_job(in_turns, EXACT)
    assert verdict == "heard"
    assert audit.needed[1] < 64
    assert [len(turn) for turn in instruct_job(in_turns).turns] == list(audit.reached)


def test_a_record_says_what_was_cut():
    record = make_record(job(**LONG), "failure", "because")
    audit_record(record, PreparedJob(job(**LONG)), EXACT)

    audit = record.prompt

    assert record.prompt_verdict == "cut"
    assert audit.needed[0] == audit.needed[1] > 64
    assert audit.tokenizer == "some.model"
    # The command stands at the end.
    assert audit.reached[-1] == 0 < audit.reached[0] == len(record.instruction[0].text)
    assert record.mentions[-1].utterance == len(record.instruction) - 1
    assert len(record.mentions) - 1 in audit.lost
    assert read_record(encode(record), Path(), 1) == record
    assert not {"prompt", "prompt_verdict"} & set(IDENTITY)


def test_records_without_a_limit_are_unknown():
    record = make_record(job(), "success")
    assert (record.prompt, record.prompt_verdict) == (None, "unknown")


def test_what_was_not_said_yet_is_neither_heard_nor_lost():
    played = job(setting="contextual", delivery="turns")
    prepared = PreparedJob(played)
    limit = EXACT._replace(tokens=3)
    record = make_record(played, "failure", "because", instruction=utterances_at(prepared, [0]))
    audit_record(record, prepared, limit)

    assert len(record.prompt.reached) == 1 < len(record.instruction)
    assert all(record.mentions[index].utterance == 0 for index in record.prompt.lost)

    record.instruction = utterances_at(prepared, [])
    audit_record(record, prepared, limit)
    assert len(record.prompt.reached) == len(record.instruction)


def test_a_long_prompt_is_refused_before_it_is_played(tmp_path):
    spec = "openpi://localhost:1?prompt_tokens=64&connect=1"  # nobody listens there
    for delivery in ("prompt", "turns"):
        record = EpisodeRunner(tmp_path, refuse_long=True)(
            job(**LONG, ref=read_policy(spec), delivery=delivery)
        )
        if delivery == "prompt":
            assert (record.outcome, record.error, record.steps) == ("error", "prompt", 0)
            said = r"prompt: the instruction needs \d+ to \d+ tokens, .* model reads 64; "
            assert re.match(said, record.cause)
            assert record.attribution is None
            assert record.prompt_verdict == "cut"
            assert "env_reset" not in record.timings
        else:
            assert record.error != "prompt"


def test_only_what_is_certainly_cut_is_refused():
    for verdict in ("heard", "unknown"):
        check_prompt(audit_job(job(), EXACT)[0], verdict)
    with pytest.raises(InvalidValueError, match="must be 'send' or 'refuse'"):
        make_plan(["random"], long_prompts="cut")


def test_the_dry_run_prints_the_shares(tmp_path):
    words = ["run", "--dry-run", "--out", str(tmp_path), "--tasks", "PickXtimes"]
    words += ["--policy", "system:pi0.5", "--policy", "far=openpi://localhost:1"]
    said = CliRunner().invoke(main.app, [*words, "--plan", plan_file(distractors=16)])
    assert said.exit_code == 0, said.output

    row = next(line for line in said.output.splitlines() if "64 tokens" in line)
    assert "system:pi0.5" in row
    assert "100 %" in row
    assert "No limit declared (prompt_tokens=N), so cuts are unknown: far." in said.output
