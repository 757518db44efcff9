"""What the page holds, read from its text; what it does is in test_page.py."""

from __future__ import annotations

import functools
import json
import re
from collections import Counter
from html import unescape
from pathlib import Path
from typing import Any

import pytest
from flat_jobs import with_version
from made_records import make_record
from msgspec.structs import replace
from page_text import render, store

from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.evaluation.analysis.page import report
from roboirg.evaluation.analysis.page.report import make_view, write_report
from roboirg.evaluation.analysis.tables.diagnostic_tables import UNATTRIBUTED
from roboirg.evaluation.plan.plan import Plan
from roboirg.evaluation.plan.sources import Source
from roboirg.evaluation.records.episode_log import EpisodeLog, log_path
from roboirg.evaluation.records.record import (
    Attribution,
    EventRecord,
    MentionSpan,
    Record,
    UtteranceRecord,
)
from roboirg.tasks.splits.splits import get_episode

pytest.importorskip("jinja2")

PLAN = Plan(
    policies=("listener", "forgetful"), tasks=("PickXtimes", "VideoUnmask"), episodes=(0, 1, 2)
)
WRONG = Attribution(
    kind="grounding", failure="wrong_object", subject="cube_blue", step=40, sentence="Wrong cube."
)


class Page:
    """The parts of a page."""

    def __init__(self, text: str) -> None:
        scripts = re.findall(r'<script type="[^"]*" id="([^"]*)">(.*?)</script>', text, re.DOTALL)
        self.scripts = dict(scripts)
        self.data: dict[str, Any] = json.loads(self.scripts["data"])
        self.details = [json.loads(line) for line in self.scripts["details"].splitlines()]
        self.text = unescape(re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL))
        found = re.findall(r'<li class="(\w+)"><b>\w+:</b> (.*)</li>', self.text)
        self.warnings = " ".join(words for kind, words in found if kind == "warning")
        self.notes = " ".join(words for kind, words in found if kind == "note")

    def column(self, name: str) -> list[Any]:
        """The values of a column in words."""
        values = self.data["columns"][name]
        known = {choice["name"]: choice["values"] for choice in self.data["choices"]}
        return [known[name][value] if value >= 0 else None for value in values]

    def string(self, place: int) -> str:
        return str(self.data["strings"][place])

    def cell(self, words: str) -> str:
        """What the cell with such a place says, among everything."""
        cells = self.data["matrix"]["levels"][0]["cells"]
        return next("; ".join(c["note"]) for c in cells if words in c["note"][0])


def records(plan: Plan = PLAN) -> list[Record]:
    found = []
    for index, job in enumerate(plan.jobs()):
        events = (EventRecord(step=40, kind="picked", subject="cube_red"),)
        course: dict[str, Any] = {"outcome": "success", "steps": 80, "events": events}
        if index % 3 == 1:
            course |= {"outcome": "failure", "cause": "picked the wrong cube", "steps": 50}
        if index % 7 == 6:
            cause = "policy: ValueError: </script><b>&"
            course = {"error": "policy", "cause": cause, "details": "T <x>"}
        record = make_record(job, **course, started_at="2026-01-02T03:04:05+00:00")
        is_clear = record.outcome == "failure" and index % 2
        found.append(replace(record, attribution=WRONG if is_clear else None))
    return found


def one_record(**fields: Any) -> Record:
    (job,) = Plan(policies=("listener",), tasks=("PickXtimes",), episodes=(0,), **fields).jobs()
    return make_record(job, "success", steps=80)


@functools.cache
def usual() -> str:
    """The page about all of it; it takes a second or two."""
    return render(records(), PLAN)


def film(folder: Path, name: str = "x") -> str:
    """Write a video into a run, and return its path there."""
    (folder / "videos").mkdir(parents=True, exist_ok=True)
    for suffix in ("mp4", "jpg"):
        (folder / "videos" / f"{name}.{suffix}").write_bytes(b"film")
    return f"videos/{name}.mp4"


