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
"""With them each reply of 100 input tokens costs ten US dollars."""
BUSY = ModelBusyError("busy")
LOST = PolicyConnectionError("lost")


@pytest.fixture
def settings(tmp_path):
    """Settings of a run that stores the replies of its model, without a budget."""
    return ReplySettings(tmp_path)


def query_of(words, shade=None):
    """Return a question with these words, and with a picture of a shade of grey if one is given."""
    picture = () if shade is None else (Picture(np.full((2, 2, 3), shade, np.uint8)),)
    return ModelQuery("system", (ChatTurn("user", (words, *picture)),))


def ask_in_episode(server, settings, *words, episode="a", shade=None, **options):
    """Ask the questions of an episode, as a policy does; returns replies and what they cost."""
    vlm = VLMQuery(model_options(server, **options), Template("$why"))
    with use_replies(settings, episode):
        replies = [vlm.ask(query_of(word, shade), str) for word in words]
    return replies, Counter(vlm.usage())


def ask_twice(settings, replies=("one", "two"), changes=(), **options):
    """Ask a question, and again with changed options; return what comes the second time.

    The model gives the replies in turn.
    """
    with fake_vlm(list(replies)) as server:
        ask_in_episode(server, settings, "words", **options)
        return ask_in_episode(server, settings, "words", **{**options, **dict(changes)})


def test_replies_stored_for_an_episode_are_used_when_it_is_played_again(settings):
    """Two questions are asked, and both again as after an interruption. No call is paid twice: the
    model, which would say *never* by then, gets two requests.
    """
    with fake_vlm(["one", "two", "never"]) as server:
        first, _ = ask_in_episode(server, settings, "first", "second")

        again, counts = ask_in_episode(server, settings, "first", "second")

    assert first == again == ["one", "two"]
    assert counts["stored"] == 2
    assert len(server.requests) == 2


@pytest.mark.parametrize(
    ("episode", "words"),
    [("b", ["first"]), ("a", ["first", "first"])],
    ids=["another episode", "the same words once more"],
)
def test_what_was_not_asked_before_in_an_episode_is_asked(settings, episode, words):
    """Stored is the reply to *first* in episode a. Another episode, or the same words a second
    time, are questions of their own, so the service is asked and says *two*.
    """
    with fake_vlm(["one", "two"]) as server:
        ask_in_episode(server, settings, "first")

        replies, _ = ask_in_episode(server, settings, *words, episode=episode)

    assert replies[-1] == "two"
    assert len(server.requests) == 2


def test_a_run_that_measures_the_spread_of_a_model_asks_everything_again(tmp_path, settings):
    """Stored is the reply *one* to the question *first*. With the option `anew` that is not used:
    the model is asked again, and says *two*. No count speaks of the store.
    """
    with fake_vlm(["one", "two"]) as server:
        ask_in_episode(server, settings, "first")

        replies, counts = ask_in_episode(server, ReplySettings(tmp_path, anew=True), "first")

    assert replies == ["two"]
    assert (counts["stored"], counts["anew"]) == (0, 0)


def test_without_a_store_the_same_question_is_asked_again():
    """No reply is stored if there are no settings of a store (None)."""
    replies, _ = ask_twice(settings=None)

    assert replies == ["two"]


def test_a_stored_reply_is_not_used_for_another_picture(settings):
    """The same words with a picture of another shade are another question, so the model is asked
    and says *two*. As pictures may differ in a bit on another machine, this is counted.
    """
    replies, counts = ask_twice(settings, changes={"shade": 2}, shade=1)

    assert replies == ["two"]
    assert counts["anew"] == 1


@pytest.mark.parametrize(
    ("changes", "reply"),
    [({"temperature": 0.5}, "two"), ({"patience_s": 7, **PRICES}, "one")],
    ids=["temperature", "patience and prices"],
)
def test_a_stored_reply_is_used_unless_an_option_changes_that_would_change_it(
    settings, changes, reply
):
    """Stored is the reply *one*; who asks the model anew gets *two*. Another temperature may
    change a reply; how long to wait and what it costs does not.
    """
    replies, _ = ask_twice(settings, changes=changes)

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
            ask_in_episode(server, ReplySettings(tmp_path, 20.0), *"0123", **PRICES)
        assert len(server.requests) == 2

        replies, counts = ask_in_episode(server, ReplySettings(tmp_path, 90.0), *"0123", **PRICES)

    assert replies == ["zero", "one", "two", "three"]
    assert counts["stored"] == 2
    assert len(server.requests) == 4


