"""What the page holds beyond what a browser shows of a usual run, which is in test_page.py."""

from __future__ import annotations

import functools
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
    SubgoalRecord,
    UtteranceRecord,
)
from roboirg.runs.job_instruction import PreparedJob
from roboirg.runs.play.episode_record import audit_record

pytest.importorskip("jinja2")

PLAN_OF_ONE_TASK = PLAN.model_copy(update={"tasks": ("PickXtimes",), "forms": ("implicit",)})


class Page:
    """The parts of a page.

    Attributes:
        scripts: the content of each script that holds data, by its id.
        data: what all episodes need; texts are numbers, places in its list of strings.
        details: what each episode needs once it is opened, in the order of the records.
        text: the markup without scripts.
        notes: the warnings at the top.
    """

    def __init__(self, text):
        scripts = re.findall(r'<script type="[^"]*" id="([^"]*)">(.*?)</script>', text, re.DOTALL)
        self.scripts = dict(scripts)
        self.data: dict[str, Any] = json.loads(self.scripts["data"])
        self.details = [json.loads(line) for line in self.scripts["details"].splitlines()]
        self.text = unescape(re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL))
        self.notes = " ".join(re.findall(r'<li class="\w+"><b>\w+:</b> .*</li>', self.text))

    def string(self, place):
        """Return the text for which a number stands."""
        return str(self.data["strings"][place])


@functools.cache
def records_with_an_error_last():
    """Return the records of one task: the forgetful policy fails where it must remember.

    The last one is an error, with markup in its texts.
    """
    *found, last = played(PLAN_OF_ONE_TASK)
    return (*found, broken(last))


def written_film(folder, name="x"):
    """Write a video into a run, and return its path there."""
    (folder / "videos").mkdir(parents=True, exist_ok=True)
    for suffix in ("mp4", "jpg"):
        (folder / "videos" / f"{name}.{suffix}").write_bytes(b"film")
    return f"videos/{name}.mp4"


def test_the_page_loads_nothing_from_elsewhere():
    """It has no address of the web, imports no style, and forbids the browser to load anything."""
    text = render(records_with_an_error_last(), PLAN_OF_ONE_TASK)

    assert not re.search(r"https?:|@import|url\(", text)
    assert "default-src 'none'" in text


def test_text_of_records_cannot_end_the_script_of_the_page():
    """The cause of the last record has "</script><b>" in it; would find a way to attack readers."""
    records = records_with_an_error_last()

    text = render(records, PLAN_OF_ONE_TASK)

    assert "</script><b>" not in text
    assert records[-1].cause in Page(text).data["strings"]


def test_the_page_does_not_depend_on_the_order_of_the_records():
    records = records_with_an_error_last()

    assert render(records[::-1], PLAN_OF_ONE_TASK) == render(records, PLAN_OF_ONE_TASK)


def test_an_episode_shows_its_instruction_with_references_spelled_out():
    """The *resolved* form of an instruction spells out each reference of the *implicit* one, such
    as *it*. A page of implicit episodes alone makes it anew.

    Records of both forms are at hand here, so the page must show the texts of the resolved ones. In
    the arm "other-goal", a policy hears of another goal in the same scene; would find its words.
    """
    plan = PLAN_OF_ONE_TASK.model_copy(update={"forms": PLAN.forms, "arms": ("told", "other-goal")})
    records = [record for record in played(plan) if record.setting != "explicit"]
    implicit = [record for record in records if record.form == "implicit"]
    resolved = [record for record in records if record.form == "resolved"]

    page = Page(render(implicit))

    shown = [page.string(detail["resolved"]) for detail in page.details]
    texts = [" ".join(turn.text for turn in record.instruction) for record in resolved]
    assert sorted(shown) == sorted(texts)


@pytest.mark.parametrize(
    ("setting", "mentions"),
    [("direct", ["green", "it", "three times"]), ("contextual", ["green", "it", "three times"])],
)
def test_an_episode_shows_where_in_its_instruction_mentions_stand(setting, mentions):
    """Episode 0 begins with "... how you handle the green cube." and ends with "Grab it and place
    it on the target three times, ..."; in *contextual* there are three turns between the two.

    A mention is an utterance, counted from 0, and the places where its words begin and end.
    """
    record = listener_record(setting, 0)

    page = Page(render([record]))

    shown = []
    for utterance, begin, end, *_ in page.details[0]["mentions"]:
        shown.append(record.instruction[utterance].text[begin:end])
    assert shown == mentions