def test_every_episode_is_there_in_order_and_nothing_comes_from_outside() -> None:
    page = Page(text := usual())
    assert len(page.details) == len(PLAN.jobs()) == len(set(page.data["columns"]["key"]))
    assert Counter(page.column("outcome")) == Counter(record.outcome for record in records())
    assert {*page.column("failure")} == {None, "wrong_object", UNATTRIBUTED, "policy"}
    (choice,) = [one for one in page.data["choices"] if one["name"] == "failure"]
    assert choice["groups"] == ["grounding", UNATTRIBUTED, "error"]
    policies = [f"{one.name} (privileged)" for one in PLAN.policies]
    assert list(dict.fromkeys(page.column("policy"))) == policies == page.data["matrix"]["policies"]
    assert page.column("setting")[:2] == ["explicit", "direct"]
    links = re.findall(r'(?:src|href|poster)="([^"]*)"', text)
    assert links
    assert all(link.startswith(("#", "data:")) for link in links)
    assert not re.search(r"https?:|@import|url\(", text)
    assert "default-src 'none'" in text
    # No words can end the script.
    assert "</script><b>" not in text
    assert {"policy: ValueError: </script><b>&", "T <x>"} <= set(page.data["strings"])
    # Nor does the order of the file matter.
    assert render(records()[::-1], PLAN) == text


def test_mentions_explicit_and_resolved_form_are_there() -> None:
    plan = Plan(
        policies=("listener",), tasks=("PickXtimes",), episodes=(0,), forms=("implicit", "resolved")
    )
    found = records(plan)
    resolved = {one.setting: " ".join(turn.text for turn in one.instruction)
                for one in found if one.form == "resolved"}  # fmt: skip
    # The resolved form is said again where it was not played.
    for played in (found, [one for one in found if one.form == "implicit"]):
        page = Page(render(played))
        for record in played:
            row = page.data["columns"]["key"].index(record.slug.rpartition("-")[2])
            details = page.details[row]
            mentions = [(at, start, end) for at, start, end, *_ in details.get("mentions", [])]
            assert mentions == [(one.utterance, one.start, one.end) for one in record.mentions]
            for (_, words), turn in zip(details["turns"], record.instruction, strict=True):
                assert page.string(words) == turn.text
            assert ("command" in details) == (record.setting != "explicit")
            is_implicit = record.setting != "explicit" and record.form == "implicit"
            assert ("resolved" in details) == is_implicit
            if is_implicit:
                assert page.string(details["resolved"]) == resolved[record.setting]
    # Another version of the language may have other words.
    other = replace(one_record(settings=("direct",)), language_version="0.1")
    assert "resolved" not in Page(render([other])).details[0]


def test_stages_are_found_again_from_the_events() -> None:
    success = one_record(settings=("explicit",))
    picked = EventRecord(step=30, kind="picked", subject=f"cube_{success.goal['color']}")
    events = (EventRecord(step=-1, kind="still", subject="robot"), picked)
    record = replace(success, outcome="failure", cause="x", steps=50, events=events)
    (details,) = Page(text := render([record])).details
    steps = [step for _, step in details["stages"]]
    assert steps[0] == 30
    assert set(steps[1:]) == {None}
    assert "{at}" not in text
    (other,) = Page(render([replace(record, environment_version=9)])).details
    assert "stages" not in other


def test_events_are_acts_and_objects_have_words() -> None:
    scene = get_episode("PickXtimes", "test", 0).scene
    cube = next(one for one in scene.objects if one.kind == "cube")
    record = replace(records()[0], events=tuple(
                EventRecord(step=step, kind=kind, subject=cube.name, place=place, holds=holds)
                for step, kind, place, holds in (
                    (1, "picked", None, True), (2, "picked", None, False),
                    (3, "placed", "target", True), (4, "placed", "target", False),
                )
            ))  # fmt: skip
    page = Page(render([record]))
    assert [page.string(place) for _, place, _ in page.details[0]["events"]] == [
        f"picked up the {cube.color} cube", f"lowered the {cube.color} cube or let it go",
        f"placed the {cube.color} cube on the target", f"took the {cube.color} cube off the target",
    ]  # fmt: skip