def reply_in_json(choices, **usage):
    """Return what a service replies: choices, one of which says *one*, and numbers of tokens."""
    return Garbage(json.dumps({"choices": choices, "usage": usage}).encode())


SAYS_ONE = [{"message": {"content": "one"}}]
OF_UNKNOWN_COST = pytest.mark.parametrize(
    "reply",
    [
        reply_in_json(SAYS_ONE),
        reply_in_json(SAYS_ONE, prompt_tokens=10**9),
        reply_in_json(SAYS_ONE, prompt_tokens=-(10**5)),
    ],
    ids=["no tokens", "too many tokens", "less than none"],
)
"""A service may report no tokens, or a number that makes no sense: then the cost is unknown."""


@OF_UNKNOWN_COST
def test_a_reply_of_unknown_cost_stops_a_run_with_a_budget(tmp_path, reply):
    """The budget is 90 dollars. No one knows what is left of it after the first reply, *one*, so
    the second question of the episode is not asked.
    """
    with (
        fake_vlm([reply, "two"]) as server,
        pytest.raises(BudgetError, match=r"what 1 reply cost is unknown, .* of model 'fake'"),
    ):
        ask_in_episode(server, ReplySettings(tmp_path, 90.0), "0", "1", **PRICES)

    assert len(server.requests) == 1


@OF_UNKNOWN_COST
def test_a_reply_of_unknown_cost_is_stored(settings, reply):
    """Asked the same question again, a run takes the stored reply, *one*; what it cost is NaN."""
    replies, counts = ask_twice(settings, [reply, "two"], **PRICES)

    assert replies == ["one"]
    assert counts["stored"] == 1
    assert math.isnan(counts["cost_usd"])


def test_an_unreadable_reply_makes_the_cost_of_a_run_unknown(tmp_path):
    """A reply without a choice is an error, but it was paid: what is left of a budget is unknown.

    So the next episode's question is refused, and the service gets one request only.
    """
    limited = ReplySettings(tmp_path, 1e-6)
    with fake_vlm([reply_in_json([], prompt_tokens=7)]) as server:
        with pytest.raises(PolicyReplyError):
            ask_in_episode(server, limited, "words", **PRICES)

        with pytest.raises(BudgetError, match="what 1 reply cost is unknown"):
            ask_in_episode(server, limited, "words", episode="b", **PRICES)

    assert len(server.requests) == 1


def test_a_reply_with_an_invalid_character_is_stored_and_paid_once(settings):
    """Half a surrogate pair cannot be written as UTF-8, so it is stored as an escape. PRICES make
    a reply cost 10 dollars: asked twice, the question has cost that once.
    """
    replies, counts = ask_twice(settings, ["\ud800 fine"], **PRICES)

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


def check_file_is_refused(folder, words):
    """Check that a run that would use the stored replies of a folder ends with an error of these
    words, which names the file, and asks nothing of the model.
    """
    with fake_vlm(["one"]) as server, pytest.raises(ReplyFileError, match=words) as caught:
        ask_in_episode(server, ReplySettings(folder), "words")

    assert str(folder / REPLIES_FILE) in str(caught.value)
    assert not server.requests


def test_a_file_of_replies_with_a_view_ends_the_run(tmp_path):
    """Here it takes the place of the table of replies, has no end, and would be read for ever."""
    with changed_store(tmp_path) as database:
        database.executescript(
            "DROP TABLE replies;"
            "CREATE VIEW replies AS"
            " WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n)"
            " SELECT 'a' AS episode, 0 AS call, 'x' AS sent, 'x' AS text, i AS cost_usd FROM n;"
        )

    check_file_is_refused(tmp_path, "holds views or triggers")


def test_a_file_of_replies_with_another_table_ends_the_run(tmp_path):
    """Otherwise this would be an error of the policy in every episode."""
    with changed_store(tmp_path) as database:
        database.executescript("DROP TABLE replies; CREATE TABLE replies (a)")

    check_file_is_refused(tmp_path, "no such column")


def test_a_file_of_replies_that_is_no_database_ends_the_run(tmp_path):
    (tmp_path / REPLIES_FILE).write_bytes(b"none" * 1000)

    check_file_is_refused(tmp_path, "not a database")


