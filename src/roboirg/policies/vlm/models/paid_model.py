"""A model whose replies are kept, counted and waited for."""

from __future__ import annotations

import hashlib
import json
import time
from typing import Any

from roboirg.core.errors import BudgetError, ModelBusyError, PolicyConnectionError
from roboirg.core.waiting import waiting
from roboirg.policies.vlm.models.model import Model, ModelOptions, ModelQuery, ModelReply
from roboirg.policies.vlm.models.reply_store import ReplyStore, current_store
from roboirg.util.media import Clip, Picture

MILLION = 1_000_000
FIRST_PAUSE_S = 1.0
LONGEST_PAUSE_S = 60.0


class PaidModel:
    """Asks a model, unless the run has stored its reply; waits when the service asks for it.

    Args:
        model: the connection.
        options: of the model.

    Attributes:
        stored: replies that came from the store.
        anew: calls that were stored with something else sent, as by another machine.
        waited_s: seconds spent waiting for the service or for a turn.
        answered_s: seconds in which the service answered.
    """

    def __init__(self, model: Model, options: ModelOptions) -> None:
        self._model, self._options = model, options
        self._service = f"{options.model} at {options.address()}"
        self.start()

    def start(self) -> None:
        """Reset the counts for a new episode."""
        self.stored = self.anew = 0
        self.waited_s = self.answered_s = 0.0

    def counts(self) -> dict[str, float]:
        """Return the counts by name."""
        times = {"waited_s": self.waited_s, "answered_s": self.answered_s}
        rounded = {name: round(seconds, 3) for name, seconds in times.items()}
        return {"stored": self.stored, "anew": self.anew, **rounded}

    def answer(self, query: ModelQuery) -> ModelReply:
        """Send a query and return the reply; see `Model`.

        Raises:
            BudgetError: the run has spent what it may.
        """
        store = current_store()
        if store is None:
            return self._ask(query, None)
        sent = digest(query, self._options)
        found = store.find(sent)
        if found.reply is None:
            self._check_prices(store)
            store.check_budget()
            self.anew += found.differs
            reply = self._ask(query, store)
            store.keep(sent, reply, cost_of(self._options, reply) or 0.0)
        else:
            self.stored += 1
            reply = found.reply
        store.calls += 1
        return reply

    def close(self) -> None:
        """Close the connection."""
        self._model.close()

    def _check_prices(self, store: ReplyStore) -> None:
        if store.settings.max_cost_usd is not None and cost_of(self._options) is None:
            raise BudgetError(
                f"--max-cost needs the prices of model {self._options.model!r}; give input_price "
                "and output_price, in US dollars per million tokens."
            )

    def _ask(self, query: ModelQuery, store: ReplyStore | None) -> ModelReply:
        """Send a query, again while the service is busy or, a few times, cannot be reached."""
        pause, unreachable = FIRST_PAUSE_S, 0
        start = time.monotonic()
        while True:
            before = time.monotonic()
            if store is not None:
                store.wait_for_turn(self._service, self._options.requests_per_minute)
            asked = time.monotonic()
            self.waited_s += asked - before
            try:
                reply = self._model.answer(query)
                self.answered_s += time.monotonic() - asked
                return reply
            except PolicyConnectionError as error:
                is_busy = isinstance(error, ModelBusyError)
                wanted = error.retry_after_s if isinstance(error, ModelBusyError) else None
                unreachable += not is_busy
                seconds = pause if wanted is None else wanted
                left = self._options.patience_s - (time.monotonic() - start)
                if unreachable > self._options.retries or seconds > left:
                    raise
            self._pause(seconds, store if is_busy else None)
            pause = min(2 * pause, LONGEST_PAUSE_S)

    def _pause(self, seconds: float, store: ReplyStore | None) -> None:
        """Wait, and make the other processes of the run wait for a busy service, too."""
        if store is not None:
            store.pause(self._service, seconds)
        with waiting(f"{self._service}, which is busy", is_queue=True):
            time.sleep(seconds)
        self.waited_s += seconds


def cost_of(options: ModelOptions, reply: ModelReply | None = None) -> float | None:
    """Return what a reply costs, or nothing but whether that is known; None without prices."""
    if (options.input_price, options.output_price) == (None, None):
        return None
    if reply is None:
        return 0.0
    total = reply.input_tokens * (options.input_price or 0.0)
    total += reply.output_tokens * (options.output_price or 0.0)
    return total / MILLION


def digest(query: ModelQuery, options: ModelOptions) -> str:
    """Return a digest of everything that is sent and may change the reply."""
    found = hashlib.sha256()

    def add(value: Any) -> None:  # noqa: ANN401 - a part of a turn, or JSON
        if isinstance(value, Picture):
            found.update(f"picture {value.pixels.shape}".encode())
            found.update(value.pixels.tobytes())
        elif isinstance(value, Clip):
            found.update(f"clip {value.rate} {len(value.frames)}".encode())
            for frame in value.frames:
                found.update(frame.tobytes())
        else:
            text = value if isinstance(value, str) else json.dumps(value, sort_keys=True)
            found.update(f"text {len(text)} {text}".encode())

    add(options.about())
    add(query.system)
    add(None if query.schema is None else dict(query.schema))
    for turn in query.turns:
        add(turn.role)
        for part in turn.parts:
            add(part)
    return found.hexdigest()
