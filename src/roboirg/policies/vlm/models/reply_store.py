"""The store of a run's replies: what models said and what it cost, and whose turn it is.

A file of SQLite in the run's folder, shared by all its processes on a machine. A reply is stored
before the policy sees it, so that a run that is stopped and resumed asks nothing twice. On a
network file system whose locks do not work, processes may wait for each other or ask twice.
"""

from __future__ import annotations

import contextlib
import functools
import sqlite3
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from roboirg.core.errors import BudgetError
from roboirg.core.waiting import waiting
from roboirg.policies.vlm.models.model import ModelReply

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


class Found(NamedTuple):
    """What the store knows of a call.

    Attributes:
        reply: that was stored; None if there is none for what is sent now.
        differs: whether the same call of the episode was stored with something else sent.
    """

    reply: ModelReply | None
    differs: bool


@dataclass
class ReplyStore:
    """The store during one episode; the file is opened when it is first used.

    Args:
        settings: of the run.
        episode: name of the episode, policy and words, the same when it is played again.

    Attributes:
        calls: number of the episode's next call.
    """

    settings: ReplySettings
    episode: str
    calls: int = field(default=0, init=False)

    @functools.cached_property
    def _database(self) -> sqlite3.Connection:
        self.settings.folder.mkdir(parents=True, exist_ok=True)
        database = sqlite3.connect(
            self.settings.folder / REPLIES_FILE, timeout=_LOCK_S, isolation_level=None
        )
        # What is committed is on disk, and survives a kill at any moment.
        database.execute("PRAGMA synchronous = FULL")
        database.executescript(_TABLES)
        return database

    def close(self) -> None:
        """Close the file if it has been opened."""
        if "_database" in vars(self):
            self._database.close()

    def find(self, sent: str) -> Found:
        """Return what is stored of the next call, whose content has the digest `sent`."""
        rows = self._database.execute(
            "SELECT sent, text, input_tokens, output_tokens FROM replies "
            "WHERE episode = ? AND call = ?",
            (self.episode, self.calls),
        ).fetchall()
        if self.settings.anew:
            return Found(None, differs=False)
        for digest, text, input_tokens, output_tokens in rows:
            if digest == sent:
                return Found(ModelReply(text, input_tokens, output_tokens), differs=False)
        return Found(None, differs=bool(rows))

    def keep(self, sent: str, reply: ModelReply, cost_usd: float) -> None:
        """Store the reply to a call; when this returns, it is on disk."""
        self._database.execute(
            "INSERT OR REPLACE INTO replies VALUES (?, ?, ?, ?, ?, ?, ?)",
            (self.episode, self.calls, sent, *reply, cost_usd),
        )

    def check_budget(self) -> None:
        """Raise if the run has spent what it may.

        Raises:
            BudgetError: it has.
        """
        most = self.settings.max_cost_usd
        if most is None:
            return
        spent = float(self._database.execute("SELECT total(cost_usd) FROM replies").fetchone()[0])
        if spent >= most:
            raise BudgetError(
                f"The models have cost {spent:.2f} of at most {most:.2f} US dollars; run the same "
                "command with a larger --max-cost to go on."
            )

    def wait_for_turn(self, service: str, per_minute: float | None) -> None:
        """Wait until a service may be asked, of all processes of the run.

        Args:
            service: its address and model.
            per_minute: requests that it takes; None for as many as there are.
        """
        gap = 0.0 if per_minute is None else 60.0 / per_minute
        with self._transaction():
            now = time.time()
            turn = max(now, self._next_turn(service))
            self._set_turn(service, turn + gap)
        if turn > now:
            with waiting(f"its turn at {service}", is_queue=True):
                time.sleep(turn - now)

    def pause(self, service: str, seconds: float) -> None:
        """Ask a service nothing for so long, in all processes of the run."""
        with self._transaction():
            until = max(time.time() + seconds, self._next_turn(service))
            self._set_turn(service, until)

    def _next_turn(self, service: str) -> float:
        row = self._database.execute(
            "SELECT next_at FROM services WHERE name = ?", (service,)
        ).fetchone()
        return 0.0 if row is None else float(row[0])

    def _set_turn(self, service: str, at: float) -> None:
        self._database.execute("INSERT OR REPLACE INTO services VALUES (?, ?)", (service, at))

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[None]:
        self._database.execute("BEGIN IMMEDIATE")
        try:
            yield
        except BaseException:
            self._database.execute("ROLLBACK")
            raise
        self._database.execute("COMMIT")


_stores: list[ReplyStore] = []
"""The newest is that of the episode that is played."""


@contextlib.contextmanager
def use_replies(settings: ReplySettings | None, episode: str) -> Iterator[None]:
    """Let the models of an episode use the run's store while the block runs.

    The file is not made before a model is asked.
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
