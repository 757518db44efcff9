"""What people answer in a study of listeners, one JSON line each, on the disk before it counts.

Nothing in the file shows who a person is: people have numbers, and a code with which they go on.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import msgspec

from roboirg.evaluation.records.line_file import AppendFile, LineFile
from roboirg.evaluation.records.record_codec import DamagedLineError, StoreError

ANSWERS_FILE = "answers.jsonl"
TORN_ANSWERS_FILE = "answers.torn"


class PersonJoined(msgspec.Struct, frozen=True, kw_only=True, tag_field="event", tag="joined"):
    """A person agreed to take part.

    Attributes:
        person: number, from 1 in the order of joining.
        code: known to the person only, to go on elsewhere.
        consent: hash of the text that the person agreed to.
        at: ISO 8601, UTC.
    """

    person: int
    code: str
    consent: str
    at: str


class PersonAnswered(msgspec.Struct, frozen=True, kw_only=True, tag_field="event", tag="answered"):
    """A person answered a question.

    Attributes:
        person: number of the person.
        number: of the question in the person's order, from 1.
        kind: practice, check or item.
        task: name of the task.
        split: of the episode.
        episode: position in the split.
        setting: name of the setting.
        form: implicit or resolved.
        policy_seed: of the record of this answer.
        objects: names of the things pointed at, in order.
        values: chosen value of each field.
        goal: slots of the goal that this means, as canonical JSON; None if the scene has no such
            goal.
        seconds: from the first words to the answer, without the time in which the page was hidden.
        hidden_s: seconds in which the page was hidden.
        plays: how often the video was started.
        at: ISO 8601, UTC.
    """

    person: int
    number: int
    kind: str
    task: str
    split: str
    episode: int
    setting: str
    form: str
    policy_seed: int
    objects: tuple[str, ...]
    values: dict[str, str | int]
    goal: str | None
    seconds: float
    hidden_s: float = 0.0
    plays: int = 0
    at: str


class AnswerUndone(msgspec.Struct, frozen=True, kw_only=True, tag_field="event", tag="undone"):
    """A person took back the newest answer.

    Attributes:
        person: number of the person.
        number: of the question.
        at: ISO 8601, UTC.
    """

    person: int
    number: int
    at: str


ListenerEvent = PersonJoined | PersonAnswered | AnswerUndone
_decoder = msgspec.json.Decoder(ListenerEvent)


class AnswerLog:
    """The answers of a study, open for appending by this process only.

    Args:
        folder: of the study.

    Attributes:
        events: everything that happened, in order.

    Raises:
        StoreError: another process serves the study, or the file cannot be read or written.
    """

    def __init__(self, folder: Path) -> None:
        self.events: list[ListenerEvent] = []
        self._file = AppendFile(
            folder,
            ANSWERS_FILE,
            TORN_ANSWERS_FILE,
            lambda lines: self.events.extend(lines.parse(_read_event)),
        )

    def append(self, event: ListenerEvent) -> None:
        """Write an event; when this returns, it is on disk.

        Raises:
            StoreError: it cannot be written; nothing has changed.
        """
        self._file.extend([msgspec.json.encode(event)])
        self.events.append(event)

    def close(self) -> None:
        self._file.close()


def person_name(number: int) -> str:
    """Return the name under which a person appears in records and tables."""
    return f"p{number:02}"


def standing_answers(events: Iterable[ListenerEvent]) -> Iterator[PersonAnswered]:
    """Yield the answers that were not undone, by person in the order of their questions."""
    kept: dict[tuple[int, int], PersonAnswered] = {}
    for event in events:
        if isinstance(event, PersonAnswered):
            kept[event.person, event.number] = event
        elif isinstance(event, AnswerUndone):
            kept.pop((event.person, event.number), None)
    yield from (kept[key] for key in sorted(kept))


def read_events(folder: Path) -> list[ListenerEvent]:
    """Read everything that happened in a study; takes no lock, so people may be answering.

    Raises:
        StoreError: the file cannot be read, or a line is no event.
    """
    return list(LineFile(folder / ANSWERS_FILE).parse(_read_event))


def _read_event(line: bytes, path: Path, number: int) -> ListenerEvent:
    try:
        event: ListenerEvent = _decoder.decode(line)
    except msgspec.ValidationError as error:
        raise StoreError(f"{path}, line {number}: not an answer of a study ({error}).") from error
    except msgspec.DecodeError as error:
        raise DamagedLineError(str(error)) from error
    return event