@pytest.mark.parametrize(
    ("changes", "missing"),
    [
        ({}, set()),
        ({"language_version": "0.1"}, {"resolved"}),
        ({"environment_version": 9}, {"resolved", "stages"}),
    ],
)
def test_records_of_other_versions_are_shown_without_what_cannot_be_derived(changes, missing):
    """Another version of the language may have other words, of the environment other stages."""
    page = Page(render([replace(listener_record("direct", 0), **changes)]))

    assert {"resolved", "stages"} - page.details[0].keys() == missing


def test_a_record_of_an_unknown_task_is_shown_with_its_events():
    """This package has no task "Homemade", so an object has the words of its name, and neither
    the spelled-out instruction (*resolved*) nor stages can be derived."""
    taken_off = EventRecord(
        step=70, kind="placed", subject="cube_green", place="target", holds=False
    )
    it = MentionSpan(
        utterance=0, start=3, end=5, role="anaphor", expression="it", slot="x", value=1
    )
    record = replace(
        listener_record("direct", 0),
        task="Homemade",
        instruction=(UtteranceRecord(stage="command", text="Do it."),),
        mentions=(it,),
        events=(taken_off,),
    )

    page = Page(render([record]))

    assert texts_with_steps(page, "events") == [(70, "took cube green off target")]
    assert not {"resolved", "stages"} & page.details[0].keys()


def test_events_tell_equal_cubes_apart_by_number_and_leave_out_what_ends_by_itself():
    """A cube is picked up; that it is then no longer *over the bin* is no event of its own."""
    first, *_ = played(PLAN_OF_ONE_TASK.model_copy(update={"tasks": ("BinFill",)}))
    picked = EventRecord(step=1, kind="picked", subject="cube_red_1")
    not_over = EventRecord(step=1, kind="over", subject="cube_red_1", place="bin", holds=False)

    page = Page(render([replace(first, events=(picked, not_over))]))

    assert texts_with_steps(page, "events") == [(1, "picked up the red cube (1)")]


def test_missing_episodes_and_errors_are_named_at_the_top_of_the_page():
    """Of the planned records of two policies, the five before the last are lost, and the last one
    is an error of the policy; notes at the top of the page say so. Cells of the table count five
    missing episodes in all.
    """
    records = records_with_an_error_last()
    kept = [*records[:-6], records[-1]]

    page = Page(render(kept, PLAN_OF_ONE_TASK))

    assert f"Incomplete: 5 of {len(records)} planned" in page.notes
    assert f"1 of {len(kept)} episodes ended in an error (1 policy)" in page.notes
    cells = page.data["matrix"]["levels"][0]["cells"]
    assert sum(cell.get("missing", 0) for cell in cells) == 5


def test_a_complete_run_of_two_policies_has_no_note():
    *without_error, _ = records_with_an_error_last()

    assert Page(render(without_error)).notes == ""


def test_a_run_of_a_single_policy_is_named_at_the_top_of_the_page():
    assert "Only one policy" in Page(render([listener_record("explicit", 0)])).notes


def listener_record(setting, episode):
    """Return the record of an episode of PickXtimes that the listener won."""
    return next(
        record
        for record in records_with_an_error_last()
        if (record.policy, record.setting, record.episode) == ("listener", setting, episode)
    )


def texts_with_steps(page, name):
    """Return the entries of a list in the details of the only episode, each as step and text."""
    return [(step, page.string(text)) for step, text, *_ in page.details[0][name]]


def test_an_episode_shows_what_happened_in_each_step():
    """Step -10 is in the video before the policy's turn."""
    page = Page(render([listener_record("explicit", 1)]))

    assert texts_with_steps(page, "events") == [
        (-10, "moved the green cube over the target"),
        (40, "picked up the green cube"),
        (60, "lowered the green cube or let it go"),
        (60, "placed the green cube on the target"),
        (70, "took the green cube off the target"),
    ]


def test_an_episode_shows_when_each_stage_of_its_task_was_completed():
    page = Page(render([listener_record("explicit", 1)]))

    assert [(page.string(text), step) for text, step in page.details[0]["stages"]] == [
        ("pick up the green cube for the first time", 40),
        ("place the green cube onto the target", 60),
        ("press the button to stop", None),
    ]


def test_an_episode_shows_the_subgoals_of_a_planner_and_what_was_wrong_with_them():
    """Three were named, at steps 0, 8 and 9; each has what was due then, and how it was judged."""
    subgoals = (
        SubgoalRecord(step=0, text="pick it up", due="pick it up", verdict="right", ended="done"),
        SubgoalRecord(
            step=8, text="dance", due="put it down", verdict="lost", ended="refused", why="no"
        ),
        SubgoalRecord(step=9, text="sing", verdict="wrong_count", ended="failed"),
    )

    page = Page(render([replace(listener_record("explicit", 1), subgoals=subgoals)]))

    assert texts_with_steps(page, "subgoals") == [
        (0, "pick it up"),
        (8, "dance (lost; due: put it down; refused: no)"),
        (9, "sing (wrong count; due: nothing; failed)"),
    ]