def test_an_unknown_task_is_shown_too() -> None:
    turn = UtteranceRecord(stage="command", text="Do it.")
    mention = MentionSpan(
        utterance=0, start=3, end=5, role="anaphor", expression="it", slot="x", value=1
    )
    odd = replace(records()[1], task="Homemade", instruction=(turn,), mentions=(mention,))
    page = Page(render([odd]))
    assert page.column("task") == ["Homemade"]
    assert "stages" not in page.details[0]
    assert page.string(page.details[0]["events"][0][1]) == "picked up cube red"


def test_what_is_amiss_is_said_first() -> None:
    found = records()[:-5]
    page = Page(render(found, PLAN))
    errors = sum(record.outcome == "error" for record in found)
    assert f"Incomplete: 5 of {len(PLAN.jobs())} planned" in page.warnings
    amiss = f"{errors} of {len(found)} episodes ended in an error ({errors} policy)"
    assert amiss in page.warnings
    assert "still to be played" in page.cell("forgetful (privileged), all tasks, contextual")
    cells = page.data["matrix"]["levels"][0]["cells"]
    assert sum(cell.get("missing", 0) for cell in cells if cell["at"][1] > 0) == 5
    flawless = [one for one in found if one.outcome != "error"]
    assert Page(render(flawless)).warnings == Page(usual()).notes == ""
    alone = Page(render([one for one in flawless if one.policy == "listener"]))
    assert "Only one policy" in alone.notes


def test_versions_and_words_that_differ_stand_apart_and_are_named() -> None:
    first, second = records()[:2]
    page = Page(render([first, replace(second, language_version="9.9")]))
    assert "Mixed versions of the language" in page.warnings
    assert len(page.data["matrix"]["policies"]) == 2
    again = Page(render([first, with_version(replace(first, episode=9), "2")]))
    assert ": 2, built-in. They are kept apart" in again.warnings

    found = one_record(settings=("direct",))
    page = Page(render([found, found.with_options(wordings="mine@1a")]))
    assert "Mixed words: our own words, the words of mine@1a." in page.warnings
    assert "our own words, the words of mine@1a" in page.text.split("Mixed words")[0]
    assert page.data["matrix"]["policies"] == [
        "listener, the words of mine@1a (privileged)",
        "listener, our own words (privileged)",
    ]
    theirs, ours = page.details
    assert "resolved" in ours
    assert "resolved" not in theirs  # it can be derived in our own words only
    assert "in the words of mine@1a" in page.string(theirs["conditions"])


def test_cells_say_how_sure_they_are_and_each_difficulty_has_its_own() -> None:
    page = Page(usual())
    levels = {level["difficulty"]: level["cells"] for level in page.data["matrix"]["levels"]}
    assert list(levels)[:2] == ["", "easy"]
    assert all(levels.values())
    note = page.cell("listener (privileged), PickXtimes, direct")
    assert re.search(r"\d+ % success: \d of \d trials, \d episodes", note)
    assert "95 % interval" in note
    assert "points to explicit on the same" in note
    lost = [make_record(job, "failure", "it fell") for job in PLAN.jobs()]
    note = Page(render(lost)).cell("listener (privileged), PickXtimes, direct")
    assert "no success either, so the gap says nothing" in note


