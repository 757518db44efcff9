"""No call of a model is paid twice, whatever stops a run, and its limits are kept."""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import random
import sqlite3
import subprocess
import sys
import textwrap
import time
from collections import Counter
from fractions import Fraction
from string import Template
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
from planning_fakes import Garbage, Status, fake_vlm, model_options, words_of

from roboirg.core.errors import (
    BudgetError,
    ModelBusyError,
    PolicyConnectionError,
    PolicyReplyError,
)
from roboirg.policies.vlm import vlm_query
from roboirg.policies.vlm.model_content import ChatTurn
from roboirg.policies.vlm.models import ModelOptions, ModelQuery, reply_store
from roboirg.policies.vlm.models.http_model import retry_after_s
from roboirg.policies.vlm.models.reply_store import (
    REPLIES_FILE,
    ReplyFileError,
    ReplySettings,
    use_replies,
)
from roboirg.policies.vlm.vlm_query import VLMQuery
from roboirg.util.media import Clip, Picture

PRICES = {"input_price": 100_000.0, "output_price": 0.0}
BUSY = ModelBusyError("busy")
LOST = PolicyConnectionError("lost")
"""With them each reply of 100 input tokens costs ten US dollars."""


def query_of(words, shade=None):
    """Return a question with these words, and with a picture of a shade of grey if one is given."""
    picture = () if shade is None else (Picture(np.full((2, 2, 3), shade, np.uint8)),)
    return ModelQuery("system", (ChatTurn("user", (words, *picture)),))


def ask_in_episode(server, settings, episode, *words, shade=None, **options):
    """Ask the questions of an episode, as a policy does; returns replies and what they cost."""
    vlm = VLMQuery(model_options(server, **options), Template("$why"))
    with use_replies(settings, episode):
        replies = [vlm.ask(query_of(word, shade), str) for word in words]
    return replies, Counter(vlm.usage())


def test_replies_stored_for_an_episode_are_used_when_it_is_played_again(tmp_path):
    """So that an interrupted run pays no call of a model twice."""
    settings = ReplySettings(tmp_path)
    with fake_vlm(["one", "two", "never"]) as server:
        first, _ = ask_in_episode(server, settings, "a", "first", "second")

        again, counts = ask_in_episode(server, settings, "a", "first", "second")

    assert first == again == ["one", "two"]
    assert counts["stored"] == 2
    assert len(server.requests) == 2


@pytest.mark.parametrize(
    ("episode", "words"),
    [("b", ["first"]), ("a", ["first", "first"])],
    ids=["another episode", "the same words once more"],
)
def test_what_was_not_asked_before_in_an_episode_is_asked(tmp_path, episode, words):
    """Stored is the reply to *first* in episode a. Another episode, or the same words a second
    time, are questions of their own, so the service is asked and says *two*.
    """
    settings = ReplySettings(tmp_path)
    with fake_vlm(["one", "two"]) as server:
        ask_in_episode(server, settings, "a", "first")

        replies, _ = ask_in_episode(server, settings, episode, *words)

    assert replies[-1] == "two"
    assert len(server.requests) == 2


@pytest.mark.parametrize("is_kept", [True, False], ids=["anew", "nothing is stored"])
def test_a_run_that_measures_the_spread_or_stores_nothing_asks_everything_again(tmp_path, is_kept):
    """Stored is the reply *one*; a run with `anew`, or without a store, gets the next, *two*."""
    with fake_vlm(["one", "two"]) as server:
        ask_in_episode(server, ReplySettings(tmp_path), "a", "first")
        passing = ReplySettings(tmp_path, anew=True) if is_kept else None

        replies, counts = ask_in_episode(server, passing, "a", "first")

    assert replies == ["two"]
    assert (counts["stored"], counts["anew"]) == (0, 0)


def test_a_stored_reply_is_not_used_for_another_picture(tmp_path):
    """Pictures may differ in a bit on another machine; this is counted."""
    settings = ReplySettings(tmp_path)
    with fake_vlm(["one", "two"]) as server:
        ask_in_episode(server, settings, "a", "words", shade=1)

        replies, counts = ask_in_episode(server, settings, "a", "words", shade=2)

    assert replies == ["two"]
    assert counts["anew"] == 1


