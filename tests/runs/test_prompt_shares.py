"""Cut prompts in plans, dry runs, records and reports."""

from __future__ import annotations

import os
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
from roboirg.records.record import IDENTITY
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

ALL_SYSTEMS_OF_THE_PAPER = [f"system:{name}" for name in all_systems()]
LIMIT_OF_64_TOKENS = PromptLimit(64, 0, most_tokens, "some.model")
LONG_INSTRUCTION = {"setting": "contextual", "distractors": 16}


def job_with(**fields):
    usual = {"policy": "random", "task": "PickXtimes", "split": "test", "episode": 0}
    return job_of(**{**usual, "setting": "direct", **fields})


def test_every_model_of_the_paper_reads_all_instructions_of_the_papers_plan_to_the_end():
    """A model reads so many tokens of a prompt; the rest is cut."""
    options = {**read_plan_file("paper"), "policy_seeds": "0", "episodes": "0,29"}
    options.pop("policies", None)
    plan = make_plan(ALL_SYSTEMS_OF_THE_PAPER, **options)

    shares = prompt_shares(plan.jobs())

    assert [share.policy for share in shares] == ALL_SYSTEMS_OF_THE_PAPER
    for share in shares:
        assert share.limit.tokens >= 64
        assert set(share.settings) == {"explicit", "direct", "reasoning", "contextual", "spatial"}
        assert {share_text(verdicts) for verdicts in share.settings.values()} == {"0 %"}
    assert not list(warning_lines(shares))


def test_a_dry_run_warns_which_share_of_longer_instructions_a_model_does_not_read():
    """16 distractors make contextual ones too long for a's 64 tokens, but not for b's 1,000.

    The random policy declares no limit. *Unknown* ones may be cut: 0 or 1 of 2.
    """
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


def test_each_episode_is_counted_by_its_own_words_and_its_policys_limit():
    """The counts are made fast, for groups; here they are compared with one by one.

    Would find a group whose members differ in task, split, form, delivery, arm or limit.
    """
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
def test_a_share_of_cut_prompts_is_a_range_if_some_are_unknown(counts, text):
    assert share_text(Counter(counts)) == text  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("utterances", "steps", "messages"),
    [
        ("abc", (0, 0, 0), (("a", "b", "c"),)),
        ("abcd", (0, 16, 16, None), (("a",), ("b", "c"))),
    ],
)
def test_utterances_of_the_same_step_are_sent_as_one_message(utterances, steps, messages):
    """By step; None is never: in the second case "d" was due after the end of the episode."""
    assert sent_messages(utterances, steps) == messages


def test_an_instruction_too_long_as_one_prompt_fits_if_it_comes_in_turns():
    """Each message may have 64 tokens."""
    at_once = job_with(**LONG_INSTRUCTION)
    in_turns = job_with(**LONG_INSTRUCTION, delivery="turns")
    assert audit_job(at_once, LIMIT_OF_64_TOKENS)[1] == "cut"

    audit, verdict = audit_job(in_turns, LIMIT_OF_64_TOKENS)
    assert verdict == "heard"
    assert audit.needed[1] < 64
    assert [len(turn) for turn in instruct_job(in_turns).turns] == list(audit.reached)


def test_a_record_notes_how_far_the_prompt_was_read_and_which_mentions_were_lost():
    """The command stands at the end of the instruction, so it is what is lost."""
    record = make_record(job_with(**LONG_INSTRUCTION), "failure", "because")
    audit_record(record, PreparedJob(job_with(**LONG_INSTRUCTION)), LIMIT_OF_64_TOKENS)

    audit = record.prompt

    assert record.prompt_verdict == "cut"
    assert audit.needed[0] == audit.needed[1] > 64
    assert audit.tokenizer == "some.model"
    # Characters read of each utterance: all of the first, none of the last.
    assert audit.reached[-1] == 0 < audit.reached[0] == len(record.instruction[0].text)
    assert record.mentions[-1].utterance == len(record.instruction) - 1
    assert len(record.mentions) - 1 in audit.lost
    assert read_record(encode(record), Path(), 1) == record
    assert not {"prompt", "prompt_verdict"} & set(IDENTITY)


