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


def test_shares_of_cut_prompts_are_by_policy_and_setting():
    """16 distractors make contextual ones too long for a's 64 tokens, but not for b's 1,000."""
    plan = make_plan(
        ["a=system:pi0.5", "b=openpi://localhost:1?prompt_tokens=1000", "random"],
        settings="explicit,contextual", tasks="PickXtimes", distractors=16,
    )  # fmt: skip

    a, b, without_limit = prompt_shares(plan.jobs())

    assert share_text(a.settings["contextual"]) == "100 %"
    assert share_text(a.settings["explicit"]) == "0 %"
    assert share_text(b.settings["contextual"]) == "0 %"
    assert without_limit.limit is None


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
    """The counts are made fast, for groups; here they are compared with one by one.

    Would find a group whose members differ in task, form, delivery, arm or limit.
    """
    plan = make_plan(
        [f"p{tokens}=openpi://localhost:1?prompt_tokens={tokens}" for tokens in (40, 60, 80)],
        tasks="StopCube,BinFill", settings="explicit,contextual", forms="implicit,resolved",
        episodes="0-2", in_turns="contextual", arms="told,silent",
    )  # fmt: skip

    shares = prompt_shares(plan.jobs())

    one_by_one = {share.policy: {} for share in shares}
    limits = {share.policy: share.limit for share in shares}
    for job in plan.jobs():
        _, verdict = audit_job(job, limits[job.policy])
        one_by_one[job.policy].setdefault(job.setting, Counter())[verdict] += 1
    assert one_by_one == {share.policy: share.settings for share in shares}


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


def test_an_instruction_too_long_as_one_prompt_fits_if_it_comes_in_turns():
    """The model reads 64 tokens; the instruction has more, but each of its messages has fewer.

    *cut* is a prompt of which the model loses the end, *heard* one that it reads whole.
    """
    _, at_once = audit_job(job_with(**LONG_INSTRUCTION), LIMIT_OF_64_TOKENS)
    audit, in_turns = audit_job(job_with(**LONG_INSTRUCTION, delivery="turns"), LIMIT_OF_64_TOKENS)

    assert (at_once, in_turns) == ("cut", "heard")
    assert audit.needed[1] < 64


@pytest.fixture
def record_of_cut_prompt():
    """The record of an episode whose instruction is longer than 64 tokens."""
    record = make_record(job_with(**LONG_INSTRUCTION), "failure", "because")
    audit_record(record, PreparedJob(job_with(**LONG_INSTRUCTION)), LIMIT_OF_64_TOKENS)
    return record


def test_a_record_notes_how_many_tokens_a_cut_prompt_needed(record_of_cut_prompt):
    """The model reads 64 tokens; its tokenizer is known, so least and most needed are equal."""
    audit = record_of_cut_prompt.prompt

    assert record_of_cut_prompt.prompt_verdict == "cut"
    assert audit.needed[0] == audit.needed[1] > 64
    assert audit.tokenizer == "some.model"
    assert read_record(encode(record_of_cut_prompt), Path(), 1) == record_of_cut_prompt


def test_a_record_notes_how_far_each_utterance_of_a_cut_prompt_was_read(record_of_cut_prompt):
    """In characters: all of the first utterance, and none of the last."""
    first, *_, last = record_of_cut_prompt.prompt.reached

    assert first == len(record_of_cut_prompt.instruction[0].text)
    assert last == 0


def test_a_record_notes_the_mentions_in_what_was_not_read(record_of_cut_prompt):
    """The last mention is in the command, which stands at the end of the instruction."""
    last = len(record_of_cut_prompt.mentions) - 1

    assert record_of_cut_prompt.mentions[last].utterance == (
        len(record_of_cut_prompt.instruction) - 1
    )
    assert last in record_of_cut_prompt.prompt.lost


def test_episodes_are_the_same_although_their_prompts_were_cut_differently():
    assert not {"prompt", "prompt_verdict"} & set(IDENTITY)


def test_a_record_of_a_policy_without_a_declared_limit_is_unknown_not_heard():
    record = make_record(job_with(), "success")
    assert (record.prompt, record.prompt_verdict) == (None, "unknown")


def test_utterances_that_were_never_sent_count_neither_as_read_nor_as_lost():
    """The episode ended after the first of several turns. The limit is 3 tokens."""
    job = job_with(setting="contextual", delivery="turns")
    prepared = PreparedJob(job)
    heard = utterances_at(prepared, heard_steps=[0])
    record = make_record(job, "failure", "because", instruction=heard)

    audit_record(record, prepared, LIMIT_OF_64_TOKENS._replace(tokens=3))

    assert len(record.prompt.reached) == 1 < len(record.instruction)
    assert {record.mentions[index].utterance for index in record.prompt.lost} <= {0}


def test_all_utterances_count_in_an_episode_of_which_no_steps_are_known():
    job = job_with(setting="contextual", delivery="turns")
    prepared = PreparedJob(job)
    heard = utterances_at(prepared, heard_steps=[])
    record = make_record(job, "failure", "because", instruction=heard)

    audit_record(record, prepared, LIMIT_OF_64_TOKENS)

    assert len(record.prompt.reached) == len(record.instruction)


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
    """The one policy reads 64 tokens and all of its prompts are cut; the other tells no limit."""
    printed = call(
        "run", "--dry-run", "--out", tmp_path, "--tasks", "PickXtimes",
        "--policy", "system:pi0.5", "--policy", "far=openpi://localhost:1",
        "--plan", plan_file(distractors=16),
    )  # fmt: skip

    (row,) = [line for line in printed.splitlines() if "64 tokens" in line]
    assert "system:pi0.5" in row
    assert "100 %" in row
    assert "No limit declared (prompt_tokens=N), so cuts are unknown: far." in printed
