"""What the page holds, read from its text; what it does is in test_page.py."""

from __future__ import annotations

import functools
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
import typer
from flat_jobs import with_version
from made_records import make_record
from msgspec.structs import replace
from page_text import render
from typer.testing import CliRunner

from roboirg.cli.report_commands import report
from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.evaluation.analysis.page import episode_videos
from roboirg.evaluation.analysis.page.columns import UNATTRIBUTED
from roboirg.evaluation.analysis.page.entries import Run
from roboirg.evaluation.analysis.page.report import make_view, render_runs, write_report
from roboirg.evaluation.plan.plan import Plan
from roboirg.evaluation.plan.sources import Source
from roboirg.evaluation.plan.stored_plans import write_plan
from roboirg.evaluation.records.episode_log import EpisodeLog, log_path
from roboirg.evaluation.records.record import (
    Attribution,
    EventRecord,
    MentionSpan,
    Record,
    UtteranceRecord,
)
from roboirg.evaluation.records.record_codec import StoreError
from roboirg.evaluation.records.store import RecordStore
from roboirg.policies.by_name.finding import read_policy
from roboirg.tasks.splits.splits import get_episode

pytest.importorskip("jinja2")

PLAN = Plan(
    policies=("listener", "forgetful"), tasks=("PickXtimes", "VideoUnmask"), episodes=(0, 1, 2)
)
VOID = {"meta", "link", "input", "br", "wbr"}
WRONG = Attribution(
    kind="grounding", failure="wrong_object", subject="cube_blue", step=40, sentence="Wrong cube."
)


