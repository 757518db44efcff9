"""The store of a run's replies: what models said and what it cost, and whose turn it is.

A file of SQLite in the run's folder, shared by all its processes on a machine. A reply is stored
before the policy sees it, so that a run that is stopped and resumed asks nothing twice. On a
network file system whose locks do not work, processes may wait for each other or ask twice.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import json
import math
import sqlite3
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from roboirg.core.errors import BudgetError, EndOfRunError
from roboirg.core.field_types import MOST_SECONDS
from roboirg.core.handed_keys import without_keys
from roboirg.core.plain_text import counted
from roboirg.core.waiting import waiting
from roboirg.policies.vlm.models.model import (
    MOST_TOKENS,
    ModelOptions,
    ModelQuery,
    ModelReply,
    tokens_of,
)
from roboirg.util.media import Clip, Picture

REPLIES_FILE = "models.sqlite"
_LOCK_S = 60.0
"""How long a process waits for another one to finish a transaction."""
_TABLES = """
CREATE TABLE IF NOT EXISTS replies (
    episode TEXT, call INTEGER, sent TEXT,
    text TEXT, input_tokens INTEGER, output_tokens INTEGER, cost_usd REAL,
    PRIMARY KEY (episode, call, sent)
) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS services (name TEXT PRIMARY KEY, next_at REAL) WITHOUT ROWID;
"""

_REPLIES = """
SELECT sent, text, input_tokens, output_tokens
FROM replies
WHERE episode = ? AND call = ? AND sent NOT LIKE 'unread %' AND typeof(text) = 'text'
"""
# Older stores may hold costs that cannot be, which are unknown. SQLite compares a text with a
# number, too.
_SPENT = """
SELECT total(cost_usd), count(*) - count(CASE WHEN typeof(cost_usd) = 'real' AND cost_usd >= 0
THEN 1 END) FROM replies
"""
_CODE = "SELECT count(*) FROM sqlite_master WHERE type IN ('view', 'trigger')"
"""Counts what can compute something, maybe without end, in a stranger's file."""

_POSTPONE = """
INSERT INTO services VALUES (?, ?)
ON CONFLICT (name) DO UPDATE SET next_at = max(next_at, excluded.next_at)
"""


class ReplyFileError(EndOfRunError):
    """The file with a run's replies cannot be read or written, so no episode could be played."""


class ReplySettings(NamedTuple):
    """Where a run keeps its replies, and what it may spend.

    Attributes:
        folder: of the run.
        max_cost_usd: US dollars after which nothing is asked any more; None for no limit.
        anew: whether stored replies are passed over, as in a run that measures the spread.
    """

    folder: Path
    max_cost_usd: float | None = None
    anew: bool = False


