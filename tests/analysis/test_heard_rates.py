"""Cut prompts in tables and on the page."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from flat_jobs import frame_of, make_result, make_results
from made_records import make_record
from page_text import call, store

from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.tables.diagnostic_tables import make_heard_table
from roboirg.analysis.tables.run_tables import make_run_tables
from roboirg.core.instruction_options import InstructionOptions
from roboirg.policies.prompt_length.prompt_audit import PromptLimit, most_tokens
from roboirg.records.record import Job, Record, Summary
from roboirg.runs.job_instruction import PreparedJob
from roboirg.runs.play.episode_record import audit_record


def results_of_rows(*rows: tuple[str, str], **fields: object) -> list[Summary]:
    return [
        make_result(outcome, number, prompt_verdict=verdict, **fields)
        for number, (outcome, verdict) in enumerate(rows)
    ]


def test_a_table_has_rates_over_prompts_that_were_read_whole_next_to_rates_over_all():
    """A prompt longer than the model reads is *cut*; without a tokenizer this is *unknown*.

    Columns: prompts, % cut (0–50 with an unknown one), % success, prompts heard, % success of
    these. Rates of all tasks are means over tasks: (33.33 + 50) / 2 = 41.67.
    """
    contextual = {"setting": "contextual"}
    results = [
        *results_of_rows(("success", "heard"), ("failure", "heard")),
        *results_of_rows(
            ("failure", "cut"),
            ("failure", "cut"),
            ("success", "heard"),
            ("error", "cut"),
            **contextual,
        ),
        *results_of_rows(
            ("failure", "unknown"), ("success", "heard"), task="BinFill", **contextual
        ),
        *results_of_rows(("success", "unknown"), policy="other"),
    ]
    data = RunData(frame_of(results))

    table = make_heard_table(data)
    rows = {(row.group, row.name): [entry.text for entry in row.entries] for row in table.rows}
    assert rows == {
        ("listener, explicit", "PickXtimes"): ["2", "0", "50.00", "2", "50.00"],
        ("listener, contextual", "PickXtimes"): ["4", "75", "33.33", "1", "100.00"],
        ("listener, contextual", "BinFill"): ["2", "0–50", "50.00", "1", "100.00"],
        ("listener, contextual", "all tasks"): ["6", "38–62", "41.67", "2", "100.00"],
    }

    note = (
        "listener did not read every instruction to its end (its prompt is limited): 38–50 % of "
        "its prompts were cut; tables --which heard has the rates."
    )
    assert [note in table.notes for table in make_run_tables(data.frame)] == [True, False]


def long_record(policy: str, tokens: int | None, **fields: object) -> Record:
    job = Job(
        policy=policy,
        task="PickXtimes",
        split="test",
        episode=0,
        **fields,
        options=InstructionOptions("contextual", distractors=16),
    )
    limit = None if tokens is None else PromptLimit(tokens, 0, most_tokens, "some.model")
    record = make_record(job, "failure", "because", started_at="2026-01-02T03:04:05+00:00")
    if limit is not None:
        audit_record(record, PreparedJob(job), limit)
    return record


@pytest.fixture
def run_with_three_prompt_limits(tmp_path: Path) -> Path:
    limits = ("cutting", 64), ("whole", 1000), ("silent", None)
    return store(tmp_path, [long_record(policy, tokens) for policy, tokens in limits]).folder


@pytest.mark.browser
def test_the_page_strikes_out_the_words_that_the_model_did_not_read(
    open_page, run_with_three_prompt_limits
):
    call("report", run_with_three_prompt_limits)
    with open_page((run_with_three_prompt_limits / "report.html").as_uri()) as page:
        warnings = " ".join(page.locator(".warning").all_inner_texts())
        assert "cutting did not read every instruction to its end" in warnings
        prompt = r"cut: needs .* the model reads 64 \(counted with some\.model\).* mentions lost"
        found = {}
        for policy in ("whole", "silent", "cutting"):
            page.select_option("#filters [name=policy]", policy)
            row = page.locator("#rows > li").first
            row.locator("h3 button").click()
            struck = "".join(row.locator(".turns del").all_inner_texts())
            found[policy] = struck.replace(" ", ""), bool(re.search(prompt, row.inner_text()))
        record = long_record("cutting", 64)
        turns = zip(record.instruction, record.prompt.reached, strict=True)  # type: ignore[union-attr]
        cut = "".join(turn.text[end:] for turn, end in turns).replace(" ", ""), True
        assert found == {"whole": ("", False), "silent": ("", False), "cutting": cut}


def test_a_note_counts_the_episodes_in_which_a_policy_had_to_guess_what_was_meant():
    """One of four. Would find a guess that passes for an understood instruction."""
    known = make_results("111")
    guess = make_result("failure", 3, guessed=True)
    (table,) = make_run_tables(frame_of([*known, guess]))
    words = "guessed a goal in 1 of 4 episodes, whose words have no meaning for it."

    assert [note for note in table.notes if words in note]

    (table,) = make_run_tables(frame_of(known))
    assert not [note for note in table.notes if "guessed" in note]