def test_a_stored_cost_that_is_no_number_is_unknown(tmp_path):
    """A stranger wrote the cost *free* into the file of replies, so that no budget can be kept."""
    with changed_store(tmp_path) as database:
        database.execute("INSERT INTO replies VALUES ('a', 0, 'x', 'one', 1, 1, 'free')")
    store = reply_store.ReplyStore(ReplySettings(tmp_path, 9.0), "a")

    with pytest.raises(BudgetError, match="what 1 reply cost is unknown"):
        store.check_budget(ModelOptions(model="m", **PRICES))

    store.close()


def test_a_stored_reply_that_is_no_text_is_left_out(tmp_path, settings):
    """A stranger wrote a row into the file of replies whose text is the byte FF, which is no
    UTF-8.
    """
    with changed_store(tmp_path) as database:
        database.execute("INSERT INTO replies VALUES ('a', 0, 'x', x'ff', 1, 1, 1)")
    store = reply_store.ReplyStore(settings, "a")

    assert not store.replies()

    store.close()


def test_a_turn_years_away_as_by_a_wrong_clock_is_not_waited_for(tmp_path, settings, monkeypatch):
    """The file says that the service's next turn is at 1e308 s; the clock of the test says 5 s.

    Its `sleep` fails the test: so the turn comes at once.
    """
    with changed_store(tmp_path) as database:
        database.execute("UPDATE services SET next_at = 1e308")
    monkeypatch.setattr(reply_store, "time", SimpleNamespace(time=lambda: 5.0, sleep=pytest.fail))

    store = reply_store.ReplyStore(settings, "a")
    store.wait_for_turn("service", None)
    store.close()


def test_a_budget_without_prices_is_refused_before_anything_is_asked(tmp_path):
    """Of a budget of one dollar nothing could be counted off, so no request is sent."""
    with (
        fake_vlm(["one"]) as server,
        pytest.raises(BudgetError, match="needs the prices of model 'fake'"),
    ):
        ask_in_episode(server, ReplySettings(tmp_path, 1.0), "words")
    assert not server.requests


@pytest.mark.parametrize("provider", ["openai", "google"])
@pytest.mark.parametrize("code", [429, 503, 502])
def test_a_busy_model_service_is_asked_again_after_the_pause_it_names(
    tmp_path, settings, provider, code
):
    """A service says three times that it is busy, and to come again in 0.05 s; then it replies.

    So there are four requests and waits of 0.15 s or more. The time of the next request is stored,
    so that other processes of the run wait, too.
    """
    busy = Status(code, headers={"Retry-After": "0.05"})
    started = time.time()
    with fake_vlm([busy, busy, busy, "at last"]) as server:
        replies, counts = ask_in_episode(
            server, settings, "words", provider=provider, patience_s=60
        )

    assert replies == ["at last"]
    assert len(server.requests) == 4
    assert counts["waited_s"] >= 3 * 0.05
    with sqlite3.connect(tmp_path / REPLIES_FILE) as database:
        ((next_at,),) = database.execute("SELECT next_at FROM services")
    assert next_at >= started + 3 * 0.05


def pauses_of(monkeypatch, errors):
    """Return the pauses, in seconds, of a client whose service has these errors in turn, the last
    of which ends its asking. It has two retries, and a patience of 100 s; its clock does not wait.
    """
    waited: list[float] = []
    clock = SimpleNamespace(monotonic=lambda: sum(waited), sleep=waited.append)
    monkeypatch.setattr(vlm_query, "time", clock)
    options = ModelOptions(model="m", retries=2, patience_s=100.0)
    model = SimpleNamespace(answer=Mock(side_effect=errors))

    with pytest.raises(PolicyConnectionError, match=str(errors[-1])):
        VLMQuery(options, Template(""), lambda _: model).ask(query_of("words"), str)
    return waited


def test_pauses_for_a_busy_service_double_until_the_patience_ends(monkeypatch):
    """After 63 s of pauses the next one, of 64 s, is beyond the patience of 100 s."""
    pauses = pauses_of(monkeypatch, errors=[BUSY] * 7)

    assert pauses == [1, 2, 4, 8, 16, 32]