@dataclass
class ReplyStore:
    """The store of a run's replies during one episode; the file is opened when it is first used.

    A reply is found by episode, number of the call in it, and digest of what was sent.

    Args:
        settings: of the run.
        episode: name of the episode, policy and words, the same when it is played again.

    Attributes:
        calls: number of the episode's next call; whoever has used a reply adds 1.
    """

    settings: ReplySettings
    episode: str
    calls: int = field(default=0, init=False)

    @functools.cached_property
    def _database(self) -> sqlite3.Connection:
        """The run's file of replies, opened and if need be made when it is first used.

        Every statement is a transaction of its own, unless one is begun (isolation level None).
        """
        self.settings.folder.mkdir(parents=True, exist_ok=True)
        database = sqlite3.connect(
            self.settings.folder / REPLIES_FILE, timeout=_LOCK_S, isolation_level=None
        )
        # What is committed is on disk, and survives a kill at any moment.
        database.execute("PRAGMA synchronous = FULL")
        database.executescript(_TABLES)
        (count,) = database.execute(_CODE).fetchone()
        if count:
            raise sqlite3.DatabaseError("it holds views or triggers")
        return database

    def _execute(self, statement: str, *values: object) -> list[tuple[Any, ...]]:
        """Carry out a statement, and return the rows that it finds.

        Raises:
            ReplyFileError: the file is damaged, foreign or locked, or the disk is full.
        """
        try:
            return self._database.execute(statement, values).fetchall()
        except sqlite3.Error as error:
            path = self.settings.folder / REPLIES_FILE
            raise ReplyFileError(
                f"The replies of models in {path} cannot be read or written ({error}); if the file "
                "is damaged, move it away, and the models are asked anew."
            ) from error

    def close(self) -> None:
        """Close the file if it has been opened."""
        if "_database" in vars(self):
            self._database.close()

    def replies(self) -> dict[str, ModelReply]:
        """Return the stored replies to this episode's next call, by the digest of what was sent.

        There are none if the run asks everything anew. What earlier versions have stored is
        cleaned: texts may hold keys, and counts of tokens may be impossible.
        """
        if self.settings.anew:
            return {}
        rows = self._execute(_REPLIES, self.episode, self.calls)
        replies = {}
        for sent, text, input_tokens, output_tokens in rows:
            replies[sent] = ModelReply(
                without_keys(text), tokens_of(input_tokens), tokens_of(output_tokens)
            )
        return replies

    def keep(self, sent: str, reply: ModelReply, cost_usd: float) -> None:
        """Store the reply to the next call; when this returns, it is on disk.

        SQLite stores NULL for NaN, which is unknown.
        """
        insert = "INSERT OR REPLACE INTO replies VALUES (?, ?, ?, ?, ?, ?, ?)"
        self._execute(insert, self.episode, self.calls, sent, *reply, cost_usd)

    def keep_unread(self) -> None:
        """Store that a reply to the next call could not be read: what it cost is unknown."""
        self.keep(f"unread {time.time()}", ModelReply(""), math.nan)

    def check_budget(self, model: ModelOptions) -> None:
        """Raise if the run may not ask a model.

        Raises:
            BudgetError: it has spent what it may, or what the model costs or has cost is unknown.
        """
        most = self.settings.max_cost_usd
        if most is None:
            return
        if not model.has_prices:
            raise BudgetError(
                f"--max-cost needs the prices of model {model.model!r}; give input_price and "
                "output_price, in US dollars per million tokens."
            )
        ((spent, unknown),) = self._execute(_SPENT)
        if unknown:
            raise BudgetError(
                f"--max-cost cannot be kept: what {counted(unknown, 'reply', 'replies')} cost is "
                f"unknown, as the service of model {model.model!r} did not report its tokens in "
                f"whole numbers from 0 to {MOST_TOKENS:,}; run the same command without --max-cost "
                "to go on."
            )
        if spent >= most:
            raise BudgetError(
                f"The models have cost {spent:.2f} of at most {most:.2f} US dollars; run the same "
                "command with a larger --max-cost to go on."
            )

    def wait_for_turn(self, service: str, per_minute: float | None) -> None:
        """Wait until a service may be asked, of all processes of the run.

        The file has the time at which each service is free again; this call moves it on by the gap
        between requests, in one transaction, and then sleeps until its own turn.

        Args:
            service: its address and model.
            per_minute: requests that it takes; None for as many as there are.
        """
        gap = 0.0 if per_minute is None else 60.0 / per_minute
        self._execute("BEGIN IMMEDIATE")
        with self._database:  # which commits
            now = time.time()
            # No turn is so far away: a clock was wrong, or the file is a stranger's.
            self._execute("DELETE FROM services WHERE next_at > ?", now + MOST_SECONDS)
            ((next_at,),) = self._execute(
                "SELECT total(next_at) FROM services WHERE name = ?", service
            )
            # The first to come may ask now, each other one `gap` seconds after the one before.
            turn = max(now, next_at)
            self._execute(_POSTPONE, service, turn + gap)
        if turn > now:
            with waiting(f"its turn at {service}", is_queue=True):
                time.sleep(turn - now)

    def pause(self, service: str, seconds: float) -> None:
        """Let no process of the run ask a service anything for some seconds."""
        self._execute(_POSTPONE, service, time.time() + seconds)


def digest(query: ModelQuery, options: ModelOptions) -> str:
    """Return a digest (SHA-256) of everything that is sent to a model and may change its reply.

    Each part leads with its kind and size, so that no two different queries give the same bytes.
    Stored replies are found by it, so that a change here makes runs ask again.
    """
    parts: list[Any] = [options.about(), query.system]
    parts.append(None if query.schema is None else dict(query.schema))
    for turn in query.turns:
        parts.append(turn.role)
        parts += turn.parts

    found = hashlib.sha256()
    for part in parts:
        if isinstance(part, Picture):
            found.update(f"picture {part.pixels.shape}".encode())
            found.update(part.pixels.tobytes())
        elif isinstance(part, Clip):
            found.update(f"clip {part.rate} {len(part.frames)}".encode())
            found.update(part.frames.tobytes())
        else:
            text = part if isinstance(part, str) else json.dumps(part, sort_keys=True)
            found.update(f"text {len(text)} {text}".encode())
    return found.hexdigest()


_stores: list[ReplyStore] = []
"""The newest is that of the episode that is played."""


@contextlib.contextmanager
def use_replies(settings: ReplySettings | None, episode: str) -> Iterator[None]:
    """Let the models of an episode use the run's store while the block runs.

    The file is not made before a model is asked. None for `settings`: the run keeps no replies.
    """
    if settings is None:
        yield
        return
    _stores.append(ReplyStore(settings, episode))
    try:
        yield
    finally:
        _stores.pop().close()


def current_store() -> ReplyStore | None:
    """Return the store of the episode that is played; None if the run keeps none."""
    return _stores[-1] if _stores else None