@pytest.mark.parametrize(
    ("changes", "reply"),
    [({"temperature": 0.5}, "two"), ({"patience_s": 7, **PRICES}, "one")],
    ids=["temperature", "patience and prices"],
)
def test_a_stored_reply_is_used_unless_an_option_changes_that_would_change_it(
    tmp_path, changes, reply
):
    settings = ReplySettings(tmp_path)
    with fake_vlm(["one", "two"]) as server:
        ask_in_episode(server, settings, "a", "words")

        replies, _ = ask_in_episode(server, settings, "a", "words", **changes)

    assert replies == [reply]


def test_the_digest_of_a_question_changes_with_everything_that_is_sent():
    """Each question differs from the others in one respect: in its system text, its schema, who
    speaks, how many turns it has, or a clip in it (black, grey, or black at half the rate).

    As many questions, as many digests: no two share a stored reply.
    """
    asked = query_of("words")
    frames = np.zeros((2, 4, 4, 3), np.uint8)
    clips = Clip(frames, Fraction(30)), Clip(frames + 1, Fraction(30)), Clip(frames, Fraction(15))
    queries = [
        asked,
        asked._replace(system="another"),
        asked._replace(schema={"type": "object"}),
        asked._replace(turns=(ChatTurn("model", ("words",)),)),
        asked._replace(turns=asked.turns * 2),
        *(asked._replace(turns=(ChatTurn("user", (clip,)),)) for clip in clips),
    ]

    options = ModelOptions(model="m")

    assert len({reply_store.digest(each, options) for each in queries}) == len(queries)


def test_a_run_stops_at_its_budget_and_goes_on_with_a_larger_one(tmp_path):
    """Four questions, and a budget of 20 dollars; each reply costs ten.

    With a larger budget the two questions that are left are asked.
    """
    with fake_vlm(["zero", "one", "two", "three"]) as server:
        with pytest.raises(BudgetError, match=r"have cost 20\.00 of at most 20\.00 US dollars"):
            ask_in_episode(server, ReplySettings(tmp_path, 20.0), "a", *"0123", **PRICES)
        assert len(server.requests) == 2

        replies, counts = ask_in_episode(
            server, ReplySettings(tmp_path, 90.0), "a", *"0123", **PRICES
        )

    assert replies == ["zero", "one", "two", "three"]
    assert counts["stored"] == 2
    assert len(server.requests) == 4


def without_tokens(words):
    return Garbage(json.dumps({"choices": [{"message": {"content": words}}]}).encode())


def with_tokens(count):
    message = {"choices": [{"message": {"content": "one"}}], "usage": {"prompt_tokens": count}}
    return Garbage(json.dumps(message).encode())


NO_CHOICES = Garbage(json.dumps({"choices": [], "usage": {"prompt_tokens": 7}}).encode())


@pytest.mark.parametrize(
    "reply",
    [without_tokens("one"), with_tokens(10**9), with_tokens(-(10**5))],
    ids=["no tokens", "too many tokens", "less than none"],
)
def test_a_reply_of_unknown_cost_stops_a_run_with_a_budget_but_is_stored(tmp_path, reply):
    """A service may report no tokens, or a number that makes no sense: the cost is unknown (NaN).

    With a budget of 90 dollars the second question is refused. Without one, the first question
    gets its stored reply, *one*, and no one knows what it cost.
    """
    with fake_vlm([reply, "two"]) as server:
        with pytest.raises(BudgetError, match=r"what 1 reply cost is unknown, .* of model 'fake'"):
            ask_in_episode(server, ReplySettings(tmp_path, 90.0), "a", "0", "1", **PRICES)
        assert len(server.requests) == 1

        replies, counts = ask_in_episode(server, ReplySettings(tmp_path), "a", "0", **PRICES)

    assert replies == ["one"]
    assert counts["stored"] == 1
    assert math.isnan(counts["cost_usd"])