def test_an_episode_shows_how_much_of_each_turn_the_model_read():
    """Of the five turns, 24 tokens are read (by the upper bound `most_tokens`, which counts 50 in
    all): three turns and the first word of the fourth. `reached` counts characters.

    The command after them, which is lost, has two mentions: "blue" and "once for that student",
    which refers back.
    """
    record = replace(listener_record("contextual", 2))
    audit_record(record, PreparedJob(record.identity), PromptLimit(24, 0, most_tokens, "a.model"))

    page = Page(render([record]))

    (details,) = page.details
    turns = zip(record.instruction, details["reached"], strict=True)
    assert [turn.text[:reached] for turn, reached in turns] == [
        "One of my students missed the demo.", "Her bus was late.", "It's always late.",
        "Anyway, ", "",
    ]  # fmt: skip
    assert page.string(details["prompt"]) == (
        "cut: needs 50 tokens, the model reads 24 (counted with a.model); 2 mentions lost, 1 of "
        "them referring back"
    )


def test_an_episode_shows_the_conditions_under_which_it_was_played():
    """The record is of the test split, of our own words, and of a policy whose server says that its
    version is "9". Each record began on 2026-01-02 at 03:04, which the page says, too.
    """
    page = Page(render([replace(listener_record("explicit", 1), server_version="9")]))

    shown = page.string(page.details[0]["conditions"])
    assert shown.startswith(
        "test split, at most 1300 steps, in our own words; policy built-in (server 9), language "
    )
    assert "2026-01-02 03:04 UTC" in page.text


def test_a_cell_of_the_table_has_a_note_with_its_rate_its_interval_and_its_gap_to_explicit():
    """The listener wins 2 of 3 explicit episodes and 1 of the same 3 with a context."""
    won = [("explicit", 0), ("explicit", 2), ("contextual", 1)]
    records = []
    for setting in ("explicit", "contextual"):
        for episode in range(3):
            outcome = "success" if (setting, episode) in won else "failure"
            records.append(replace(listener_record(setting, episode), outcome=outcome))

    page = Page(render(records))

    explicit, contextual = page.data["matrix"]["levels"][0]["cells"]
    assert explicit["note"] == [
        "listener (privileged), PickXtimes, explicit",
        "67 % success: 2 of 3 trials, 3 episodes",
        "95 % interval 10 to 99 %",
    ]
    assert contextual["note"] == [
        "listener (privileged), PickXtimes, contextual",
        "33 % success: 1 of 3 trials, 3 episodes",
        "95 % interval 1 to 90 %",
        (
            "−33 points to explicit on the same 3 episodes (95 % interval −98.1 to +80.3), "
            "p = 1.000 (Holm)"
        ),
    ]


def test_episodes_can_be_chosen_by_what_differs_between_them():
    """Of two episodes, one is lost and played with another policy seed.

    A choice has a label, such as "task", and the values of the two episodes. Split, step limit and
    what else is equal in all records is no choice; whether a failed one has a cause is. Of an
    episode that succeeded, there is no reason why it failed (a place of -1). A *privileged* policy
    reads the simulator's state.
    """
    won = replace(listener_record("explicit", 0), policy_seed=8)
    lost = replace(listener_record("contextual", 2), policy_seed=9, outcome="failure")

    page = Page(render([won, lost]))

    chosen = {}
    for choice in page.data["choices"]:
        places = page.data["columns"][choice["name"]]
        chosen[choice["label"]] = [choice["values"][place] for place in places if place >= 0]
    assert chosen == {
        "policy": ["listener (privileged)", "listener (privileged)"],
        "task": ["PickXtimes", "PickXtimes"],
        "setting": ["explicit", "contextual"],
        "form": ["implicit", "implicit"],
        "difficulty": ["easy", "medium"],
        "outcome": ["success", "failure"],
        "why it failed": ["not attributed"],
        "policy seed": ["8", "9"],
    }


def texts_of_goals(**fields):
    """Return how the page shows the true goal of a failed record, and the one understood."""
    failed = next(record for record in records_with_an_error_last() if record.attribution)
    page = EpisodeDetails(Path(), embeds=False)
    details = page.details_of(replace(failed, **fields))
    texts = list(page.strings)
    understood = texts[details["named"]] if "named" in details else None
    return texts[details["goal"]], understood


