"""Gaps by kind of instruction: labels from records, pairing by episode, tables, comparisons."""

from __future__ import annotations

import html
import json
import re
import tracemalloc
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from made_records import make_record
from msgspec.structs import replace
from page_text import render
from roboirg.evaluation.analysis.stats.breakdown_rows import break_down
from roboirg.evaluation.analysis.tables.breakdown_table import make_breakdown_table
from typer.testing import CliRunner

from roboirg.cli.report_commands import compare as compare_command
from roboirg.cli.report_commands import tables
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.evaluation.analysis.stats.breakdowns import (
    BREAKDOWNS,
    COMPETING,
    NO_RIVAL,
    RIVAL,
    UNKNOWN,
    InstructionKey,
    cells_by_label,
    find_breakdowns,
    label_instructions,
)
from roboirg.evaluation.analysis.stats.cells import CellResults, gather
from roboirg.evaluation.analysis.stats.comparison import compare
from roboirg.evaluation.analysis.stats.comparison_text import sentences
from roboirg.evaluation.analysis.stats.paired_tests import Pairs, measure_gap
from roboirg.evaluation.plan.plan import Plan
from roboirg.evaluation.plan.stored_plans import write_plan
from roboirg.evaluation.records.record import Job, Record
from roboirg.evaluation.records.record_codec import encode
from roboirg.evaluation.records.store import (
    RECORDS_FILE,
    RecordStore,
    iterate_records,
    read_results,
)

app = typer.Typer()
app.command("tables")(tables)
app.command("compare")(compare_command)

PLAN = Plan(
    policies=("listener", "forgetful"),
    tasks=("PickXtimes", "VideoUnmask"),
    settings=("explicit", "direct", "reasoning", "contextual"),
    episodes=tuple(range(8)),
)


def played(job: Job) -> Record:
    """The forgetful policy fails in every implicit instruction that says *it*, and in no other."""
    record = make_record(job, "success")
    says_it = any(one.expression == "it" for one in record.mentions)
    if job.policy == "listener" or not says_it:
        return record
    return replace(record, outcome="failure", cause="it?")


@pytest.fixture(scope="module")
def records() -> tuple[Record, ...]:
    return tuple(played(job) for job in PLAN.jobs())


@pytest.fixture(scope="module")
def run(records: tuple[Record, ...], tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "both"
    write(folder, records)
    write_plan(PLAN, folder)
    return folder


def write(folder: Path, records: tuple[Record, ...]) -> None:
    with RecordStore(folder) as store:
        for record in records:
            store.append(record)


def call(*words: object) -> str:
    outcome = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)
    assert outcome.exit_code == 0, outcome.output
    return outcome.output


def labels_of(name: str, record: Record, **metadata: object) -> tuple[str, ...]:
    changed = replace(record, metadata={**record.metadata, **metadata})
    return BREAKDOWNS[name].labels(changed)


def one(records: tuple[Record, ...], task: str, setting: str, says: str | None = None) -> Record:
    """The first record whose command has a class of expressions."""
    return next(
        r for r in records
        if (r.task, r.setting) == (task, setting)
        and (says is None or any(
            mention.expression == says and mention.utterance == max(m.utterance for m in r.mentions)
            for mention in r.mentions
        ))
    )  # fmt: skip


# Labels


def test_labels_are_what_the_record_says(records: tuple[Record, ...]) -> None:
    direct, reasoning = (
        one(records, "PickXtimes", "direct"),
        one(records, "PickXtimes", "reasoning"),
    )
    contextual = one(records, "PickXtimes", "contextual", says="it")
    assert BREAKDOWNS["pattern"].labels(reasoning) == (reasoning.metadata["pattern"],)
    assert BREAKDOWNS["pattern"].labels(direct) == ()
    assert BREAKDOWNS["expression"].labels(direct) == ("that",)
    assert BREAKDOWNS["slots"].labels(direct) == ("2",)
    assert BREAKDOWNS["slots"].labels(reasoning) == ("1",)
    assert BREAKDOWNS["rival"].labels(direct) == ()
    assert labels_of("rival", direct, rival_reference="contrast") == ("one of two: contrast",)
    assert labels_of("rival", contextual, recency_rival="the printer") == (RIVAL,)
    assert labels_of("rival", contextual, recency_rival=None) == (NO_RIVAL,)
    assert labels_of("rival", contextual, distractor="competing") == (COMPETING,)
    for task in PLAN.tasks:
        explicit = one(records, task, "explicit")
        assert all(
            BREAKDOWNS[name].labels(explicit) == () for name in ("pattern", "slots", "rival")
        )


def test_a_rival_needs_a_pronoun_in_the_command(records: tuple[Record, ...]) -> None:
    contextual = one(records, "PickXtimes", "contextual", says="it")
    others = tuple(mention for mention in contextual.mentions if mention.expression != "it")
    without = replace(contextual, mentions=others)
    assert labels_of("rival", without, recency_rival="the printer") == ()


