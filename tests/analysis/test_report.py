"""What the page holds beyond what a browser shows of a usual run, which is in test_page.py."""

from __future__ import annotations

import json
import os
import re
from collections import Counter
from html import unescape
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace
from page_text import PLAN, broken, played, render, store

from roboirg.analysis.page import report
from roboirg.analysis.page.details import EpisodeDetails
from roboirg.analysis.page.report import write_report
from roboirg.analysis.results.sources import Source
from roboirg.policies.prompt_length.prompt_audit import PromptLimit, most_tokens
from roboirg.records.episode_log import EpisodeLog, log_path
from roboirg.records.record import (
    EventRecord,
    MentionSpan,
    Record,
    SubgoalRecord,
    UtteranceRecord,
)
from roboirg.runs.job_instruction import PreparedJob
from roboirg.runs.play.episode_record import audit_record

pytest.importorskip("jinja2")

PLAN_OF_ONE_TASK = PLAN.model_copy(update={"tasks": ("PickXtimes",), "forms": ("implicit",)})


class Page:
    """The parts of a page."""

    def __init__(self, text: str) -> None:
        scripts = re.findall(r'<script type="[^"]*" id="([^"]*)">(.*?)</script>', text, re.DOTALL)
        self.scripts = dict(scripts)
        self.data: dict[str, Any] = json.loads(self.scripts["data"])
        self.details = [json.loads(line) for line in self.scripts["details"].splitlines()]
        self.text = unescape(re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL))
        self.notes = " ".join(re.findall(r'<li class="\w+"><b>\w+:</b> .*</li>', self.text))

    def string(self, place: int) -> str:
        return str(self.data["strings"][place])


def records_with_an_error_last() -> list[Record]:
    """The last is an error."""
    *found, last = played(PLAN_OF_ONE_TASK)
    return [*found, broken(last)]


def written_film(folder: Path, name: str = "x") -> str:
    """Write a video into a run, and return its path there."""
    (folder / "videos").mkdir(parents=True, exist_ok=True)
    for suffix in ("mp4", "jpg"):
        (folder / "videos" / f"{name}.{suffix}").write_bytes(b"film")
    return f"videos/{name}.mp4"


def test_the_page_loads_nothing_from_elsewhere_and_text_of_records_cannot_end_its_script():
    """The cause of the last record has "</script>" in it; would find a page open to an attack."""
    text = render(records_with_an_error_last(), PLAN_OF_ONE_TASK)
    assert not re.search(r"https?:|@import|url\(", text)
    assert "default-src 'none'" in text
    assert "</script><b>" not in text
    assert broken(records_with_an_error_last()[0]).cause in Page(text).data["strings"]
    # Nor does the order of the file matter.
    assert render(records_with_an_error_last()[::-1], PLAN_OF_ONE_TASK) == text


def test_an_episode_shows_its_instruction_with_references_spelled_out():
    """This *resolved* form is made anew if it was not played; mentions are marked where they stand.

    Would find the words of another goal of the same scene.
    """
    plan = PLAN_OF_ONE_TASK.model_copy(update={"forms": PLAN.forms, "arms": ("told", "other-goal")})
    found = [record for record in played(plan) if record.setting != "explicit"]
    implicit = [record for record in found if record.form == "implicit"]
    resolved = [record for record in found if record.form == "resolved"]
    texts = [" ".join(turn.text for turn in record.instruction) for record in resolved]

    page = Page(render(implicit))

    assert sorted(page.string(detail["resolved"]) for detail in page.details) == sorted(texts)
    details = dict(zip(page.data["columns"]["key"], page.details, strict=True))
    for record in implicit:
        detail = details[record.slug.rpartition("-")[2]]
        shown = [mention[:3] for mention in detail["mentions"]]
        spans = [[mention.utterance, mention.start, mention.end] for mention in record.mentions]
        assert shown == spans


def test_records_of_other_versions_or_unknown_tasks_are_shown_without_what_cannot_be_derived():
    """Another version of the language may have other words, of the environment other stages."""
    usual = next(record for record in records_with_an_error_last() if record.setting == "direct")
    turn = UtteranceRecord(stage="command", text="Do it.")
    mention = MentionSpan(
        utterance=0, start=3, end=5, role="anaphor", expression="it", slot="x", value=1
    )

    unknown = replace(usual, task="Homemade", instruction=(turn,), mentions=(mention,))

    for record, missing in (
        (usual, set()),
        (replace(usual, language_version="0.1"), {"resolved"}),
        (replace(usual, environment_version=9), {"resolved", "stages"}),
        (unknown, {"resolved", "stages"}),
    ):
        page = Page(render([record]))
        assert {"resolved", "stages"} - page.details[0].keys() == missing
    assert page.string(page.details[0]["events"][-1][1]) == "took cube green off target"