@pytest.mark.parametrize(
    ("understood", "text"),
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
    understood, text
):
    shown = texts_of_goals(policy_metadata={"understood": understood})

    assert shown == ("green, 3 times", text)


@pytest.mark.parametrize(
    ("outcome", "text"), [("failure", "“dance”; due was “pick it up”"), ("success", None)]
)
def test_a_failed_episode_of_a_planner_shows_its_last_subgoal_up_to_the_failure(outcome, text):
    """Subgoals were given at steps 51, 60 and 61; the failed record has its first wrong act at step
    60, so the second subgoal, "dance", is shown with what was due. An episode that succeeded shows
    none.

    The other text is the true goal.
    """
    subgoals = tuple(
        SubgoalRecord(step=step, text=text, due="pick it up", verdict="lost")
        for step, text in ((51, "sing"), (60, "dance"), (61, "rest"))
    )

    shown = texts_of_goals(subgoals=subgoals, outcome=outcome)

    assert shown == ("green, 3 times", text)


def test_the_same_policy_with_other_words_is_shown_as_another_with_a_warning():
    """Two records differ in their words alone: "mine@1a" names a user's file of words.

    They are not averaged, so the policy has two lines in the table. References are spelled out
    (*resolved*) in our own words alone, as the file is not here. A *privileged* policy reads the
    simulator's state.
    """
    ours = listener_record("direct", 0)
    theirs = ours.with_options(wordings="mine@1a")

    page = Page(render([ours, theirs]))

    assert "Mixed words: our own words, the words of mine@1a." in page.notes
    assert page.data["matrix"]["policies"] == [
        "listener, the words of mine@1a (privileged)",
        "listener, our own words (privileged)",
    ]
    details_of_theirs, details_of_ours = page.details
    assert "resolved" in details_of_ours
    assert "resolved" not in details_of_theirs
    assert "in the words of mine@1a" in page.string(details_of_theirs["conditions"])


@pytest.mark.parametrize(
    ("changes", "pairs"),
    [
        ({}, [2]),
        ({"policy_seed": 1}, [1, 1]),
        ({"arm": "silent"}, [1, 1]),
        ({"split": "val"}, [1, 1]),
    ],
)
def test_two_policies_are_paired_on_a_scene_only_with_equal_words_seed_and_split(changes, pairs):
    """`pairs` is how many results each group has that is compared."""
    listener = listener_record("direct", 0)
    other = replace(listener, policy="forgetful", **changes)

    page = Page(render([listener, other]))

    assert sorted(Counter(page.data["columns"]["pair"]).values()) == pairs


@pytest.mark.parametrize(
    ("changes", "scenes"), [({"policy_seed": 1}, [2]), ({"split": "val"}, [1, 1])]
)
def test_results_of_the_same_episode_belong_to_one_scene(changes, scenes):
    """Episode 0 of another split is another scene; played with two policy seeds it is the same."""
    record = listener_record("direct", 0)

    page = Page(render([record, replace(record, **changes)]))

    assert sorted(Counter(page.data["columns"]["scene"]).values()) == scenes


@pytest.fixture
def filmed_run(tmp_path):
    """A run of two records. The first has a video of the 4 bytes "film", and a title picture of the
    same bytes that is shown before it plays; the video of the second was lost for want of room.
    """
    first, second, *_ = records_with_an_error_last()
    filmed = replace(first, video=written_film(tmp_path, "a-b"))
    lost = replace(second, video="videos/gone.mp4", video_error="no room")
    return store(tmp_path, [filmed, lost])


def test_videos_that_fit_are_stored_in_the_page(filmed_run, monkeypatch):
    """The only video of `filmed_run` and its title picture have four bytes each, "film", and a page
    may hold eight here. "ZmlsbQ==" is "film" in base64.

    A script film-KEY holds the video of an episode, poster-KEY its picture. A film that is stored
    is said to be at "#", inside the page; the second episode has lost its video.
    """
    monkeypatch.setattr(report, "MAX_EMBEDDED_BYTES", 8)

    page = Page(write_report(filmed_run).read_text())

    (film,) = (name for name in page.scripts if name.startswith("film-"))
    assert page.scripts[film] == "data:video/mp4;base64,ZmlsbQ=="
    assert page.scripts[film.replace("film", "poster")] == "data:image/jpeg;base64,ZmlsbQ=="
    assert [details.get("film") for details in page.details] == ["#", None]
    assert page.string(page.details[1]["lost"]) == "no room"