@pytest.mark.parametrize(
    ("name", "setting", "lacking"),
    [
        ("pattern", "reasoning", "pattern"),
        ("slots", "direct", "hidden_slots"),
        ("rival", "contextual", "recency_rival"),
        ("rival", "contextual", "distractor"),
    ],
)
def test_records_that_do_not_say_are_unknown(
    records: tuple[Record, ...], name: str, setting: str, lacking: str
) -> None:
    record = one(records, "PickXtimes", setting, says="it" if name == "rival" else None)
    rest = {key: value for key, value in record.metadata.items() if key != lacking}
    older = replace(record, metadata=rest)
    assert BREAKDOWNS[name].labels(older) == (UNKNOWN,)
    bare = replace(record, mentions=())
    assert BREAKDOWNS["expression"].labels(bare) == (UNKNOWN,)


def test_what_one_record_tells_holds_for_the_same_instruction_in_an_older_one(
    records: tuple[Record, ...],
) -> None:
    new = one(records, "PickXtimes", "direct")
    old = replace(new, policy="older", metadata={"pattern": None})
    for order in ([new, old], [old, new]):
        found = label_instructions(find_breakdowns(["slots"]), order)["slots"]
        assert found == {InstructionKey.of(new): ("2",)}
    other = replace(old, language_version="0.9")
    found = label_instructions(find_breakdowns(["slots"]), [new, other])["slots"]
    assert found[InstructionKey.of(other)] == (UNKNOWN,)


def test_a_break_down_that_does_not_exist() -> None:
    with pytest.raises(UnknownNameError, match="pattern, expression, slots, rival"):
        find_breakdowns(["pattern", "colour"])


def test_only_the_command_s_expressions_count(records: tuple[Record, ...]) -> None:
    found = {
        label
        for record in records
        if record.setting == "contextual"
        for label in BREAKDOWNS["expression"].labels(record)
    }
    said = {m.expression for r in records if r.setting == "contextual" for m in r.mentions}
    assert "them" in said - found, "said of the referents in a reinforcement"
    resolved = make_record(
        PLAN.jobs()[0].with_options(setting="contextual", form="resolved"),
        "success",
    )
    assert any(mention.expression for mention in resolved.mentions)
    assert BREAKDOWNS["expression"].labels(resolved) == ()


# Numbers


def test_rows_partition_the_trials_and_are_paired_with_explicit(
    records: tuple[Record, ...],
) -> None:
    cells = gather([("", records)])
    for name in ("pattern", "slots", "rival"):
        labels = label_instructions(find_breakdowns([name]), records)[name]
        rows = break_down(cells, labels)
        counted = Counter(
            (r.policy, r.setting, *BREAKDOWNS[name].labels(r))
            for r in records
            if r.setting != "explicit" and BREAKDOWNS[name].labels(r)
        )
        assert {
            (row.policy_run.policy, row.results.options.setting, row.label): row.results.trials
            for row in rows
        } == counted
        for row in rows:
            assert row.gap is not None
            assert row.gap.episodes == row.results.episodes


def hand_made(result: Any) -> tuple[list[Any], dict[InstructionKey, tuple[str, ...]]]:
    """Explicit wins in episodes 0 to 5 of 12, direct in 0 to 2; even episodes are labeled *a*."""
    results, labels = [], {}
    for episode in range(12):
        results.append(result("success" if episode < 6 else "failure", episode))
        direct = result("success" if episode < 3 else "failure", episode, setting="direct")
        results.append(direct)
        key = InstructionKey("PickXtimes", "test", episode, direct.options, "1", 1)
        labels[key] = ("a",) if episode % 2 == 0 else ("b", "c")
    return results, labels


def test_gaps_are_those_of_the_very_same_episodes(result: Any) -> None:
    results, labels = hand_made(result)
    rows = break_down(gather([("", results)]), labels)
    assert [(row.label, row.results.episodes) for row in rows] == [("a", 6), ("b", 6), ("c", 6)]
    gaps = [row.gap for row in rows]
    # Even episodes: explicit 0, 2, 4 and direct 0, 2; odd ones: explicit 1, 3, 5 and direct 1.
    assert [gap and round(gap.value * 6) for gap in gaps] == [-1, -2, -2]
    by_hand = measure_gap(
        [
            Pairs.of(
                CellResults({(e, 0): e < 3 for e in range(0, 12, 2)}),  # type: ignore[misc]
                CellResults({(e, 0): e < 6 for e in range(12)}),  # type: ignore[misc]
            )
        ],
        np.random.default_rng(0),
    )
    assert by_hand is not None
    assert rows[0].gap is not None
    assert rows[0].gap.p_value == by_hand.p_value
    assert rows[0].gap.overlap == by_hand.overlap
    smallest = min(gap.p_value for gap in gaps if gap)
    assert min(row.p_holm for row in rows if row.p_holm is not None) == min(1.0, 3 * smallest)