def test_events_tell_equal_cubes_apart_by_number_and_leave_out_what_ends_by_itself():
    """A cube is picked up; that it is then no longer *over the bin* is no event of its own."""
    first, *_ = played(PLAN_OF_ONE_TASK.model_copy(update={"tasks": ("BinFill",)}))
    event = EventRecord(step=1, kind="picked", subject="cube_red_1")
    over = replace(event, kind="over", place="bin", holds=False)
    page = Page(render([replace(first, events=(event, over))]))

    acts = [page.string(act) for _, act, _ in page.details[0]["events"]]

    assert acts == ["picked up the red cube (1)"]


def test_missing_episodes_errors_and_a_single_policy_are_named_at_the_top_of_the_page():
    found = records_with_an_error_last()
    page = Page(render([*found[:-6], found[-1]], PLAN_OF_ONE_TASK))
    assert f"Incomplete: 5 of {len(found)} planned" in page.notes
    assert f"1 of {len(found) - 5} episodes ended in an error (1 policy)" in page.notes

    cells = page.data["matrix"]["levels"][0]["cells"]
    assert sum(cell.get("missing", 0) for cell in cells) == 5
    assert Page(render(found[:-1])).notes == ""

    lost = [replace(record, outcome="failure") for record in found if record.policy == "listener"]
    assert "Only one policy" in Page(render(lost)).notes


def what_a_reader_sees(page: Page) -> str:
    """The notes of all cells; what can be chosen, of each episode; and the details of each."""
    lines: list[str] = []
    for level in page.data["matrix"]["levels"]:
        for cell in level["cells"]:
            lines += cell["note"]
    for choice in page.data["choices"]:
        values = [*choice["values"], "none"]  # whose place is -1
        chosen = [values[place] for place in page.data["columns"][choice["name"]]]
        lines.append(f"{choice['label']}: {chosen}")
    for details in page.details:
        lines += [f"{name}: {details[name]}" for name in details]
    return "\n".join([*lines, page.notes])


def test_cells_choices_and_details_are_as_stored(snapshot, monkeypatch):
    """Of three scenes with other cubes, seeds and outcomes, with everything a record may hold."""
    monkeypatch.setattr(EpisodeDetails, "_index", lambda _, text: text)  # texts, not their numbers
    settings = ("explicit", "contextual")
    own = [
        record
        for record in records_with_an_error_last()
        if record.policy == "listener" and record.setting in settings
    ]
    *others, cut = sorted(own, key=lambda record: (record.episode, record.setting == "contextual"))
    audit_record(cut, PreparedJob(cut.identity), PromptLimit(24, 0, most_tokens, "some.model"))
    said = [
        SubgoalRecord(step=0, text="pick it up", due="pick it up", verdict="right", ended="done"),
        SubgoalRecord(step=8, text="dance", due="put it down", verdict="lost", ended="refused",
                      why="it fits nothing"),
        SubgoalRecord(step=9, text="sing", verdict="wrong_count", ended="failed"),
    ]  # fmt: skip
    cut = replace(cut, subgoals=tuple(said), started_at="2026-01-02T05:06:07", video_error="full")
    lost = {("contextual", 0), ("explicit", 1), ("contextual", 2)}
    found = [
        replace(record, policy_seed=8 + record.episode, server_version="9",
                outcome="failure" if (record.setting, record.episode) in lost else "success")
        for record in (*others, cut)
    ]  # fmt: skip
    page = Page(render(found))

    assert "2026-01-02 03:04 to 05:06 UTC" in page.text

    shown = what_a_reader_sees(page)
    assert re.sub(r"language \S+, environment \d+", "", shown) == snapshot


@pytest.mark.parametrize(
    ("understood", "goal"),
    [
        ({"color": "red", "repeats": 1}, "red, once"),
        ({"color": "green", "repeats": 3}, "green, 3 times"),
        ({"colors": ["red", "blue"], "counts": [2, 1]}, "2 red, 1 blue"),
        ({"color": "red", "relation": "before"}, "red, on the target before the press"),
        ({"color": "red", "placement": 2}, "red, on target 2 of the video"),
        ({"visit": 3}, "on visit 3"),
        (None, None),
    ],
)
def test_a_failed_episode_shows_the_goal_that_the_policy_understood_next_to_the_true_one(
    understood, goal
):
    """Of a planner, the last subgoal up to the failure; of an episode that succeeded, nothing."""
    first = next(record for record in records_with_an_error_last() if record.attribution)
    said = tuple(
        SubgoalRecord(step=step, text=text, due="pick it up", verdict="lost")
        for step, text in ((51, "sing"), (60, "dance"), (61, "rest"))  # it failed at step 60
    )
    for fields, expected in (
        ({"policy_metadata": {"understood": understood}}, goal),
        ({"subgoals": said}, "“dance”; due was “pick it up”"),
        ({"subgoals": said, "outcome": "success"}, None),
    ):
        page = EpisodeDetails(Path(), embeds=False)
        details = page.details_of(replace(first, **fields))
        texts = [*page.strings, None]
        assert texts[details["goal"]] == "green, 3 times"
        assert texts[details.get("named", -1)] == expected


