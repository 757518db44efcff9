"""Query a model, again if the reply does not parse; keep, count and wait for its replies."""

from __future__ import annotations

import contextlib
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from string import Template
from typing import TypeVar

from roboirg.core.errors import ModelBusyError, PolicyConnectionError, UnknownCostError
from roboirg.core.waiting import waiting
from roboirg.policies.vlm.model_content import ChatTurn
from roboirg.policies.vlm.models import Model, ModelOptions, ModelQuery, ModelReply, make_model
from roboirg.policies.vlm.models.model import tokens_of
from roboirg.policies.vlm.models.reply_store import ReplyStore, current_store, digest
from roboirg.util.reply_reading import UnparsableReplyError, answer_of, check_whole

Value = TypeVar("Value")

SILENCE = "(no answer)"
"""Stands for an empty reply when it is quoted back; services refuse empty turns."""
UNREAD = ModelReply("")
"""Stands for a reply that could not be read: its tokens are unknown."""
TRIES = 2
FIRST_PAUSE_S = 1.0
LONGEST_PAUSE_S = 60.0
COST = "cost_usd"
ALWAYS = ("calls", "input_tokens", "output_tokens", "unparsed")
"""Counts that stand in records even if they are 0; so does the cost if prices are known."""


@dataclass
class VLMQuery:
    """Queries one model, unless the run has stored its reply, and counts the cost of an episode.

    Attributes:
        options: of the model, which is connected at the first query that is sent.
        again: prompt for the second try, with ``$why``.
        connect: connects the model.
    """

    options: ModelOptions
    again: Template
    connect: Callable[[ModelOptions], Model] = make_model
    _model: Model | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        self._service = f"{self.options.model} at {self.options.address()}"
        self.start()

    def ask(self, query: ModelQuery, parse: Callable[[str], Value]) -> Value | None:
        """Return the parsed answer of the model; None if `parse` rejects `TRIES` answers.

        After a rejected one the model is asked again, with the answer and why it was rejected, as
        further turns of the conversation.

        Args:
            query: to send first.
            parse: returns what an answer means; raises UnparsableReplyError with words for the
                model.

        Raises:
            PolicyConnectionError: the service cannot be reached or is overloaded.
            PolicyTimeoutError: there was no reply in time.
            PolicyReplyError: the service replied with an error or with something else.
            BudgetError: the run has spent what it may.
        """
        for _ in range(TRIES):
            reply = self._request(query).text
            answer = answer_of(reply)
            try:
                check_whole(reply)
                return parse(answer)
            except UnparsableReplyError as error:
                rejected = ChatTurn("model", (answer or SILENCE,))
                why = self.again.substitute(why=str(error))
                retry = ChatTurn("user", (why,))
                query = query._replace(turns=(*query.turns, rejected, retry))
        self._counts["unparsed"] += 1
        return None

    def start(self) -> None:
        """Reset the counts for a new episode."""
        self._counts = defaultdict[str, float](int, dict.fromkeys(ALWAYS, 0))
        if self.options.has_prices:
            self._counts[COST] = 0

    def usage(self) -> dict[str, float]:
        """Return calls, tokens and queries without a usable reply; the cost if prices are known.

        Tokens and cost are NaN if the service did not report those of every reply.
        What was ``stored`` by an earlier try cost nothing again; ``anew`` is what was stored with
        something else sent, as by another machine; ``answered_s`` the time that its answers took,
        and ``waited_s`` that in queues and while it was busy.
        """
        usage = {}
        for name, count in self._counts.items():
            is_always_there = name == COST or name in ALWAYS
            if count or is_always_there:
                is_seconds = name.endswith("_s")
                usage[name] = round(count, 3) if is_seconds else count
        return usage

    @contextlib.contextmanager
    def _timed(self, name: str) -> Iterator[None]:
        """Count the seconds of the block, unless it raises."""
        start = time.monotonic()
        yield
        self._counts[name] += time.monotonic() - start

    def _request(self, query: ModelQuery) -> ModelReply:
        """Return the reply to a query, and count it."""
        self._counts["calls"] += 1
        reply = self._find_or_send(query)
        self._count(reply)
        return reply

    def _count(self, reply: ModelReply) -> None:
        """Add the tokens and the cost of a reply to the counts."""
        self._counts["input_tokens"] += reply.input_tokens
        self._counts["output_tokens"] += reply.output_tokens
        if self.options.has_prices:
            self._counts[COST] += self.options.cost_usd(reply)

    def _find_or_send(self, query: ModelQuery) -> ModelReply:
        """Return the stored reply to a query, or send it and store the reply.

        A new reply is stored before anything sees it, so that an interrupted run repeats nothing.
        Either way the store's number of calls goes up by one: it must count the same when the
        episode is played again.
        """
        store = current_store()
        if store is None:
            return self._send(query, None)
        sent = digest(query, self.options)
        stored = store.replies()
        reply = stored.get(sent)
        if reply is not None:
            self._counts["stored"] += 1
        else:
            store.check_budget(self.options)
            self._counts["anew"] += 1 if stored else 0
            reply = self._send(query, store)
            store.keep(sent, reply, self.options.cost_usd(reply))
        store.calls += 1
        return reply

    def _send(self, query: ModelQuery, store: ReplyStore | None) -> ModelReply:
        """Send a query until there is a reply, and return it.

        It is sent again while the service is busy, for `patience_s` in all, and `retries` times if
        it cannot be reached. Any other error is raised at once.

        Args:
            query: for the model.
            store: of the run, through which its processes take turns; None without a run.
        """
        if self._model is None:
            self._model = self.connect(self.options)
        pause = FIRST_PAUSE_S
        failures = 0
        end = time.monotonic() + self.options.patience_s
        while True:
            if store is not None:
                with self._timed("waited_s"):
                    store.wait_for_turn(self._service, self.options.requests_per_minute)
            try:
                with self._timed("answered_s"):
                    reply = self._model.answer(query)
                return _as_stored(reply)
            except PolicyConnectionError as error:
                seconds = getattr(error, "retry_after_s", None) or pause
                is_busy = isinstance(error, ModelBusyError)
                if not is_busy:
                    failures += 1
                if failures > self.options.retries or time.monotonic() + seconds > end:
                    raise
            except UnknownCostError:
                self._count(UNREAD)
                if store is not None:
                    store.keep_unread()
                raise
            if store is not None and is_busy:  # makes the other processes of the run wait, too
                store.pause(self._service, seconds)
            with self._timed("waited_s"), waiting(f"{self._service}, which is busy", is_queue=True):
                time.sleep(seconds)
            pause = min(2 * pause, LONGEST_PAUSE_S)


def _as_stored(reply: ModelReply) -> ModelReply:
    """Return a reply that can be stored: halves of surrogate pairs are escaped in its text."""
    text = reply.text.encode(errors="backslashreplace").decode()
    return ModelReply(text, tokens_of(reply.input_tokens), tokens_of(reply.output_tokens))