def test_a_label_without_explicit_has_no_gap(result: Any) -> None:
    results, labels = hand_made(result)
    direct = [one for one in results if one.setting == "direct"]
    rows = break_down(gather([("", direct)]), labels)
    assert {row.gap for row in rows} == {None}
    table = make_breakdown_table(BREAKDOWNS["slots"], gather([("", direct)]), labels)
    assert [entry.text for entry in table.rows[0].entries] == ["6", "33.33", "–", "–", "–"]
    assert "– without explicit on the same episodes." in table.notes


def test_trials_that_no_record_describes_are_unknown_and_last(result: Any) -> None:
    results, labels = hand_made(result)
    some = {key: value for key, value in labels.items() if key.episode < 10}
    cells = gather([("", results)])
    rows = break_down(cells, some)
    assert [(row.label, row.results.episodes) for row in rows][-1] == (UNKNOWN, 2)
    numbers = dict.fromkeys(labels, ("zebra", "10", "9", UNKNOWN, "2 b"))
    direct = {key: cell for key, cell in cells.items() if key.options.setting == "direct"}
    assert list(cells_by_label(direct, numbers)) == ["2 b", "9", "10", "zebra", UNKNOWN]


def test_the_order_of_the_records_makes_no_difference(records: tuple[Record, ...]) -> None:
    labels = label_instructions(find_breakdowns(["expression"]), records)["expression"]
    tables_of = [
        make_breakdown_table(BREAKDOWNS["expression"], gather([("", order)]), labels)
        for order in (records, records[::-1])
    ]
    assert tables_of[0] == tables_of[1]


# Commands


