from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

from roboirg.analysis import cards
from roboirg.analysis.report import render, write_report
from roboirg.evaluation.course import Course, describe
from roboirg.evaluation.plan import Plan
from roboirg.evaluation.record import EventRecord, MentionSpan, Record, Turn
from roboirg.evaluation.store import RecordStore, StoreError

pytest.importorskip("jinja2")

PLAN = Plan(
    policies=("listener", "forgetful"), tasks=("PickXtimes", "VideoUnmask"), episodes=(0, 1, 2)
)
VOID = {"meta", "link", "input", "br"}


class Page(HTMLParser):
    """Collects what the tests ask about and checks that tags are closed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.cards: list[dict[str, str | None]] = []
        self.marks: list[str] = []
        self.videos: list[dict[str, str | None]] = []
        self.links: list[str] = []
        self.selects: list[str | None] = []
        self.cells: list[dict[str, str | None]] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        fields = dict(attrs)
        if tag not in VOID:
            self.open.append(tag)
        if tag == "article":
            self.cards.append(fields)
        if tag == "select":
            self.selects.append(fields["name"])
        if str(fields.get("class", "")).startswith("cell"):
            self.cells.append(fields)
        if tag == "video":
            self.videos.append(fields)
        self.links += [str(fields[name]) for name in ("src", "href", "poster") if name in fields]

    def handle_endtag(self, tag: str) -> None:
        # `li` and the like are written with their end tags too.
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] == "mark":
            self.marks.append(data)


def records() -> list[Record]:
    found = []
    for index, job in enumerate(PLAN.jobs()):
        events = [EventRecord(step=40, kind="picked", subject="cube_red")]
        course = Course("success", cause=None, steps=80, events=events)
        if index % 3 == 1:
            course = Course("failure", cause="picked the wrong cube", steps=50, events=events)
        if index % 7 == 6:
            course = Course(
                "error", error="policy", cause="policy: ValueError: <b>&", details="Traceback <x>"
            )
        found.append(describe(job, course, started_at="now"))
    return found


def test_every_episode_is_there_and_nothing_comes_from_outside() -> None:
    text = render(records(), planned=PLAN.jobs())
    page = Page(text)
    assert len(page.cards) == len(PLAN.jobs())
    for outcome in ("success", "failure", "error"):
        assert sum(card["data-outcome"] == outcome for card in page.cards) == sum(
            record.outcome == outcome for record in records()
        )
    assert all(link.startswith(("#", "data:")) for link in page.links)
    assert not re.search(r"https?:|@import|url\(", text)


def test_the_rules_are_filters_only_where_there_are_several() -> None:
    one = render(records())
    filters = ["policy", "task", "setting", "outcome", "difficulty"]
    assert Page(one).selects == ["level", *filters]
    assert Page(render(records()[:1])).selects == filters
    assert "policy seed" not in one

    jobs = [
        job.model_copy(update={"split": split, "policy_seed": seed, "max_steps": 100 + seed})
        for job in PLAN.jobs()[:2]
        for split in ("test", "val")
        for seed in (0, 7)
    ]
    many = [describe(job, Course("success", cause=None), started_at="now") for job in jobs]
    page = Page(render(many))
    assert page.selects == [
        "policy", "task", "setting", "split", "seed", "limit", "outcome", "difficulty",
    ]  # fmt: skip
    assert {(card["data-split"], card["data-seed"], card["data-limit"]) for card in page.cards} == {
        ("test", "0", "100"), ("test", "7", "107"), ("val", "0", "100"), ("val", "7", "107"),
    }  # fmt: skip
    assert {(cell["data-split"], cell["data-limit"]) for cell in page.cells} == {
        ("test", "100"), ("test", "107"), ("val", "100"), ("val", "107"),
    }  # fmt: skip
    assert "policy seed 7" in render(many)


def test_privileged_policies_are_marked() -> None:
    assert "listener (privileged)" in render(records())
    job = PLAN.jobs()[0].model_copy(update={"policy": "random"})
    assert "rivileged" not in render(
        [describe(job, Course("success", cause=None), started_at="now")]
    )


def test_words_are_escaped() -> None:
    text = render(records())
    assert "policy: ValueError: &lt;b&gt;&amp;" in text
    assert "Traceback &lt;x&gt;" in text


def test_mentions_are_marked_at_their_characters() -> None:
    record = records()[0].model_copy(
        update={
            "instruction": (Turn(stage="introduction", text="I see a red cube & it."),),
            "mentions": (
                MentionSpan(
                    utterance=0, start=18 + 1, end=21, role="anaphor", expression="it",
                    slot="colour", value="red",
                ),
                MentionSpan(
                    utterance=0, start=6, end=16, role="antecedent", expression=None,
                    slot="colour", value="red",
                ),
                MentionSpan(  # the same words for a second value
                    utterance=0, start=6, end=16, role="antecedent", expression=None,
                    slot="colour", value="blue",
                ),
            ),
        }
    )  # fmt: skip
    text = render([record])
    assert Page(text).marks == ["first named", "referred to", "a red cube", "it"]
    assert "antecedent: colour red, blue" in text


def test_films_are_inside_and_wait_to_be_played(tmp_path: Path) -> None:
    (tmp_path / "videos").mkdir()
    (tmp_path / "videos" / "x.mp4").write_bytes(b"film")
    (tmp_path / "videos" / "x.jpg").write_bytes(b"poster")
    first, second, *_ = records()
    filmed = first.model_copy(update={"video": "videos/x.mp4"})
    lost = second.model_copy(update={"video": "videos/gone.mp4"})
    (video,) = Page(render([filmed, lost], tmp_path)).videos
    assert video["preload"] == "none"
    assert video["src"] == "data:video/mp4;base64,ZmlsbQ=="
    assert video["poster"] == "data:image/jpeg;base64,cG9zdGVy"
    assert Page(render([filmed])).videos == []


def test_many_films_stay_beside_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "videos").mkdir()
    (tmp_path / "videos" / "a b.mp4").write_bytes(b"film")
    (tmp_path / "videos" / "a b.jpg").write_bytes(b"poster")
    first, second, *_ = records()
    filmed = first.model_copy(update={"video": "videos/a b.mp4"})
    lost = second.model_copy(update={"video": "videos/gone.mp4"})
    assert "they are beside it" not in render([filmed, lost], tmp_path)
    monkeypatch.setattr(cards, "MOST_FILM_BYTES", 3)
    text = render([filmed, lost], tmp_path)
    assert "they are beside it" in text
    (video,) = Page(text).videos
    assert (video["src"], video["poster"]) == ("videos/a%20b.mp4", "videos/a%20b.jpg")


def test_cards_and_filters_have_the_order_of_the_overview() -> None:
    page = Page(render(records()[::-1], planned=PLAN.jobs()))
    assert list(dict.fromkeys(card["data-policy"] for card in page.cards)) == list(PLAN.policies)
    assert list(dict.fromkeys(cell["data-policy"] for cell in page.cells)) == list(PLAN.policies)
    assert [card["data-setting"] for card in page.cards][:2] == ["explicit", "direct"]
    assert render(records()[::-1], planned=PLAN.jobs()) == render(records(), planned=PLAN.jobs())


def test_each_difficulty_has_its_overview() -> None:
    cells = Page(render(records(), planned=PLAN.jobs())).cells
    per_level = {
        level: sum(cell["data-difficulty"] == level for cell in cells)
        for level in ("", "easy", "medium")
    }
    assert len(cells) == sum(per_level.values())
    assert all(per_level.values())
    assert any("listener (privileged), all tasks, easy, direct: " in str(c["title"]) for c in cells)


def test_cells_say_how_sure_they_are() -> None:
    jobs = [job for job in PLAN.jobs() if job.setting in {"explicit", "direct"}]
    lost = [describe(job, Course("failure", cause="it fell"), started_at="now") for job in jobs]
    text = render(lost)
    assert re.search(r"0/3 · 0–56<", text)
    assert '<small class="muted">–</small>' in text
    for cell in Page(text).cells:
        is_gap = cell["data-setting"] == "direct"
        assert ("points to explicit" in str(cell["aria-label"])) == is_gap
        assert ("the gap says nothing" in str(cell["aria-label"])) == is_gap


def test_intermediate_references_have_a_colour_of_their_own() -> None:
    told = next(record for record in records() if record.setting == "explicit")
    assert "leads to the goal" not in render([told])
    mention = MentionSpan(
        utterance=0, start=0, end=3, role="antecedent", expression=None, slot="reference", value=2
    )
    text = render([told.model_copy(update={"mentions": (mention,)})])
    assert "leads to the goal" in text
    assert 'class="antecedent huereference"' in text


def test_the_head_says_which_run_it_was(tmp_path: Path) -> None:
    folder = tmp_path / "tuesday"
    folder.mkdir()
    first, second, *_ = records()
    with RecordStore(folder) as store:
        store.append(first.model_copy(update={"started_at": "2026-01-02T03:04:05+00:00"}))
        store.append(second.model_copy(update={"started_at": "2026-01-02T03:09:05+00:00"}))
    text = write_report(folder).read_text()
    assert "<dd>tuesday</dd>" in text
    assert "<dd>2026-01-02 03:04 to 03:09 UTC</dd>" in text
    assert "<dt>step limit</dt><dd>1300</dd>" in text


@pytest.mark.parametrize(
    ("steps", "expected"),
    [(1, [0]), (99, [0, 1, 2, 3, 4]), (245, [0, 5, 10]), (1300, [0, 20, 40, 60])],
)
def test_the_time_line_has_a_scale(steps: int, expected: list[int]) -> None:
    record = records()[0].model_copy(update={"steps": steps, "events": ()})
    ticks = cards._ticks(record)
    assert [tick.seconds for tick in ticks] == expected
    assert all(0 <= tick.left <= 100 for tick in ticks)


def test_the_page_is_written_whole_and_the_same_again(tmp_path: Path) -> None:
    with RecordStore(tmp_path) as store:
        for record in records():
            store.append(record)
    path = write_report(tmp_path)
    first = path.read_bytes()
    assert write_report(tmp_path).read_bytes() == first
    assert not list(tmp_path.glob(".*.part"))


def test_no_records_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="There are no records"):
        write_report(tmp_path)