def test_the_same_policy_with_other_words_is_shown_as_another_with_a_warning():
    """ "mine@1a" are words of another file; spelled-out references exist in our own words only."""
    first = next(record for record in records_with_an_error_last() if record.setting == "direct")
    page = Page(render([first, first.with_options(wordings="mine@1a")]))
    assert "Mixed words: our own words, the words of mine@1a." in page.notes
    assert page.data["matrix"]["policies"] == [
        "listener, the words of mine@1a (privileged)",
        "listener, our own words (privileged)",
    ]

    theirs, ours = page.details
    assert "resolved" in ours
    assert "resolved" not in theirs  # it can be derived in our own words only
    assert "in the words of mine@1a" in page.string(theirs["conditions"])


def test_two_policies_are_paired_on_a_scene_only_with_equal_words_seed_and_split():
    """Two results agree in all, four differ in seed, arm, form or split: one pair, four alone."""
    first, theirs = (
        record
        for record in records_with_an_error_last()
        if (record.setting, record.episode) == ("direct", 0)
    )
    others = [
        replace(first, policy_seed=1), replace(first, arm="silent"),
        first.with_options(form="resolved"), replace(first, split="val", difficulty="odd"),
    ]  # fmt: skip
    page = Page(render([first, theirs, *others]))
    pairs, scenes = (Counter(page.data["columns"][name]) for name in ("pair", "scene"))

    assert sorted(pairs.values()) == [1, 1, 1, 1, 2]
    assert sorted(scenes.values()) == [1, 5]

    choices = {choice["name"]: choice["values"] for choice in page.data["choices"]}
    assert choices["difficulty"] == [first.difficulty, "odd"]
    assert len(page.data["comparisons"]) == 3, "of the three policy runs that were told"


def test_small_videos_are_stored_in_the_page_and_large_ones_are_linked(tmp_path, monkeypatch):
    """The film has 4 bytes, its picture 4: 8 fit, 7 do not. A lost film has its reason."""
    first, second, *_ = records_with_an_error_last()
    filmed = replace(first, video=written_film(tmp_path, "a-b"))
    lost = replace(second, video="videos/gone.mp4", video_error="no room")
    run = store(tmp_path, [filmed, lost])
    monkeypatch.setattr(report, "MAX_EMBEDDED_BYTES", 8)

    page = Page(write_report(run).read_text())
    key = filmed.slug.rpartition("-")[2]
    assert page.scripts[f"film-{key}"] == "data:video/mp4;base64,ZmlsbQ=="
    assert page.scripts[f"poster-{key}"] == "data:image/jpeg;base64,ZmlsbQ=="
    assert [details.get("film") for details in page.details] == ["#", None]
    assert page.string(page.details[1]["lost"]) == "no room"
    without = write_report(run, videos=False).read_text()
    assert not [name for name in Page(without).scripts if name.startswith("film")]

    monkeypatch.setattr(report, "MAX_EMBEDDED_BYTES", 7)
    elsewhere = tmp_path / "pages" / "a.html"
    for text, before in (
        (write_report(run, served=True).read_text(), ""),
        (write_report(run, out=elsewhere).read_text(), "../"),
    ):
        page = Page(text)
        assert page.details[0]["film"] == f"{before}videos/a-b.mp4"
        assert page.details[0]["poster"] == f"{before}videos/a-b.jpg"
        assert "plays them from the folder" in page.text
    # The files of a pack are gone when it is closed.
    packed = Page(write_report(Source(tmp_path / "a.roboirg.zip", tmp_path)).read_text())
    assert "film" not in packed.details[0]
    assert "plays them from the folder" not in packed.text


def test_a_page_of_two_runs_compares_their_policies_and_finds_the_videos_of_both(tmp_path):
    theirs = tmp_path / "our theirs"
    found = records_with_an_error_last()
    runs = (
        store(tmp_path / "ours", found, PLAN_OF_ONE_TASK),
        store(
            theirs,
            [replace(found[0], video=written_film(theirs), code="0"), *found[1:-4]],
            PLAN_OF_ONE_TASK,
        ),
    )
    with EpisodeLog(log_path(theirs, found[0].slug)) as log:
        os.write(log.descriptor, b"words")
    text = write_report(runs[0], against=runs[1]).read_text()
    page = Page(text)

    assert page.data["matrix"]["policies"] == [
        "listener, ours (privileged)", "forgetful, ours (privileged)",
        "listener, our theirs (privileged)", "forgetful, our theirs (privileged)",
    ]  # fmt: skip
    assert page.data["sides"] == [0, 2]

    # Videos and logs of the other run carry a key of their own, and are found from the page.
    key = f"{found[0].slug.rpartition('-')[2]}-2"
    assert page.scripts[f"film-{key}"].startswith("data:video")

    (link,) = [details["log"] for details in page.details if "log" in details]
    assert link == f"../our%20theirs/{log_path(Path(), found[0].slug)}"
    assert "Incomplete: 4 of" in page.notes
    # Other code that decides verdicts in the same way is a fact.
    assert f"<dd>0, {found[0].code}</dd>" in text
    assert "Mixed" not in page.notes

    words = next(
        comparison
        for comparison in page.data["comparisons"]
        if (comparison["left"], comparison["right"]) == (0, 2)
    )
    assert "listener, ours (privileged) against listener, our theirs" in words["sentences"][0]