def test_a_page_may_be_asked_to_store_no_videos(filmed_run):
    page = Page(write_report(filmed_run, videos=False).read_text())

    assert not [name for name in page.scripts if name.startswith("film")]


@pytest.mark.parametrize(
    ("options", "folder"),
    [({"served": True}, "videos"), ({"out": "pages/a.html"}, "../videos")],
)
def test_videos_that_do_not_fit_are_linked_from_where_the_page_is(
    filmed_run, monkeypatch, options, folder
):
    """Two files of four bytes, a film and its picture, and a page that may hold seven."""
    monkeypatch.setattr(report, "MAX_EMBEDDED_BYTES", 7)
    if "out" in options:
        options = {"out": filmed_run.folder / options["out"]}

    page = Page(write_report(filmed_run, **options).read_text())

    assert page.details[0]["film"] == f"{folder}/a-b.mp4"
    assert page.details[0]["poster"] == f"{folder}/a-b.jpg"
    assert "plays them from the folder" in page.text


def test_videos_of_a_pack_that_do_not_fit_are_not_linked(filmed_run, monkeypatch):
    """A pack is a zip file; it is unpacked to be read, and the files are gone afterwards, so that a
    link to a video would lead nowhere. The video and its picture have four bytes each, and the page
    may hold seven, so they are not stored in it either.
    """
    monkeypatch.setattr(report, "MAX_EMBEDDED_BYTES", 7)
    pack = Source(filmed_run.folder / "a.roboirg.zip", filmed_run.folder)

    page = Page(write_report(pack).read_text())

    assert "film" not in page.details[0]
    assert "plays them from the folder" not in page.text


@pytest.fixture
def two_runs(tmp_path):
    """The same episodes in the folders `ours` and `our theirs`, of which theirs lacks four.

    The first episode of theirs was filmed, by another state of the package, and printed something.
    """
    records = records_with_an_error_last()
    theirs = tmp_path / "our theirs"
    filmed = replace(records[0], video=written_film(theirs), code="0")
    with EpisodeLog(log_path(theirs, filmed.slug)) as log:
        os.write(log.descriptor, b"words")
    return (
        store(tmp_path / "ours", records, PLAN_OF_ONE_TASK),
        store(theirs, [filmed, *records[1:-4]], PLAN_OF_ONE_TASK),
    )


def test_a_page_of_two_runs_compares_each_policy_with_itself(two_runs):
    """`two_runs` are the folders "ours" and "our theirs" with the same two policies.

    The table has the policies of the first run, 0 and 1, and those of the second, which begin at 2
    (`sides`). So the listener is compared with itself as 0 and 2.
    """
    ours, theirs = two_runs

    page = Page(write_report(ours, against=theirs).read_text())

    assert page.data["matrix"]["policies"] == [
        "listener, ours (privileged)",
        "forgetful, ours (privileged)",
        "listener, our theirs (privileged)",
        "forgetful, our theirs (privileged)",
    ]
    assert page.data["sides"] == [0, 2]
    sentences = {}
    for comparison in page.data["comparisons"]:
        sentences[comparison["left"], comparison["right"]] = comparison["sentences"][0]
    assert "listener, ours (privileged) against listener, our theirs" in sentences[0, 2]


def test_a_page_of_two_runs_finds_videos_and_what_was_printed_in_the_other_run(two_runs):
    """In `two_runs`, the first episode of the second run, "our theirs", has a video and a log.

    A script film-KEY holds a video; KEY is the end of the episode's name. Both runs have the same
    episodes, so a key of the second run ends in -2. The page lies in the first run's folder, and
    %20 is the space in the name of the second.
    """
    ours, theirs = two_runs
    slug = records_with_an_error_last()[0].slug

    page = Page(write_report(ours, against=theirs).read_text())

    key = slug.rpartition("-")[2]
    assert page.scripts[f"film-{key}-2"].startswith("data:video")
    (link,) = [details["log"] for details in page.details if "log" in details]
    assert link == f"../our%20theirs/{log_path(Path(), slug)}"


def test_a_page_of_two_runs_says_what_each_lacks_and_which_code_made_them(two_runs):
    """The second of `two_runs` lacks four episodes, and its first record is of another state of the
    package, "0". Its code that decides verdicts is the same, so the states are listed among the
    facts (<dd>), without a warning (*Mixed*).
    """
    ours, theirs = two_runs

    text = write_report(ours, against=theirs).read_text()

    assert "Incomplete: 4 of" in Page(text).notes
    assert "Mixed" not in Page(text).notes
    assert f"<dd>0, {records_with_an_error_last()[0].code}</dd>" in text