def test_a_longer_pause_that_a_busy_service_asks_for_replaces_one(monkeypatch):
    """The second pause would be 2 s; the service asks for 7 s. The next is of 4 s, as if nothing
    had been asked for. At last it asks for 90 s, which ends the patience of 100 s.
    """
    asks_for_7_s = ModelBusyError("busy", 7.0)
    asks_for_90_s = ModelBusyError("busy", 90.0)

    pauses = pauses_of(monkeypatch, errors=[BUSY, asks_for_7_s, BUSY, asks_for_90_s])

    assert pauses == [1, 7, 4]


def test_answers_that_were_lost_use_up_the_retries_and_a_busy_service_does_not(monkeypatch):
    """There are two retries: the third lost answer ends the asking."""
    pauses = pauses_of(monkeypatch, errors=[LOST, BUSY, LOST, BUSY, LOST])

    assert pauses == [1, 2, 4, 8]


def test_a_reply_of_another_format_is_an_error_and_is_not_stored(settings):
    """The first reply is an empty object, without choices. Asked again, the model says *one*."""
    with fake_vlm([Garbage(b"{}"), "one"]) as server:
        with pytest.raises(PolicyReplyError):
            ask_in_episode(server, settings, "words")
        replies, counts = ask_in_episode(server, settings, "words")
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
    """A date, and what is no positive number, is left out (None)."""
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

    def finish(self, episode):
        """Play an episode to its end; return all replies."""
        self._write(episode)
        self._write("wait")
        return list(self._replies())

    def kill_after(self, episode, count):
        """Play an episode, yield its first replies, and kill its process after so many."""
        self._write(episode)
        replies = self._replies()
        yield from itertools.islice(replies, count)
        self._write("kill")
        list(replies)  # what it said before it died

    def end(self):
        self.main.communicate()
        return self.main.returncode

    def _write(self, line):
        self.main.stdin.write(f"{line}\n")
        self.main.stdin.flush()

    def _replies(self):
        for line in iter(self.main.stdout.readline, ""):
            if line == "ended\n":
                return
            yield line.strip()


@pytest.mark.parametrize("kills", [4, pytest.param(24, marks=pytest.mark.slow)])
def test_no_answered_call_is_made_again_after_a_kill(tmp_path, kills):
    """An episode makes eight calls of a model, whose replies are stored. Each is killed twice,
    after a random number of replies, and then played to its end.

    Whatever was answered is never requested again: it was requested as often in the end as when its
    answer was first seen. A call that was under way at a kill may be made once more.
    """
    rng = random.Random(0)
    episodes = [f"e{number}" for number in range(kills // 2)]
    requests_when_answered: dict[str, int] = {}
    with fake_vlm(name_of) as server:
        process = EpisodeProcess(server, tmp_path)
        for episode in episodes:
            for _ in range(2):
                for call in process.kill_after(episode, rng.randrange(1, CALLS)):
                    requests = Counter(map(name_of, server.requests))
                    requests_when_answered.setdefault(call, requests[call])

            replies = process.finish(episode)

            assert replies == [f"{episode} {number}" for number in range(CALLS)]
        assert process.end() == 0

    requests = Counter(map(name_of, server.requests))
    for call, count in requests_when_answered.items():
        assert requests[call] == count, call
    assert requests.total() <= CALLS * len(episodes) + kills


@pytest.fixture
def waits(monkeypatch):
    """The seconds of each wait, which the clock, at 5 s, does not take."""
    found = []
    clock = SimpleNamespace(time=lambda: 5.0, sleep=found.append)
    monkeypatch.setattr(reply_store, "time", clock)
    return found


def test_processes_that_ask_at_the_same_moment_take_turns(settings, waits):
    """At 20 requests a minute they start three seconds apart; a store is that of a process."""
    for store in [reply_store.ReplyStore(settings, "a") for _ in range(3)]:
        store.wait_for_turn("service", 20.0)
        store.close()

    assert waits == [3.0, 6.0]


def test_the_longest_pause_that_a_service_asked_for_counts(settings, waits):
    """A service asks for a pause of 9 s and then of 4 s. The next request waits for 9 s, also if
    nothing limits the rate (None). The clock of the fixture stands still and notes the waits.
    """
    store = reply_store.ReplyStore(settings, "a")
    store.pause("service", 9.0)
    store.pause("service", 4.0)

    store.wait_for_turn("service", None)

    assert waits == [9.0]
    store.close()
