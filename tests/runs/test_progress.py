from __future__ import annotations

import io
import itertools
import re
from types import SimpleNamespace

import pytest
from msgspec.structs import replace
from rich.console import Console
from run_fakes import FakePlay, small_plan

from roboirg.records.record import Record
from roboirg.runs.run import progress
from roboirg.runs.run.progress import ConsoleReporter

FOUR_RECORDS = [FakePlay()(job) for job in small_plan(2).jobs()]


def printed_report(records: list[Record], *, terminal: bool) -> str:
    console = Console(file=io.StringIO(), force_terminal=terminal, width=80)
    with ConsoleReporter(console) as reporter:
        reporter.start(6, 2)
        for record in records:
            reporter.advance(record, is_new=record.attempt == 1)
    return console.file.getvalue()  # type: ignore[attr-defined]


def test_a_terminal_sees_pace_time_left_and_score_in_80_columns():
    text = printed_report(FOUR_RECORDS, terminal=True)
    last = text[text.rindex("episodes") :]
    assert "6/6" in last
    assert "0:00 left" in last
    assert "/min" in last

    won = {
        setting: sum(
            record.outcome == "success" for record in FOUR_RECORDS if record.setting == setting
        )
        for setting in ("direct", "explicit")
    }
    assert f"direct {won['direct']}/2 · explicit {won['explicit']}/2" in last


def test_outside_a_terminal_each_episode_is_reported_in_one_plain_line():
    lines = printed_report(
        [
            FOUR_RECORDS[0],
            replace(FOUR_RECORDS[1].with_options(form="resolved"), arm="silent"),
            *FOUR_RECORDS[2:],
        ],
        terminal=False,
    ).splitlines()

    assert lines[0] == "2 of 6 episodes already stored."
    assert [*lines[1].split()[:6], *lines[2].split()[4:8]] == [
        "[3/6]", "random", "PickXtimes", "test/0", "direct:", "failure:",
        "explicit", "(resolved)", "(silent):", "success",
    ]  # fmt: skip
    assert "\x1b" not in "".join(lines)


def times_left(total: int, done: int, workers: int | None) -> list[str]:
    """Return the time left in the line of each of six played episodes; empty where it has none.

    An episode takes 100 s, and one ends each minute.

    Args:
        total: episodes of the plan.
        done: of these, how many are stored before.
        workers: that play side by side; None if that is not known.
    """
    console = Console(file=io.StringIO(), width=200)
    with ConsoleReporter(console) as reporter:
        reporter.start(total, done, workers)
        for _ in range(6):
            reporter.advance(replace(FOUR_RECORDS[0], duration_s=100.0))
    lines = console.file.getvalue().splitlines()  # type: ignore[attr-defined]
    found = [re.search(r"\((\S+) left\)$", line) for line in lines if line.startswith("[")]
    return ["" if left is None else left[1] for left in found]


@pytest.fixture
def an_episode_a_minute(monkeypatch: pytest.MonkeyPatch) -> None:
    minutes = itertools.count(0, 60)
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=minutes.__next__))


@pytest.mark.usefixtures("an_episode_a_minute")
def test_the_time_left_is_estimated_from_the_fifth_episode_of_a_run_on():
    """Stored episodes do not count; 39 and 38 episodes are left, at one a minute."""
    assert times_left(total=144, done=100, workers=None) == ["", "", "", "", "39:00", "38:00"]


@pytest.mark.usefixtures("an_episode_a_minute")
def test_of_several_workers_the_rest_takes_as_many_rounds_as_each_has_to_play():
    """Four workers play 39 episodes in ten rounds of 100 s, of which the last plays three."""
    assert times_left(total=44, done=0, workers=4)[4:] == ["16:40", "16:40"]


@pytest.mark.usefixtures("an_episode_a_minute")
def test_a_long_time_left_has_hours():
    assert times_left(total=1005, done=0, workers=4)[4] == "6:56:40"


@pytest.mark.usefixtures("an_episode_a_minute")
def test_at_the_end_of_a_short_run_nothing_is_left():
    assert times_left(total=4, done=0, workers=4)[3] == "0:00"


def test_a_warning_is_printed_at_once_on_stderr(capsys):
    ConsoleReporter(Console(file=io.StringIO())).warn("Mind the gap.")
    assert capsys.readouterr().err == "Mind the gap.\n"


def test_errors_are_counted_apart_and_an_episode_played_again_is_done_once():
    """Two of six were stored; one is played, fails, and is repeated with an error: 3 of 6."""
    text = printed_report(
        [FOUR_RECORDS[0], replace(FOUR_RECORDS[0], outcome="error", attempt=2)], terminal=True
    )
    assert re.search(r"3/6.*direct 0/1 · errors 1", text[text.rindex("episodes") :], re.DOTALL)