def test_videos_are_in_the_page_or_next_to_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second, *_ = records()
    filmed = replace(first, video=film(tmp_path, "a-b"))
    lost = replace(second, video="videos/gone.mp4", video_error="no room")
    run = store(tmp_path, [filmed, lost])

    page = Page(write_report(run).read_text())
    key = filmed.slug.rpartition("-")[2]
    assert page.scripts[f"film-{key}"] == "data:video/mp4;base64,ZmlsbQ=="
    assert page.scripts[f"poster-{key}"] == "data:image/jpeg;base64,ZmlsbQ=="
    assert [details.get("film") for details in page.details] == ["#", None]
    assert page.string(page.details[1]["lost"]) == "no room"
    assert "plays them from the folder" not in page.text
    without = Page(write_report(run, videos=False).read_text())
    assert not [name for name in without.scripts if name.startswith("film")]

    monkeypatch.setattr(report, "MAX_EMBEDDED_BYTES", 7)
    elsewhere = tmp_path / "pages" / "a.html"
    for text, before in (
        (make_view(run), ""),
        (write_report(run, out=elsewhere).read_text(), "../"),
    ):
        page = Page(text)
        assert page.details[0]["film"] == f"{before}videos/a-b.mp4"
        assert page.details[0]["poster"] == f"{before}videos/a-b.jpg"
        assert "plays them from the folder" in page.text
    # The files of a pack are gone when it is closed.
    page = Page(write_report(Source(tmp_path / "a.roboirg.zip", tmp_path)).read_text())
    assert "film" not in page.details[0]
    assert "plays them from the folder" not in page.text


def test_two_runs_are_held_against_each_other(tmp_path: Path) -> None:
    theirs = tmp_path / "our theirs"
    found = records()
    runs = (
        store(tmp_path / "ours", found, PLAN),
        store(theirs, [replace(found[0], video=film(theirs)), *found[1:-4]], PLAN),
    )
    with EpisodeLog(log_path(theirs, found[0].slug)) as log:
        log.append(b"words")
    page = Page(write_report(runs[0], against=runs[1]).read_text())
    assert page.data["matrix"]["policies"] == [
        "listener, ours (privileged)", "forgetful, ours (privileged)",
        "listener, our theirs (privileged)", "forgetful, our theirs (privileged)",
    ]  # fmt: skip
    assert page.data["sides"] == [0, 2]
    keys = page.data["columns"]["key"]
    assert len(set(keys)) == len(keys) == 2 * len(found) - 4
    # Videos and logs of the other run carry a key of their own, and are found from the page.
    key = f"{found[0].slug.rpartition('-')[2]}-2"
    assert page.scripts[f"film-{key}"].startswith("data:video")
    (link,) = [details["log"] for details in page.details if "log" in details]
    assert link == f"../our%20theirs/{log_path(Path(), found[0].slug)}"
    assert page.details[keys.index(key)]["log"] == link
    pairs = page.data["columns"]["pair"]
    # Both policies of both runs, but for the last four.
    assert sorted(map(pairs.count, set(pairs))) == [3] * 4 + [4] * (len(found) // 2 - 4)
    assert "Incomplete: 4 of" in page.warnings
    words = next(one for one in page.data["comparisons"] if (one["left"], one["right"]) == (0, 2))
    assert "listener, ours (privileged) against listener, our theirs" in words["sentences"][0]


def test_what_cannot_be_compared_says_why() -> None:
    first, second = records()[:2]
    page = Page(render([first, replace(second, language_version="9")]))
    (found,) = page.data["comparisons"]
    assert "cannot be compared" in found["sentences"][0]


def test_the_head_says_which_run_it_was(tmp_path: Path) -> None:
    first, second, *_ = records()
    later = replace(second, started_at="2026-01-02T03:09:05+00:00")
    text = write_report(store(tmp_path / "tuesday", [first, later])).read_text()
    facts = dict(re.findall("<dt>(.*?)</dt><dd>(.*?)</dd>", text))
    assert "<title>tuesday – RoboIRGBench</title>" in text
    assert (
        facts.items()
        >= {
            "run": "tuesday",
            "played": "2026-01-02 03:04 to 03:09 UTC",
            "step limit": "1300",
            "environment": str(ENVIRONMENT_VERSION),
        }.items()
    )
