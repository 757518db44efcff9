"""Cut prompts in plans, dry runs, records and reports."""

import os
import re
from collections import Counter
from pathlib import Path

import pytest
from flat_jobs import job_of
from made_records import make_record
from page_text import call
from plan_files import plan_file

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
    PromptShares,
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
    """Return a job: PickXtimes test/0 in *direct* by the policy `random`, with other fields."""
    usual = {"policy": "random", "task": "PickXtimes", "split": "test", "episode": 0}
    return job_of(**{**usual, "setting": "direct", **fields})


def audited_record(tokens, heard_steps=(), **fields):
    """Return the record of an episode of a policy whose model reads so many tokens of a prompt.

    Args:
        tokens: limit of the model.
        heard_steps: control steps at which utterances were heard, if they are told in turns.
        fields: of the job.
    """
    prepared = PreparedJob(job_with(**fields))
    heard = utterances_at(prepared, heard_steps)
    record = make_record(prepared.job, "failure", "because", instruction=heard)
    audit_record(record, prepared, LIMIT_OF_64_TOKENS._replace(tokens=tokens))
    return record


def test_every_model_of_the_paper_reads_all_instructions_of_the_papers_plan_to_the_end():
    """A model reads so many tokens of a prompt, at least 64 for those of the paper's systems; the
    rest is cut. Of the plan named *paper*, which has all tasks and settings, two of the 50 episodes
    of each are counted. In no setting a prompt is cut, so there is no warning either."""
    plan = make_plan(
        ALL_SYSTEMS_OF_THE_PAPER,
        **{**read_plan_file("paper"), "policy_seeds": "0", "episodes": "0,29"},
    )

    shares = prompt_shares(plan.jobs())

    assert [share.policy for share in shares] == ALL_SYSTEMS_OF_THE_PAPER
    for share in shares:
        assert share.limit.tokens >= 64
        cut = {setting: share_text(verdicts) for setting, verdicts in share.settings.items()}
        assert cut == dict.fromkeys(
            ("explicit", "direct", "reasoning", "contextual", "spatial"), "0 %"
        )
    assert not list(warning_lines(shares))


@pytest.mark.parametrize(
    ("settings", "line"),
    [
        (
            {"explicit": Counter(heard=4), "contextual": Counter(cut=4)},
            r"a reads 64 tokens of a prompt.* contextual 100 %\.",
        ),
        (
            {"direct": Counter(unknown=1, heard=1)},
            r".*instructions does not reach it: direct 0–50 %\.",
        ),
    ],
    ids=["cut", "may be cut"],
)
def test_a_warning_names_the_settings_whose_instructions_are_not_read_to_the_end(settings, line):
    share = PromptShares("a", LIMIT_OF_64_TOKENS, settings)

    (warning,) = warning_lines([share])

    assert re.fullmatch(line, warning)


def test_each_episode_is_counted_by_its_own_words_and_its_policys_limit():
    """Three policies read 40, 60 and 80 tokens of a prompt. To be fast, the verdict about a prompt,
    whether it is cut, is kept for all jobs with the same words and limit.

    Here each job is judged alone, and the counts must be the same. The plan has jobs that differ in
    nothing but their task, setting, form, episode, arm, or in whether the utterances of an
    instruction come in turns. Would find two of them that share a verdict by mistake.
    """
    plan = make_plan(
        [f"p{tokens}=openpi://localhost:1?prompt_tokens={tokens}" for tokens in (40, 60, 80)],
        tasks="StopCube,BinFill", settings="explicit,contextual", forms="implicit,resolved",
        episodes="0-2", in_turns="contextual", arms="told,silent",
    )  # fmt: skip

    shares = prompt_shares(plan.jobs())

    assert [share.limit.tokens for share in shares] == [40, 60, 80]
    for share in shares:
        counts = {"explicit": Counter(), "contextual": Counter()}
        for job in plan.jobs():
            if job.policy == share.policy:
                counts[job.setting][audit_job(job, share.limit).verdict] += 1
        assert share.settings == counts


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
    """1 of 4 is cut, 25 %; if one more may be, it is 25 to 50 %."""
    assert share_text(Counter(counts)) == text


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


def test_a_record_notes_how_many_tokens_a_cut_prompt_needed():
    """The model reads 64 tokens; 16 sentences without use (distractors) make the prompt longer.

    Its tokenizer is known, so the least and the most that may be needed are equal. The record is
    the same after it was written and read.
    """
    record = audited_record(tokens=64, setting="contextual", distractors=16)

    least, most = record.prompt.needed
    assert (record.prompt_verdict, record.prompt.tokenizer) == ("cut", "some.model")
    assert least == most > 64
    assert read_record(encode(record), Path("records.jsonl"), 1) == record


def test_episodes_are_the_same_although_their_prompts_were_cut_differently():
    """What a model reads is no part of what tells one episode from another."""
    assert not {"prompt", "prompt_verdict"} & set(IDENTITY)