def test_an_unreadable_reply_makes_the_cost_of_a_run_unknown(tmp_path):
    """A reply without a choice is an error, but it was paid: what is left of a budget is unknown.

    So the next episode's question is refused, and the service gets one request only.
    """
    limited = ReplySettings(tmp_path, 1e-6)
    with fake_vlm([NO_CHOICES]) as server:
        with pytest.raises(PolicyReplyError):
            ask_in_episode(server, limited, "a", "words", **PRICES)

        with pytest.raises(BudgetError, match="what 1 reply cost is unknown"):
            ask_in_episode(server, limited, "b", "words", **PRICES)

    assert len(server.requests) == 1


def test_a_reply_with_an_invalid_character_is_stored_and_paid_once(tmp_path):
    """Half a surrogate pair cannot be written as UTF-8."""
    settings = ReplySettings(tmp_path)
    with fake_vlm(["\ud800 fine"]) as server:
        ask_in_episode(server, settings, "a", "words", **PRICES)

        replies, counts = ask_in_episode(server, settings, "a", "words", **PRICES)

    assert replies == [r"\ud800 fine"]
    assert counts["stored"] == 1
    assert counts["cost_usd"] == 10.0


@contextlib.contextmanager
def changed_store(folder):
    """A store's file, which the block changes as a stranger might."""
    settings = ReplySettings(folder)
    store = reply_store.ReplyStore(settings, "a")
    store.pause("service", 0.0)
    store.close()
    with contextlib.closing(sqlite3.connect(folder / REPLIES_FILE)) as database:
        yield database
        database.commit()


VIEW_WITHOUT_END = """
DROP TABLE replies;
CREATE VIEW replies AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n)
SELECT 'a' AS episode, 0 AS call, 'x' AS sent, 'x' AS text, i AS cost_usd FROM n;
"""


@pytest.mark.parametrize(
    ("statements", "words"),
    [
        (VIEW_WITHOUT_END, "holds views or triggers"),
        ("DROP TABLE replies; CREATE TABLE replies (a)", "no such column"),
        ("", "not a database"),
    ],
)
def test_a_file_of_replies_that_cannot_be_read_ends_the_run_and_is_named(
    tmp_path, statements, words
):
    """The file of stored replies holds a view without an end, another table, or no database at all
    ("" stands for a file of other bytes).

    Otherwise it would be an error of the policy in every episode, or be read for ever. Nothing is
    asked of the model.
    """
    with changed_store(tmp_path) as database:
        database.executescript(statements)
    if not statements:
        (tmp_path / REPLIES_FILE).write_bytes(b"none" * 1000)

    with fake_vlm(["one"]) as server, pytest.raises(ReplyFileError, match=words) as caught:
        ask_in_episode(server, ReplySettings(tmp_path, 9.0), "a", "words", **PRICES)

    assert str(tmp_path / REPLIES_FILE) in str(caught.value)
    assert not server.requests


def test_a_stored_cost_that_is_no_number_is_unknown(tmp_path):
    """A stranger wrote the cost *free* into the file of replies, so that no budget can be kept."""
    with changed_store(tmp_path) as database:
        database.execute("INSERT INTO replies VALUES ('a', 0, 'x', 'one', 1, 1, 'free')")
    store = reply_store.ReplyStore(ReplySettings(tmp_path, 9.0), "a")

    with pytest.raises(BudgetError, match="what 1 reply cost is unknown"):
        store.check_budget(ModelOptions(model="m", **PRICES))

    store.close()


def test_a_stored_reply_that_is_no_text_is_left_out(tmp_path):
    """A stranger wrote the byte FF, which is no text, as a reply into the file."""
    with changed_store(tmp_path) as database:
        database.execute("INSERT INTO replies VALUES ('a', 0, 'x', x'ff', 1, 1, 1)")
    store = reply_store.ReplyStore(ReplySettings(tmp_path), "a")

    assert not store.replies()

    store.close()


def test_a_turn_years_away_as_by_a_wrong_clock_is_not_waited_for(tmp_path, monkeypatch):
    """The file says that the service's next turn is at 1e308 s; the clock of the test says 5 s.

    Its `sleep` fails the test: so the turn comes at once.
    """
    with changed_store(tmp_path) as database:
        database.execute("UPDATE services SET next_at = 1e308")
    monkeypatch.setattr(reply_store, "time", SimpleNamespace(time=lambda: 5.0, sleep=pytest.fail))

    store = reply_store.ReplyStore(ReplySettings(tmp_path), "a")
    store.wait_for_turn("service", None)
    store.close()


