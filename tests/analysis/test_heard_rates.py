"""Cut prompts in tables and on the page."""

from __future__ import annotations

import re

import pytest
from flat_jobs import frame_of, make_result, make_results
from made_records import make_record
from page_text import call, store

from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.tables.diagnostic_tables import make_heard_table
from roboirg.analysis.tables.run_tables import make_run_tables
from roboirg.core.instruction_options import InstructionOptions
from roboirg.policies.prompt_length.prompt_audit import PromptLimit, most_tokens
from roboirg.records.record import Job
from roboirg.runs.job_instruction import PreparedJob
from roboirg.runs.play.episode_record import audit_record


def results_of_rows(*rows, **fields):
    """Return a result for each row of an outcome and of how much of the prompt was read.

    Episodes are numbered from 0; ``("failure", "cut")`` is a failure whose prompt was cut.
    """
    found = []
    for episode, (outcome, verdict) in enumerate(rows):
        found.append(make_result(outcome, episode, prompt_verdict=verdict, **fields))
    return found


def results_with_cut_and_unknown_prompts():
    """Return results of the listener in two settings, and one of another policy."""
    explicit = results_of_rows(("success", "heard"), ("failure", "heard"))
    contextual = results_of_rows(
        ("failure", "cut"),
        ("failure", "cut"),
        ("success", "heard"),
        ("error", "cut"),
        setting="contextual",
    )
    other_task = results_of_rows(
        ("failure", "unknown"), ("success", "heard"), task="BinFill", setting="contextual"
    )
    other_policy = results_of_rows(("success", "unknown"), policy="other")
    return [*explicit, *contextual, *other_task, *other_policy]


def test_a_table_has_rates_over_prompts_that_were_read_whole_next_to_rates_over_all():
    """A prompt longer than the model reads is *cut*; without a tokenizer this is *unknown*.

    Columns: prompts, % cut (0–50 with an unknown one), % success, prompts heard, % success of
    these. Rates of all tasks are means over tasks: (33.33 + 50) / 2 = 41.67.
    """
    table = make_heard_table(RunData(frame_of(results_with_cut_and_unknown_prompts())))

    rows = {(row.group, row.name): [entry.text for entry in row.entries] for row in table.rows}
    assert rows == {
        ("listener, explicit", "PickXtimes"): ["2", "0", "50.00", "2", "50.00"],
        ("listener, contextual", "PickXtimes"): ["4", "75", "33.33", "1", "100.00"],
        ("listener, contextual", "BinFill"): ["2", "0–50", "50.00", "1", "100.00"],
        ("listener, contextual", "all tasks"): ["6", "38–63", "41.67", "2", "100.00"],
    }


def test_a_note_below_the_table_of_a_policy_says_how_many_of_its_prompts_were_cut():
    """Of the listener's 8 prompts 3 were cut, and of one it is not known: 3 to 4, 38 to 50 %.

    The table of the other policy, of whose only prompt it is not known, has no such note.
    """
    listener, other = make_run_tables(frame_of(results_with_cut_and_unknown_prompts()))

    note = (
        "listener did not read every instruction to its end (its prompt is limited): 38–50 % of "
        "its prompts were cut; tables --which heard has the rates."
    )
    assert note in listener.notes
    assert note not in other.notes


def long_record(policy, tokens):
    """Return a record with a long context, by a policy whose prompt has room for some tokens.

    None leaves it unsaid how much the policy reads.
    """
    options = InstructionOptions("contextual", distractors=16)
    job = Job(policy=policy, task="PickXtimes", split="test", episode=0, options=options)
    record = make_record(job, "failure", "because", started_at="2026-01-02T03:04:05+00:00")
    if tokens is not None:
        limit = PromptLimit(tokens, 0, most_tokens, "some.model")
        audit_record(record, PreparedJob(job), limit)
    return record


@pytest.fixture
def run_with_three_prompt_limits(tmp_path):
    """Of a policy that cuts the instruction, one that reads it whole, and one that does not say."""
    records = [
        long_record("cutting", 64),
        long_record("whole", 1000),
        long_record("silent", None),
    ]
    return store(tmp_path, records).folder


def opened_episode_of(page, policy):
    """Choose a policy in the page's filters, open its only episode, and return its element."""
    page.select_option("#filters [name=policy]", policy)
    page.locator("#rows h3 button").first.click()
    return page.locator("#rows > li").first


@pytest.mark.browser
@pytest.mark.parametrize("policy", ["whole", "silent"])
def test_the_page_strikes_out_nothing_of_a_prompt_that_was_read_whole_or_is_not_known(
    open_page, run_with_three_prompt_limits, policy
):
    """*whole* reads up to 1,000 tokens, more than the instruction has; *silent* does not say.

    What a model did not read would be struck out (`del`), with a line that it was cut.
    """
    call("report", run_with_three_prompt_limits)

    with open_page((run_with_three_prompt_limits / "report.html").as_uri()) as page:
        episode = opened_episode_of(page, policy)
        struck = episode.locator(".turns del").all_inner_texts()
        shown = episode.inner_text()

    assert struck == []
    assert "cut: needs" not in shown


@pytest.mark.browser
def test_the_page_strikes_out_the_words_that_the_model_did_not_read(
    open_page, run_with_three_prompt_limits
):
    """The policy *cutting* reads only the first 64 tokens of an instruction of several turns.

    Its record says how many characters of each turn were read: what follows is struck out (`del`).
    The page also warns at its top, and says at the episode what was cut.
    """
    record = long_record("cutting", tokens=64)
    unread = ""
    for turn, characters_read in zip(record.instruction, record.prompt.reached, strict=True):
        unread += turn.text[characters_read:]
    call("report", run_with_three_prompt_limits)

    with open_page((run_with_three_prompt_limits / "report.html").as_uri()) as page:
        warnings = " ".join(page.locator(".warning").all_inner_texts())
        episode = opened_episode_of(page, "cutting")
        struck = "".join(episode.locator(".turns del").all_inner_texts())
        shown = episode.inner_text()

    assert "cutting did not read every instruction to its end" in warnings
    assert struck.replace(" ", "") == unread.replace(" ", "") != ""
    assert re.search(r"cut: needs .* the model reads 64 .* mentions lost", shown)


@pytest.mark.parametrize("guessed", [True, False])
def test_a_note_counts_the_episodes_in_which_a_policy_had_to_guess_what_was_meant(guessed):
    """Of five planned episodes three (0 to 2) are won, number 3 is lost, and 4 is still to play.

    In episode 3 the policy guessed a goal or did not: one of the four that were played, or none.
    Would find a guess that passes for an understood instruction.
    """
    won = make_results("111")
    last = make_result("failure", episode=3, guessed=guessed)
    unplayed = make_result(episode=4).identity

    (table,) = make_run_tables(frame_of([*won, last], planned=[unplayed]))

    words = "guessed a goal in 1 of 4 episodes, whose words have no meaning for it."
    assert (words in " ".join(table.notes)) == guessed