class Page(HTMLParser):
    """Takes the page apart and checks that tags are closed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: dict[str, str] = {}
        self.warnings: list[tuple[str, str]] = []
        self.links: list[str] = []
        self.text = ""
        self.feed(text)
        assert self.open == []
        self.data: dict[str, Any] = json.loads(self.scripts["data"])
        self.details = [json.loads(line) for line in self.scripts["details"].splitlines()]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        fields = dict(attrs)
        if tag not in VOID:
            self.open.append((tag, fields))
        if tag == "li" and fields.get("class") in ("warning", "note"):
            self.warnings.append((str(fields["class"]), ""))
        self.links += [str(fields[name]) for name in ("src", "href", "poster") if name in fields]

    def handle_endtag(self, tag: str) -> None:
        # `li` and the like are written with their end tags too.
        assert self.open.pop()[0] == tag

    def handle_data(self, data: str) -> None:
        tag, fields = self.open[-1] if self.open else ("", {})
        if tag == "script":
            self.scripts[str(fields.get("id"))] = self.scripts.get(str(fields.get("id")), "") + data
        elif tag != "style":
            self.text += data
            if any(name == "li" and own.get("class") for name, own in self.open) and self.warnings:
                kind, words = self.warnings[-1]
                self.warnings[-1] = (kind, words + data)

    def column(self, name: str) -> list[Any]:
        """The values of a column in words."""
        values = self.data["columns"][name]
        known = {choice["name"]: choice["values"] for choice in self.data["choices"]}
        return [known[name][value] if value >= 0 else None for value in values]

    def string(self, place: int) -> str:
        return str(self.data["strings"][place])

    def notes(self, *words: str) -> list[str]:
        """What cells say whose place contains all words, among everything."""
        cells = self.data["matrix"]["levels"][0]["cells"]
        return ["; ".join(c["note"]) for c in cells if all(w in c["note"][0] for w in words)]


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
        if record.outcome == "failure" and index % 2:
            record = replace(record, attribution=WRONG)
        elif record.outcome == "failure":
            record = replace(record, attribution=None)
        found.append(record)
    return found


@functools.cache
def usual() -> str:
    """The page about all of it; it takes a second or two."""
    return render(records(), planned=PLAN.jobs())


def store(folder: Path, found: list[Record]) -> Path:
    with RecordStore(folder) as file:
        for record in found:
            file.append(record)
    return folder


def test_every_episode_is_there_and_nothing_comes_from_outside() -> None:
    text = usual()
    page = Page(text)
    assert len(page.details) == len(PLAN.jobs()) == len(set(page.data["columns"]["key"]))
    for outcome in ("success", "failure", "error"):
        expected = sum(record.outcome == outcome for record in records())
        assert page.column("outcome").count(outcome) == expected
    assert all(link.startswith(("#", "data:")) for link in page.links)
    assert not re.search(r"https?:|@import|url\(", text)
    assert "default-src 'none'" in text


def test_columns_have_the_order_of_the_overview_and_do_not_depend_on_the_file() -> None:
    page = Page(render(records()[::-1], planned=PLAN.jobs()))
    policies = [f"{one.name} (privileged)" for one in PLAN.policies]
    assert list(dict.fromkeys(page.column("policy"))) == policies == page.data["matrix"]["policies"]
    assert page.column("setting")[:2] == ["explicit", "direct"]
    assert render(records()[::-1], planned=PLAN.jobs()) == usual()


def test_failures_are_told_apart_by_kind() -> None:
    page = Page(usual())
    found = {
        (outcome, failure)
        for outcome, failure in zip(page.column("outcome"), page.column("failure"), strict=True)
    }
    assert found == {
        ("success", None),
        ("failure", "wrong_object"),
        ("failure", UNATTRIBUTED),
        ("error", "policy"),
    }
    (choice,) = [one for one in page.data["choices"] if one["name"] == "failure"]
    assert dict(zip(choice["values"], choice["groups"], strict=True)) == {
        "wrong_object": "grounding", UNATTRIBUTED: UNATTRIBUTED, "policy": "error",
    }  # fmt: skip
    # Names of all groups differ, since an episode's failure is the index of one.
    assert len(set(choice["values"])) == len(choice["values"])


def test_words_cannot_end_the_script() -> None:
    text = usual()
    assert "</script><b>" not in text
    page = Page(text)
    assert "policy: ValueError: </script><b>&" in page.data["strings"]
    assert "T <x>" in page.data["strings"]


def test_mentions_explicit_and_resolved_form_are_there() -> None:
    plan = Plan(
        policies=("listener",), tasks=("PickXtimes",), episodes=(0,), forms=("implicit", "resolved")
    )
    found = records(plan)
    page = Page(render(found))
    for record in found:
        row = page.data["columns"]["key"].index(record.slug.rpartition("-")[2])
        details = page.details[row]
        assert len(details.get("mentions", [])) == len(record.mentions)
        for (at, start, end, *_), mention in zip(
            details.get("mentions", []), record.mentions, strict=True
        ):
            text = page.string(details["turns"][at][1])
            assert text[start:end] == record.instruction[mention.utterance].text[start:end]
        assert ("command" in details) == (record.setting != "explicit")
        implicit = record.setting != "explicit" and record.form == "implicit"
        assert ("resolved" in details) == implicit
        if implicit:
            twin = next(
                one for one in found if one.setting == record.setting and one.form == "resolved"
            )
            words = " ".join(turn.text for turn in twin.instruction)
            assert page.string(details["resolved"]) == words


def test_the_resolved_form_is_said_again_where_it_was_not_played() -> None:
    plan = Plan(policies=("listener",), tasks=("PickXtimes",), episodes=(0,), settings=("direct",))
    (record,) = records(plan)
    (details,) = Page(page := render([record])).details
    assert "resolved" in details
    resolved = Page(page).string(details["resolved"])
    assert resolved != " ".join(turn.text for turn in record.instruction)
    # Another version of the language may have other words.
    (other,) = Page(render([replace(record, language_version="0.1")])).details
    assert "resolved" not in other


def test_stages_are_found_again_from_the_events() -> None:
    plan = Plan(
        policies=("listener",), tasks=("PickXtimes",), episodes=(0,), settings=("explicit",)
    )
    (job,) = plan.jobs()
    color = make_record(job).goal["color"]
    events = [
        EventRecord(step=-1, kind="still", subject="robot"),
        EventRecord(step=30, kind="picked", subject=f"cube_{color}"),
    ]
    record = make_record(job, "failure", "x", steps=50, events=events)
    (details,) = Page(text := render([record])).details
    steps = [step for _, step in details["stages"]]
    assert steps[0] == 30
    assert set(steps[1:]) == {None}
    assert "{at}" not in text
    (other,) = Page(render([replace(record, environment_version=-1)])).details
    assert "stages" not in other


def test_what_is_amiss_is_said_first() -> None:
    jobs = PLAN.jobs()
    found = records()[:-5]
    page = Page(render(found, planned=jobs))
    warnings = " ".join(words for kind, words in page.warnings if kind == "warning")
    errors = sum(record.outcome == "error" for record in found)
    assert f"Incomplete: 5 of {len(jobs)} planned" in warnings
    assert f"{errors} of {len(found)} episodes ended in an error ({errors} policy)" in warnings
    assert any("still to be played" in note for note in page.notes("all tasks"))
    cells = page.data["matrix"]["levels"][0]["cells"]
    assert sum(cell.get("missing", 0) for cell in cells if cell["at"][1] > 0) == 5
    assert Page(render([one for one in found if one.outcome != "error"])).warnings == []


def test_versions_that_differ_stand_apart() -> None:
    one, other = records()[0], records()[1]
    mixed = [one, replace(other, language_version="9.9")]
    page = Page(render(mixed))
    assert any("Mixed versions of the language" in words for _, words in page.warnings)
    assert len(page.data["matrix"]["policies"]) == 2
    again = [one, with_version(replace(one, episode=9), "2")]
    assert any(
        "several versions: 2, built-in" in words for _, words in Page(render(again)).warnings
    )


def test_words_that_differ_stand_apart_and_are_named() -> None:
    found = next(one for one in records() if one.setting == "direct" and one.form == "implicit")
    other = found.with_options(wordings="mine@1a")
    page = Page(render([found, other]))
    warnings = " ".join(words for _, words in page.warnings)
    assert "Mixed words: our own words, the words of mine@1a." in warnings
    assert "our own words, the words of mine@1a" in page.text.split("Mixed words")[0]
    names = page.data["matrix"]["policies"]
    assert [name.removesuffix(" (privileged)") for name in names] == [
        f"{found.policy}, the words of mine@1a",
        f"{found.policy}, our own words",
    ]
    theirs, ours = page.details
    assert "resolved" in ours
    assert "resolved" not in theirs  # it can be derived in our own words only
    assert "in our own words" in page.string(ours["conditions"])
    assert "in the words of mine@1a" in page.string(theirs["conditions"])


def test_one_policy_alone_is_said_to_be_alone() -> None:
    one = [record for record in records() if record.policy == "listener"]
    assert [kind for kind, words in Page(render(one)).warnings if "Only one policy" in words]
    assert not [words for _, words in Page(usual()).warnings if "Only one" in words]


def test_cells_say_how_sure_they_are_and_each_difficulty_has_its_own() -> None:
    page = Page(usual())
    levels = {level["difficulty"]: level["cells"] for level in page.data["matrix"]["levels"]}
    assert list(levels)[:2] == ["", "easy"]
    assert all(levels.values())
    (note,) = page.notes("listener (privileged), PickXtimes, direct")
    assert re.search(r"\d+ % success: \d of \d trials, \d episodes", note)
    assert "95 % interval" in note
    assert "points to explicit on the same" in note
    lost = [
        make_record(job, "failure", "it fell")
        for job in PLAN.jobs()
        if job.setting in {"explicit", "direct"}
    ]
    (note,) = Page(render(lost)).notes("listener (privileged), PickXtimes, direct")
    assert "no success either, so the gap says nothing" in note


def test_films_are_inside_or_beside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "videos").mkdir()
    (tmp_path / "videos" / "a-b.mp4").write_bytes(b"film")
    (tmp_path / "videos" / "a-b.jpg").write_bytes(b"poster")
    first, second, *_ = records()
    filmed = replace(first, video="videos/a-b.mp4")
    lost = replace(second, video="videos/gone.mp4", video_error="no room")

    page = Page(render([filmed, lost], tmp_path))
    key = filmed.slug.rpartition("-")[2]
    assert page.scripts[f"film-{key}"] == "data:video/mp4;base64,ZmlsbQ=="
    assert page.scripts[f"poster-{key}"] == "data:image/jpeg;base64,cG9zdGVy"
    assert [details.get("film") for details in page.details] == ["#", None]
    assert page.string(page.details[1]["lost"]) == "no room"
    assert "plays them from the folder" not in page.text
    assert not [name for name in Page(render([filmed])).scripts if name.startswith("film")]

    monkeypatch.setattr(episode_videos, "MAX_EMBEDDED_BYTES", 3)
    page = Page(render([filmed, lost], tmp_path))
    assert page.details[0]["film"] == "videos/a-b.mp4"
    assert page.details[0]["poster"] == "videos/a-b.jpg"
    assert "plays them from the folder" in page.text


def test_what_was_printed_is_linked_to(tmp_path: Path) -> None:
    loud, silent = records()[:2]
    folder = store(tmp_path / "a run", [loud, silent])
    with EpisodeLog(log_path(folder, loud.slug)) as log:
        log.append(b"words")
    link = log_path(Path(), loud.slug).as_posix()
    assert [one.get("log") for one in Page(write_report(Source(folder)).read_text()).details] == [
        link,
        None,
    ]
    other = store(tmp_path / "other", [loud])
    page = Page(write_report(Source(other), against=Source(folder), videos=False).read_text())
    assert [one.get("log") for one in page.details] == [None, f"../a%20run/{link}", None]


def test_the_served_page_never_holds_films(tmp_path: Path) -> None:
    (tmp_path / "videos").mkdir()
    (tmp_path / "videos" / "x.mp4").write_bytes(b"film")
    store(tmp_path, [replace(records()[0], video="videos/x.mp4")])
    (details,) = Page(make_view(Source(tmp_path))).details
    assert details["film"] == "videos/x.mp4"


def test_two_runs_are_held_against_each_other(tmp_path: Path) -> None:
    ours, theirs = tmp_path / "ours", tmp_path / "theirs"
    (tmp_path / "theirs" / "videos").mkdir(parents=True)
    (theirs / "videos" / "x.mp4").write_bytes(b"film")
    found = records()
    store(ours, found)
    store(theirs, [replace(found[0], video="videos/x.mp4"), *found[1:-4]])
    for folder in (ours, theirs):
        write_plan(PLAN, folder)
    page = Page(write_report(Source(ours), against=Source(theirs)).read_text())
    policies = page.data["matrix"]["policies"]
    assert policies == [
        "listener, ours (privileged)", "forgetful, ours (privileged)",
        "listener, theirs (privileged)", "forgetful, theirs (privileged)",
    ]  # fmt: skip
    assert page.data["sides"] == [0, 2]
    keys = page.data["columns"]["key"]
    assert len(set(keys)) == len(keys) == 2 * len(found) - 4
    # The films of the other run carry a key of their own.
    assert page.scripts[f"film-{found[0].slug.rpartition('-')[2]}-2"].startswith("data:video")
    pairs = page.data["columns"]["pair"]
    # Both policies of both runs, but for the last four.
    assert sorted(map(pairs.count, set(pairs))) == [3] * 4 + [4] * (len(found) // 2 - 4)
    assert any("Incomplete: 4 of" in words for _, words in page.warnings)
    found = next(one for one in page.data["comparisons"] if [one["left"], one["right"]] == [0, 2])
    assert "listener, ours (privileged) against listener, theirs" in found["sentences"][0]


def test_films_of_another_run_are_found_from_the_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(episode_videos, "MAX_EMBEDDED_BYTES", 0)
    (tmp_path / "b" / "videos").mkdir(parents=True)
    (tmp_path / "b" / "videos" / "x.mp4").write_bytes(b"film")
    store(tmp_path / "a", [records()[0]])
    store(tmp_path / "b", [replace(records()[0], video="videos/x.mp4")])
    page = Page(write_report(Source(tmp_path / "a"), against=Source(tmp_path / "b")).read_text())
    assert page.details[1]["film"] == "../b/videos/x.mp4"
    assert (tmp_path / "a" / page.details[1]["film"]).is_file()


def test_the_command_prints_the_table_and_writes_the_page(tmp_path: Path) -> None:
    app = typer.Typer()
    app.command()(report)
    found = [one for one in records() if one.setting in {"explicit", "direct"}]
    for name in ("ours", "theirs"):
        write_plan(PLAN, store(tmp_path / name, found))
    asked = [str(tmp_path / "ours"), "--against", str(tmp_path / "theirs"), "--no-videos"]
    done = CliRunner().invoke(app, asked, catch_exceptions=False)
    assert done.exit_code == 0
    assert "success rate in %" in done.output
    assert done.output.strip().endswith(str(tmp_path / "ours" / "report.html"))
    page = Page((tmp_path / "ours" / "report.html").read_text())
    assert len(page.data["matrix"]["policies"]) == 4
    missing = len(PLAN.jobs()) - len(found)
    assert any(f"Incomplete: {2 * missing} of" in words for _, words in page.warnings)
    with pytest.raises(StoreError, match="There are no records"):
        CliRunner().invoke(app, [*asked[:2], str(tmp_path)], catch_exceptions=False)


def test_what_cannot_be_compared_says_why() -> None:
    (one, *_), (_, other, *_) = records(), records()
    runs = [Run("a", [one]), Run("b", [replace(other, language_version="9")])]
    (found,) = Page(render_runs(runs)).data["comparisons"]
    assert "same version can be compared" in found["sentences"][0]


def test_the_head_says_which_run_it_was(tmp_path: Path) -> None:
    folder = tmp_path / "tuesday"
    first, second, *_ = records()
    store(
        folder,
        [first, replace(second, started_at="2026-01-02T03:09:05+00:00")],
    )
    text = write_report(Source(folder)).read_text()
    assert "<title>tuesday – RoboIRGBench</title>" in text
    assert "<dd>tuesday</dd>" in text
    assert "<dd>2026-01-02 03:04 to 03:09 UTC</dd>" in text
    assert "<dt>step limit</dt><dd>1300</dd>" in text
    assert f"<dt>environment</dt><dd>{ENVIRONMENT_VERSION}</dd>" in text


def test_an_unknown_task_is_shown_too() -> None:
    turn = UtteranceRecord(stage="command", text="Do it.")
    mention = MentionSpan(
        utterance=0, start=3, end=5, role="anaphor", expression="it", slot="x", value=1
    )
    odd = replace(records()[1], task="Homemade", instruction=(turn,), mentions=(mention,))
    page = Page(render([odd]))
    assert page.column("task") == ["Homemade"]
    assert "stages" not in page.details[0]


def test_the_page_is_written_whole_and_the_same_again(tmp_path: Path) -> None:
    store(tmp_path, records())
    path = write_report(Source(tmp_path))
    first = path.read_bytes()
    assert write_report(Source(tmp_path)).read_bytes() == first
    assert not list(tmp_path.glob(".*.part"))


def test_no_records_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="There are no records"):
        write_report(Source(tmp_path))


def test_the_first_pair_has_something_to_show() -> None:
    plan = PLAN.model_copy(
        update={"policies": tuple(map(read_policy, ("oracle", "listener", "forgetful")))}
    )
    won = [make_record(job, "success") for job in plan.jobs()]
    even = Page(render(won))
    assert (even.data["sides"], even.data["change"]) == ([0, 1], "all")
    lost = {"outcome": "failure", "cause": "fell"}
    some = [*won[:-1], replace(won[-1], **lost)]
    page = Page(render(some))
    assert (page.data["sides"], page.data["change"]) == ([0, 2], "changed")
    alone = Page(render(won[:3]))
    assert (alone.data["sides"], alone.data["change"]) == ([0, 0], "all")


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
    strange = replace(record, task="MyTask")
    page = Page(render([strange]))
    assert (
        page.string(page.details[0]["events"][0][1]) == f"picked up {cube.name.replace('_', ' ')}"
    )