def test_a_budget_without_prices_is_refused_before_anything_is_asked(tmp_path):
    """Of a budget of one dollar nothing could be counted off, so no request is sent."""
    with (
        fake_vlm(["one"]) as server,
        pytest.raises(BudgetError, match="needs the prices of model 'fake'"),
    ):
        ask_in_episode(server, ReplySettings(tmp_path, 1.0), "a", "words")
    assert not server.requests


@pytest.mark.parametrize("provider", ["openai", "google"])
@pytest.mark.parametrize("code", [429, 503, 502])
def test_a_busy_model_service_is_asked_again_after_the_pause_it_names(tmp_path, provider, code):
    """A service says three times that it is busy, and to come again in 0.05 s; then it replies.

    So there are four requests and waits of 0.15 s or more. The time of the next request is stored,
    so that other processes of the run wait, too.
    """
    busy = Status(code, headers={"Retry-After": "0.05"})
    started = time.time()
    with fake_vlm([busy, busy, busy, "at last"]) as server:
        replies, counts = ask_in_episode(
            server, ReplySettings(tmp_path), "a", "words", provider=provider, patience_s=60
        )

    assert replies == ["at last"]
    assert len(server.requests) == 4
    assert counts["waited_s"] >= 3 * 0.05
    with sqlite3.connect(tmp_path / REPLIES_FILE) as database:
        ((next_at,),) = database.execute("SELECT next_at FROM services")
    assert next_at >= started + 3 * 0.05


@pytest.mark.parametrize(
    ("said", "waits"),
    [
        ([BUSY, ModelBusyError("busy", 7.0), LOST, BUSY, LOST, LOST], [1.0, 7.0, 4.0, 8.0, 16.0]),
        ([BUSY, ModelBusyError("busy", 99.5)], [1.0]),  # patience would end
    ],
)
def test_pauses_for_a_busy_service_double_until_retries_or_patience_end(monkeypatch, said, waits):
    """`said` are the errors of the service in order, `waits` the pauses in seconds before it is
    asked again.

    Pauses double from 1 s on, unless the service names a longer one (7 s). An answer that is lost
    uses up one of two retries: the third one ends the asking. In the second row the service asks
    for 99.5 s, which with the pause of 1 s is more than the patience of 100 s. The clock of the
    test does not wait.
    """
    waited: list[float] = []
    clock = SimpleNamespace(monotonic=lambda: sum(waited), sleep=waited.append)
    monkeypatch.setattr(vlm_query, "time", clock)
    options = ModelOptions(model="m", retries=2, patience_s=100.0)
    model = SimpleNamespace(answer=Mock(side_effect=said))

    with pytest.raises(PolicyConnectionError, match=str(said[-1])):
        VLMQuery(options, Template(""), lambda _: model).ask(query_of("words"), str)
    assert waited == waits


def test_a_reply_of_another_format_is_an_error_and_is_not_stored(tmp_path):
    with fake_vlm([Garbage(b"{}"), "one"]) as server:
        with pytest.raises(PolicyReplyError):
            ask_in_episode(server, ReplySettings(tmp_path), "a", "words")
        replies, counts = ask_in_episode(server, ReplySettings(tmp_path), "a", "words")
        assert (replies, counts["stored"]) == (["one"], 0)


@pytest.mark.parametrize(
    ("headers", "seconds"),
    [
        ({"retry-after": "7"}, 7.0),
        ({"retry-after": "Wed, 21 Oct 2015 07:28:00 GMT"}, None),
        ({"retry-after": "nan"}, None),
        ({"retry-after": "-5"}, None),
        ({}, None),
    ],
)
def test_the_waiting_time_of_a_service_is_read_in_seconds(headers, seconds):
    assert retry_after_s(headers) == seconds