def test_a_record_of_a_policy_without_a_declared_limit_is_unknown_not_heard():
    record = make_record(job_with(), "success")
    assert (record.prompt, record.prompt_verdict) == (None, "unknown")


def test_utterances_that_were_never_sent_count_neither_as_read_nor_as_lost():
    """The episode ended after the first of several turns. The limit is 3 tokens."""
    played = job_with(setting="contextual", delivery="turns")
    prepared = PreparedJob(played)
    limit = LIMIT_OF_64_TOKENS._replace(tokens=3)
    record = make_record(played, "failure", "because", instruction=utterances_at(prepared, [0]))
    audit_record(record, prepared, limit)

    assert len(record.prompt.reached) == 1 < len(record.instruction)
    assert all(record.mentions[index].utterance == 0 for index in record.prompt.lost)

    record.instruction = utterances_at(prepared, [])
    audit_record(record, prepared, limit)
    assert len(record.prompt.reached) == len(record.instruction)


SERVER_WITH_64_TOKENS = read_policy("openpi://localhost:1?prompt_tokens=64&connect=1")
"""Nobody listens there."""


def test_long_prompts_refuse_ends_an_episode_before_it_costs_anything(tmp_path):
    job = job_with(**LONG_INSTRUCTION, ref=SERVER_WITH_64_TOKENS)

    record = EpisodeRunner(tmp_path, refuse_long=True)(job)

    assert (record.outcome, record.error, record.steps) == ("error", "prompt", 0)
    said = r"prompt: the instruction needs \d+ to \d+ tokens, .* model reads 64; "
    assert re.match(said, record.cause)
    assert record.attribution is None
    assert record.prompt_verdict == "cut"
    assert "env_reset" not in record.timings


def test_long_prompts_refuse_lets_an_instruction_begin_that_is_short_enough_in_turns(tmp_path):
    """It gets as far as the server, to which it cannot connect."""
    job = job_with(**LONG_INSTRUCTION, ref=SERVER_WITH_64_TOKENS, delivery="turns")

    record = EpisodeRunner(tmp_path, refuse_long=True)(job)

    assert record.error == "connection"


@pytest.mark.parametrize("verdict", ["heard", "unknown"])
def test_a_prompt_that_may_or_may_not_be_cut_is_not_refused(verdict, monkeypatch):
    job = job_with()
    audited = audit_job(job, LIMIT_OF_64_TOKENS)._replace(verdict=verdict)
    monkeypatch.setattr("roboirg.runs.play.prompt_shares.audit_job", lambda *_: audited)

    check_prompt(job, LIMIT_OF_64_TOKENS, instruct_job(job))


def test_long_prompts_are_sent_or_refused_and_nothing_else():
    with pytest.raises(InvalidValueError, match="must be 'send' or 'refuse'"):
        make_plan(["random"], long_prompts="cut")


def test_of_a_tokenizer_that_is_a_pipe_the_policy_and_the_file_are_named(tmp_path):
    """To open it would wait for ever."""
    os.mkfifo(tmp_path / "pipe.model")
    policy = f"mine=openpi://localhost:1?prompt_tokens=64&tokenizer={tmp_path}/pipe.model"
    jobs = make_plan([policy], tasks="PickXtimes", episodes="0,").jobs()

    with pytest.raises(InvalidValueError, match=r"policy mine .*pipe\.model is not a regular file"):
        prompt_shares(jobs)


def test_a_dry_run_prints_the_share_of_cut_prompts_and_the_policies_without_a_limit(tmp_path):
    words = ["run", "--dry-run", "--out", str(tmp_path), "--tasks", "PickXtimes"]
    words += ["--policy", "system:pi0.5", "--policy", "far=openpi://localhost:1"]
    said = CliRunner().invoke(main.app, [*words, "--plan", plan_file(distractors=16)])
    assert said.exit_code == 0, said.output

    row = next(line for line in said.output.splitlines() if "64 tokens" in line)
    assert "system:pi0.5" in row
    assert "100 %" in row
    assert "No limit declared (prompt_tokens=N), so cuts are unknown: far." in said.output
