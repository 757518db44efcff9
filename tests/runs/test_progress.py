import io
import itertools
import re
from types import SimpleNamespace

from msgspec.structs import replace
from rich.console import Console
from rich.text import Text
from run_fakes import FakePlay, small_plan

from roboirg.runs.run import progress
from roboirg.runs.run.progress import ConsoleReporter


def record_of(setting, outcome, **fields):
    """Return the record of an episode told in a setting, with this outcome."""
    job = small_plan(1).jobs()[0].with_options(setting=setting)
    return replace(FakePlay()(job), outcome=outcome, **fields)


DIRECT_FAILURE = record_of("direct", "failure")
DIRECT_SUCCESS = record_of("direct", "success")
EXPLICIT_SUCCESS = record_of("explicit", "success")


def printed_report(*records, terminal, planned=6, stored=2):
    """Return what is printed if so many of the planned episodes are stored and these are played."""
    console = Console(file=io.StringIO(), force_terminal=terminal, width=80)
    with ConsoleReporter(console) as reporter:
        reporter.start(planned, stored)
        for record in records:
            reporter.advance(record, is_new=record.attempt == 1)
    return console.file.getvalue()


def last_lines_of_terminal(*records, planned, stored):
    """Return the bar and the score that a terminal of 80 columns shows at last, without codes."""
    text = printed_report(*records, planned=planned, stored=stored, terminal=True)
    return Text.from_ansi(text).plain.splitlines()[-2:]


def test_a_terminal_sees_pace_time_left_and_score_in_80_columns():
    """Of six planned episodes two were stored before; the other four are played, so none is left.

    Of those told in the setting *direct* one of two is a success, in *explicit* both are.
    """
    played = (DIRECT_FAILURE, EXPLICIT_SUCCESS, DIRECT_SUCCESS, EXPLICIT_SUCCESS)

    bar, score = last_lines_of_terminal(*played, planned=6, stored=2)

    assert re.fullmatch(r"episodes ━+ 6/6 0:00:\d\d 0:00:00 left · \d+\.\d/min", bar)
    assert len(bar) <= 80
    assert score == "direct 1/2 · explicit 2/2"


def test_outside_a_terminal_each_episode_is_reported_in_one_plain_line():
    """Of six planned episodes two were stored before, so the first that is played is number 3.

    No line has a code that controls a terminal (escape).
    """
    text = printed_report(DIRECT_FAILURE, EXPLICIT_SUCCESS, planned=6, stored=2, terminal=False)

    head, third, fourth = text.splitlines()
    assert head == "2 of 6 episodes already stored."
    assert third.startswith("[3/6] random PickXtimes test/0 direct: failure:")
    assert fourth.startswith("[4/6] random PickXtimes test/0 explicit: success")
    assert "\x1b" not in text


def test_the_line_of_an_episode_names_its_form_and_its_arm():
    """The episode is told in the form *resolved*, which names what is meant, in the arm *silent* of
    an experiment."""
    record = replace(EXPLICIT_SUCCESS.with_options(form="resolved"), arm="silent")
    assert "explicit (resolved) (silent): success" in printed_report(record, terminal=False)


def lines_of_six_episodes(workers):
    """Return the lines of six episodes of 100 s each, in a run of 44 of which 4 are stored."""
    console = Console(file=io.StringIO(), width=200)
    with ConsoleReporter(console) as reporter:
        reporter.start(44, 4, workers)
        for _ in range(6):
            reporter.advance(replace(DIRECT_FAILURE, duration_s=100.0))
    return console.file.getvalue().splitlines()[1:]


def test_the_time_left_is_estimated_from_the_fifth_episode_of_a_run_on():
    """Of 44 episodes 4 are stored; each of the next takes 100 s, played by one worker.

    After the fifth 35 are left, 3,500 s or 0:58:20, after the sixth 34. Before, nothing is
    estimated.
    """
    lines = lines_of_six_episodes(1)

    assert all(line.endswith("(-:--:-- left)") for line in lines[:4])
    assert [line[-14:] for line in lines[4:]] == ["(0:58:20 left)", "(0:56:40 left)"]


def test_of_several_workers_the_rest_takes_as_many_rounds_as_each_has_to_play():
    """Of 44 episodes 4 are stored and five were played, of 100 s each; 35 are left.

    Eight workers play them in five rounds, of which the last plays three: 500 s, or 0:08:20.
    """
    *_, fifth, _sixth = lines_of_six_episodes(workers=8)

    assert fifth.endswith("(0:08:20 left)")


def test_if_nobody_knows_how_many_workers_there_are_the_pace_goes_on(monkeypatch):
    """Of 44 episodes 4 are stored and five were played, of 100 s each; 35 are left.

    The clock is replaced by one that goes on by 50 s each time that it is asked. So an episode of
    100 s ended every 50 s, and two were played side by side: 35 take 18 rounds, 1,800 s or 0:30:00.
    """
    clock = itertools.count(0, 50)
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=clock.__next__))

    *_, fifth, _sixth = lines_of_six_episodes(workers=None)

    assert fifth.endswith("(0:30:00 left)")


def test_a_warning_is_printed_at_once_on_stderr(capsys):
    ConsoleReporter(Console(file=io.StringIO())).warn("Mind the gap.")
    assert capsys.readouterr().err == "Mind the gap.\n"


def test_errors_are_counted_apart_and_an_episode_played_again_is_done_once():
    """Of six planned episodes two were stored before. One more is played and is a failure.

    It is played again, which ends in an error: still 3 of 6 are done. The score counts the failure,
    0 of 1, and the error apart from it.
    """
    error = record_of("direct", "error", attempt=2)

    bar, score = last_lines_of_terminal(DIRECT_FAILURE, error, planned=6, stored=2)

    assert " 3/6 " in bar
    assert score == "direct 0/1 · errors 1"