def test_tables_by_everything(run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    output = call("tables", run, "--by", "all")
    for breakdown in BREAKDOWNS.values():
        assert f"Gap to explicit by {breakdown.title}" in output
    row = r"│ it +│ +\d+ │ +([\d.]+) │ +([−±\d.]+) │ +\S+ to \S+ │ +[01]\.\d{3} │"
    found = re.findall(row, output)
    assert found[:2] == [("0.00", "−100.0")] * 2, "direct and contextual of the forgetful one"
    call("tables", run, "--by", "pattern, slots", "--format", "csv", "--out", tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["by_pattern.csv", "by_slots.csv"]
    lines = (tmp_path / "by_slots.csv").read_text().splitlines()
    assert any(line.startswith("by_slots,ours,") and ",gap," in line for line in lines)
    for name in ("markdown", "latex"):
        text = call("tables", run, "--by", "rival", "--format", name)
        assert "no recency rival" in text
        assert "−" not in text if name == "latex" else "−" in text


def test_wrong_use_of_by(run: Path, tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="breakdown"):
        call("tables", run, "--by", "colour")
    with pytest.raises(InvalidValueError, match="--by prints tables of its own"):
        call("tables", run, "--by", "slots", "--published")
    with pytest.raises(InvalidValueError, match="--by needs a run"):
        call("tables", "--by", "slots")
    explicit = tuple(played(job) for job in PLAN.jobs() if job.setting == "explicit")
    write(tmp_path / "explicit", explicit)
    with pytest.raises(InvalidValueError, match="need an implicit setting"):
        call("tables", tmp_path / "explicit", "--by", "slots")


def test_older_runs_are_unknown(records: tuple[Record, ...], tmp_path: Path) -> None:
    write(tmp_path, records)
    lines = [json.loads(line) for line in (tmp_path / RECORDS_FILE).read_text().splitlines()]
    for line in lines:
        del line["metadata"]["hidden_slots"]
    text = "".join(f"{json.dumps(line)}\n" for line in lines)
    (tmp_path / RECORDS_FILE).write_text(text)
    output = call("tables", tmp_path, "--by", "slots")
    rows = [line for line in output.splitlines() if line.startswith("│")]
    assert rows
    assert all("unknown" in line for line in rows)
    assert "Unknown: the records are older than this field." in output


def test_policies_are_compared_by_label(run: Path) -> None:
    output = call("compare", f"{run}:listener", f"{run}:forgetful", "--by", "pattern,rival")
    assert "By reasoning pattern:" in output
    assert "By recency rival:" in output
    assert "  contextual, recency rival: " in output
    assert "  reasoning, color exclusion: no clear difference" in output
    assert "Each breakdown is corrected separately, over all its rows." in output
    assert "By " not in call("compare", f"{run}:listener", f"{run}:forgetful")


def test_a_compared_label_is_the_difference_on_its_episodes(result: Any) -> None:
    results, labels = hand_made(result)
    direct = [one for one in results if one.setting == "direct"]
    better = [replace(one, policy="better", outcome="success") for one in direct]
    found = compare(
        gather([("", better)]),
        gather([("", direct)]),
        {"letter": labels},
    )
    parts = found.parts["letter"]
    assert [(part.key.label, round(part.gap.value * 6)) for part in parts] == [
        ("a", 4), ("b", 5), ("c", 5),
    ]  # fmt: skip
    assert all(part.p_holm >= part.gap.p_value for part in parts)
    assert "  direct, a: " in "\n".join(sentences(found, "better", "listener"))
    empty = compare(
        gather([("", better)]),
        gather([("", direct)]),
        {"letter": dict.fromkeys(labels, ())},
    )
    assert "By letter: no instruction has one." in list(sentences(empty, "better", "listener"))


# The page


def test_the_page_has_the_same_tables(records: tuple[Record, ...]) -> None:
    pytest.importorskip("jinja2")
    page = render(records)
    cells = gather([("", records)])
    labels = label_instructions(find_breakdowns(BREAKDOWNS), records)
    for name, breakdown in BREAKDOWNS.items():
        assert f"<summary>By {breakdown.title}</summary>" in page
        table = make_breakdown_table(breakdown, cells, labels[name])
        for row in table.rows:
            cells_of = [re.escape(html.escape(entry.text)) for entry in row.entries]
            texts = r"\s*".join(f"<td>{text}</td>" for text in cells_of)
            assert re.search(rf'<th scope="row">{row.name}</th>\s*{texts}', page), row
    explicit = [record for record in records if record.setting == "explicit"]
    assert "By difficulty" in render(explicit)
    assert "By reasoning pattern" not in render(explicit)


@pytest.mark.browser
def test_tables_open_with_the_keyboard_and_fit_a_telephone(
    records: tuple[Record, ...], open_page: Any, tmp_path: Path
) -> None:
    pytest.importorskip("jinja2")
    path = tmp_path / "page.html"
    path.write_text(render(records))
    with open_page(path.as_uri()) as page:
        heads = page.locator("#kinds summary")
        assert heads.count() == len(BREAKDOWNS)
        assert page.locator("#kinds table:visible").count() == 0
        for number in range(heads.count()):
            heads.nth(number).press("Enter")
            assert page.locator("#kinds table:visible").count() == number + 1
        page.set_viewport_size({"width": 400, "height": 800})
        assert page.evaluate("document.documentElement.scrollWidth") == 400


# Memory


def test_labels_are_read_line_by_line(records: tuple[Record, ...], tmp_path: Path) -> None:
    """The long parts of records are dropped at once: labels take a small share of the file."""
    long = replace(records[1], details="x" * 20_000)
    with (tmp_path / RECORDS_FILE).open("w") as file:
        for episode in range(2000):
            file.write(encode(replace(long, episode=episode)).decode() + "\n")
    size = (tmp_path / RECORDS_FILE).stat().st_size
    tracemalloc.start()
    labels = label_instructions(find_breakdowns(BREAKDOWNS), iterate_records(tmp_path))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(labels["slots"]) == 2000
    assert peak < size / 5


def test_a_stored_instruction_has_the_labels_of_its_record(
    records: tuple[Record, ...], run: Path
) -> None:
    whole = label_instructions(find_breakdowns(BREAKDOWNS), records)
    assert label_instructions(find_breakdowns(BREAKDOWNS), iterate_records(run)) == whole
    assert len(read_results(run)) == len(records)


def test_difficulty_has_rows_for_explicit_and_gaps_on_the_same_episodes(
    records: tuple[Record, ...], run: Path
) -> None:
    (breakdown,) = find_breakdowns(["difficulty"])
    cells = gather([("", records)])
    table = make_breakdown_table(
        breakdown, cells, label_instructions([breakdown], records)["difficulty"]
    )
    texts = {
        (row.group.replace(" (privileged)", ""), row.name): [entry.text for entry in row.entries]
        for row in table.rows
    }
    # Of eight episodes of two tasks four are easy, two medium and two hard.
    for level, episodes in (("easy", "8"), ("medium", "4"), ("hard", "4")):
        entry = texts["forgetful, explicit", level]
        assert entry[:3] == [episodes, "100.00", "–"]
        own = [
            one for one in records
            if (one.policy, one.setting, one.difficulty) == ("forgetful", "direct", level)
        ]  # fmt: skip
        rate = 100 * sum(one.outcome == "success" for one in own) / len(own)
        assert texts["forgetful, direct", level][:2] == [episodes, f"{rate:.2f}"]
        gap = f"{rate - 100:+.1f}".replace("-", "−").replace("+0.0", "±0.0")
        assert texts["forgetful, direct", level][2] == gap
    assert "forgetful, explicit" not in call("tables", run, "--by", "slots", "--format", "csv")
