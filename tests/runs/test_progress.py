import io
import itertools
from types import SimpleNamespace

from msgspec.structs import replace
from rich.console import Console
from run_fakes import FakePlay, small_plan

from roboirg.runs.run import progress
from roboirg.runs.run.progress import ConsoleReporter


def record_of(setting, outcome, **fields):
    """Return the record of an episode told in a setting, with this outcome."""
    job = small_plan(1).jobs()[0].with_options(setting=setting)
    return replace(FakePlay()(job), outcome=outcome, **fields)


FOUR_RECORDS = [
    record_of("direct", "failure"),
    record_of("explicit", "success"),
    record_of("direct", "success"),
    record_of("explicit", "success"),
]


def printed_report(records, *, terminal):
    """Return what is printed if 2 of 6 episodes are stored already and these are played."""
    console = Console(file=io.StringIO(), force_terminal=terminal, width=80)
    with ConsoleReporter(console) as reporter:
        reporter.start(6, 2)
        for record in records:
            reporter.advance(record, is_new=record.attempt == 1)
    return console.file.getvalue()


def test_a_terminal_sees_pace_time_left_and_score_in_80_columns():
    """Two of six episodes were stored; of the four played, direct wins one of two, explicit both"""
    text = printed_report(FOUR_RECORDS, terminal=True)

    last = text[text.rindex("episodes") :]
    assert "6/6" in last
    assert "0:00:00 left" in last
    assert "/min" in last
    assert "direct 1/2 · explicit 2/2" in last


def test_outside_a_terminal_each_episode_is_reported_in_one_plain_line():
    """Two of six episodes were stored before, so the first that is played is number 3.

    No line has a code that controls a terminal (escape).
    """
    lines = printed_report(FOUR_RECORDS, terminal=False).splitlines()

    assert lines[0] == "2 of 6 episodes already stored."
    assert lines[1].startswith("[3/6] random PickXtimes test/0 direct: failure:")
    assert lines[2].startswith("[4/6] random PickXtimes test/0 explicit: success")
    assert "\x1b" not in "".join(lines)


def test_the_line_of_an_episode_names_its_form_and_its_arm():
    record = replace(record_of("explicit", "success").with_options(form="resolved"), arm="silent")
    assert "explicit (resolved) (silent): success" in printed_report([record], terminal=False)


def lines_of_six_episodes(workers):
    """Return what is printed if 4 of 44 episodes are stored, and six more take 100 s each."""
    console = Console(file=io.StringIO(), width=200)
    with ConsoleReporter(console) as reporter:
        reporter.start(44, 4, workers)
        for _ in range(6):
            reporter.advance(replace(FOUR_RECORDS[0], duration_s=100.0))
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
    """Eight workers play 35 episodes in five rounds of 100 s, of which the last plays three."""
    assert lines_of_six_episodes(8)[4].endswith("(0:08:20 left)")


def test_if_nobody_knows_how_many_workers_there_are_the_pace_goes_on(monkeypatch):
    """An episode of 100 s ended every 50 s, so two were played side by side: 35 take 18 rounds.

    The clock is replaced by one that goes on by 50 s each time that it is asked.
    """
    clock = itertools.count(0, 50)
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=clock.__next__))

    assert lines_of_six_episodes(None)[4].endswith("(0:30:00 left)")


def test_a_warning_is_printed_at_once_on_stderr(capsys):
    ConsoleReporter(Console(file=io.StringIO())).warn("Mind the gap.")
    assert capsys.readouterr().err == "Mind the gap.\n"


def test_errors_are_counted_apart_and_an_episode_played_again_is_done_once():
    """Two of six were stored; one is played, fails, and is repeated with an error: 3 of 6."""
    failure = record_of("direct", "failure")
    error = record_of("direct", "error", attempt=2)

    text = printed_report([failure, error], terminal=True)

    last = text[text.rindex("episodes") :]
    assert "3/6" in last
    assert "direct 0/1 · errors 1" in last