def test_a_record_of_a_policy_without_a_declared_limit_is_unknown_not_heard():
    """The policy `random` does not say how many tokens it reads, so a prompt may have been cut."""
    record = make_record(job_with(), "success")

    assert (record.prompt, record.prompt_verdict) == (None, "unknown")


def test_utterances_that_were_never_sent_count_neither_as_read_nor_as_lost():
    """The episode ended after the first of five utterances, heard at step 0; others come in turns.

    The model reads 3 tokens, so it loses "green" at the end of that utterance, which is the mention
    with the index 0. Two other mentions are in the command, which was never sent.
    """
    record = audited_record(tokens=3, heard_steps=[0], setting="contextual", delivery="turns")

    assert [mention.utterance for mention in record.mentions] == [0, 4, 4]
    assert len(record.prompt.reached) == 1
    assert record.prompt.lost == (0,)


def test_all_utterances_count_in_an_episode_of_which_no_steps_are_known():
    """Utterances come in turns, but the record does not say when any of them was heard.

    Then all count as sent. The model reads 64 tokens of each, which is enough: it reads as many
    characters of each (`reached`) as it has.
    """
    record = audited_record(tokens=64, heard_steps=[], setting="contextual", delivery="turns")

    assert [utterance.step for utterance in record.instruction] == [None] * 5
    assert record.prompt.reached == tuple(len(said.text) for said in record.instruction)


SERVER_WITH_64_TOKENS = read_policy("openpi://localhost:1?prompt_tokens=64&connect=1")
"""Nobody listens there."""


def test_long_prompts_refuse_ends_an_episode_before_it_costs_anything(tmp_path):
    """The instruction has more than the 64 tokens that the model on the server reads.

    The episode ends as an error before the world is made (no time for `env_reset`) and before the
    server is asked: nobody listens there, which would be another error.
    """
    job = job_with(**LONG_INSTRUCTION, ref=SERVER_WITH_64_TOKENS)

    record = EpisodeRunner(tmp_path, refuse_long=True)(job)

    assert (record.outcome, record.error, record.steps) == ("error", "prompt", 0)
    assert re.match(
        r"prompt: the instruction needs \d+ to \d+ tokens, .* model reads 64; ", record.cause
    )
    assert "env_reset" not in record.timings


def test_long_prompts_refuse_lets_an_instruction_begin_that_is_short_enough_in_turns(tmp_path):
    """The instruction has more than the 64 tokens that the model reads of a message, but it comes
    in turns, and each utterance has fewer. The episode gets as far as to ask the server that has
    the model: nobody listens there, so its error is not of the prompt, but of the connection."""
    job = job_with(**LONG_INSTRUCTION, ref=SERVER_WITH_64_TOKENS, delivery="turns")

    record = EpisodeRunner(tmp_path, refuse_long=True)(job)

    assert record.error == "connection"


@pytest.mark.parametrize("verdict", ["heard", "unknown"])
def test_a_prompt_that_may_or_may_not_be_cut_is_not_refused(verdict, monkeypatch):
    """The audit of a prompt is replaced by one with this verdict; no error is raised."""
    job = job_with()
    audited = audit_job(job, LIMIT_OF_64_TOKENS)._replace(verdict=verdict)
    monkeypatch.setattr("roboirg.runs.play.prompt_shares.audit_job", lambda *_: audited)

    check_prompt(job, LIMIT_OF_64_TOKENS, instruct_job(job))


def test_long_prompts_are_sent_or_refused_and_nothing_else():
    with pytest.raises(InvalidValueError, match="must be 'send' or 'refuse'"):
        make_plan(["random"], long_prompts="cut")


def test_of_a_tokenizer_that_is_a_pipe_the_policy_and_the_file_are_named(tmp_path):
    """The policy *mine* names a file with the tokenizer of its model. It is a pipe that nobody
    writes to, so to open it would wait for ever."""
    os.mkfifo(tmp_path / "pipe.model")
    policy = f"mine=openpi://localhost:1?prompt_tokens=64&tokenizer={tmp_path}/pipe.model"
    jobs = make_plan([policy], tasks="PickXtimes", episodes="0,").jobs()

    with pytest.raises(InvalidValueError, match=r"policy mine .*pipe\.model is not a regular file"):
        prompt_shares(jobs)


def test_a_dry_run_prints_the_share_of_cut_prompts_and_the_policies_without_a_limit(tmp_path):
    """The model of *system:pi0.5* reads 64 tokens; 16 distractors, sentences without use, make all
    of its prompts longer. The policy *far* does not say how many it reads. A dry run plays nothing.
    """
    printed = call(
        "run", "--dry-run", "--out", tmp_path, "--tasks", "PickXtimes",
        "--policy", "system:pi0.5", "--policy", "far=openpi://localhost:1",
        "--plan", plan_file(distractors=16),
    )  # fmt: skip

    (row,) = [line for line in printed.splitlines() if "64 tokens" in line]
    assert "system:pi0.5" in row
    assert "100 %" in row
    assert "No limit declared (prompt_tokens=N), so cuts are unknown: far." in printed