PROGRAM = textwrap.dedent(
    """
    import os, signal, sys
    from pathlib import Path
    from string import Template
    from roboirg.policies.vlm.model_content import ChatTurn
    from roboirg.policies.vlm.models import ModelOptions, ModelQuery, make_model
    from roboirg.policies.vlm.models.reply_store import ReplySettings, use_replies
    from roboirg.policies.vlm.vlm_query import VLMQuery

    url, folder, calls = sys.argv[1:]
    options = ModelOptions(model="fake", base_url=url)

    make_model(options)  # loads what it needs, for all episodes

    def play(episode):
        model = VLMQuery(options, Template(""))
        with use_replies(ReplySettings(Path(folder)), episode):
            for number in range(int(calls)):
                words = f"<{episode} {number}"
                reply = model.ask(ModelQuery("system", (ChatTurn("user", (words,)),)), str)
                # At once: a kill between a line and its end would join it with the next.
                os.write(1, f"{reply}\\n".encode())

    for line in iter(sys.stdin.readline, ""):
        process = os.fork()
        if not process:
            play(line.strip())
            os._exit(0)
        if sys.stdin.readline() == "kill\\n":
            os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)
        print("ended", flush=True)
    """
)
CALLS = 8


def name_of(body):
    """The question of a request of `CHILD`, with which the stub answers it."""
    return words_of(body).rpartition("<")[2]


class EpisodeProcess:
    """Plays episodes, each in a process of its own, forked from one that has loaded everything."""

    def __init__(self, server, folder):
        words = [f"{server.url}/v1", str(folder), str(CALLS)]
        self.main = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def write(self, line):
        """Write the name of an episode to begin; then `kill`, or `wait` for its end."""
        self.main.stdin.write(f"{line}\n")
        self.main.stdin.flush()

    def replies(self):
        """Yield the replies that the episode's process gets until it ends."""
        for line in iter(self.main.stdout.readline, ""):
            if line == "ended\n":
                return
            yield line.strip()

    def end(self):
        self.main.communicate()
        return self.main.returncode


@pytest.mark.parametrize("kills", [4, pytest.param(24, marks=pytest.mark.slow)])
def test_no_answered_call_is_made_again_after_a_kill(tmp_path, kills):
    """A process plays episodes; each is killed twice after a random number of replies, then
    finished.

    Replies are stored, so an answered call is never made again: how often it was requested when
    its answer was first seen equals how often it was in the end. What was under way at a kill may
    be asked once more.
    """
    rng = random.Random(0)
    answered: dict[str, int] = {}
    """How often a call had been made when its answer was seen first."""
    with fake_vlm(name_of) as server:
        child = EpisodeProcess(server, tmp_path)
        for episode in [f"e{number}" for number in range(kills // 2)]:
            for _ in range(2):
                child.write(episode)
                replies = child.replies()
                for name in itertools.islice(replies, rng.randrange(1, CALLS)):
                    requests = Counter(map(name_of, server.requests))
                    answered.setdefault(name, requests[name])
                child.write("kill")
                list(replies)  # what it said before it died
            child.write(episode)
            child.write("wait")
            assert list(child.replies()) == [f"{episode} {number}" for number in range(CALLS)]
        assert child.end() == 0

        requests = Counter(map(name_of, server.requests))
        assert {name: requests[name] for name in answered} == answered
        # What was under way when a process was killed may have been asked again, once for a kill.
        assert requests.total() <= CALLS * (kills // 2) + kills


@pytest.fixture
def waits(monkeypatch):
    """The seconds of each wait, which the clock, at 5 s, does not take."""
    found = []
    clock = SimpleNamespace(time=lambda: 5.0, sleep=found.append)
    monkeypatch.setattr(reply_store, "time", clock)
    return found


def test_processes_that_ask_at_the_same_moment_take_turns(tmp_path, waits):
    """At 20 requests a minute they start three seconds apart; a store is that of a process."""
    for store in [reply_store.ReplyStore(ReplySettings(tmp_path), "a") for _ in range(3)]:
        store.wait_for_turn("service", 20.0)
        store.close()

    assert waits == [3.0, 6.0]


def test_the_longest_pause_that_a_service_asked_for_counts(tmp_path, waits):
    """Also if nothing limits the rate of requests."""
    store = reply_store.ReplyStore(ReplySettings(tmp_path), "a")
    store.pause("service", 9.0)
    store.pause("service", 4.0)

    store.wait_for_turn("service", None)

    assert waits == [9.0]
    store.close()
