"""One item of the grounding dataset, and its JSON line."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Literal, TypeVar, get_args

import msgspec
import numpy as np
from numpy.typing import NDArray

from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import OPTION_NAMES, InstructionOptions
from roboirg.util.atomic_write import write_atomically
from roboirg.util.regular_file import read_regular

ITEMS_FILE = "items.jsonl"

QuestionKind = Literal["slots", "choice", "points"]
QUESTION_KINDS: tuple[QuestionKind, ...] = get_args(QuestionKind)

LETTERS = "ABCD"

Mask = NDArray[np.bool_]
T = TypeVar("T")


class PointTarget(msgspec.Struct, frozen=True, kw_only=True):
    """Where one thing that is meant can be seen.

    Attributes:
        kind: of the thing, such as ``cube``.
        x: column of a pixel of its mask in the item's picture, from the left.
        y: row of that pixel, from the top.
        size: height and width of the picture.
        counts: lengths of the runs of the mask, column after column, alternating between pixels
            outside and inside, outside first (COCO's uncompressed run lengths).
    """

    kind: str
    x: int
    y: int
    size: tuple[int, int]
    counts: list[int]

    @property
    def mask(self) -> Mask:
        """The pixels that show the thing, shape `size`."""
        return decode_mask(self.counts, self.size)


class GroundingItem(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One question and its answers; `docs/grounding.md` explains every field."""

    id: str
    task: str
    suite: str
    split: str
    episode: int
    difficulty: str
    setting: str
    form: str
    stages: list[int]
    distractor: str
    distractors: int
    frame: str
    wordings: str
    text: str
    turns: list[str]
    picture: str
    video: str | None
    video_steps: int
    frames: list[str]
    slots_system: str
    system: str
    said: str
    shown: str
    now: str
    slots_question: str
    choice_question: str
    points_question: str
    schema: str
    choices: list[str]
    answer: str
    answers: list[str]
    goals: list[str]
    choice: str
    choice_answers: list[str]
    points: list[PointTarget]
    points_in_order: bool
    command_chance: float | None
    hidden_slots: list[str]
    pattern: str | None
    expressions: list[str]
    language_version: str
    environment_version: int

    @property
    def options(self) -> InstructionOptions:
        """The options of the item's instruction, as records of episodes have them.

        They are without `wordings`, which records have apart. Options that an item does not have
        keep their defaults, such as the delivery: an item has both the text and the turns.
        """
        known = [name for name in OPTION_NAMES if name in self.__struct_fields__]
        given = {name: getattr(self, name) for name in known}
        given["stages"] = tuple(self.stages)
        given["wordings"] = None
        return InstructionOptions(**given)

    def system_prompt(self, kind: QuestionKind) -> str:
        """Return the system prompt for a question of a kind; that for slots is the listener's."""
        return self.slots_system if kind == "slots" else self.system

    def question(self, kind: QuestionKind) -> str:
        """Return the question of a kind, which follows words, video and picture."""
        return str(getattr(self, f"{kind}_question"))


def encode_mask(mask: Mask) -> list[int]:
    """Return the run lengths of a mask, column after column, pixels outside first.

    A column of outside, inside, inside -> ``[1, 2]``; one that begins inside -> ``[0, …]``.
    `decode_mask` is the way back.
    """
    flat = np.concatenate([[False], mask.ravel(order="F")])
    changes = np.flatnonzero(flat[1:] != flat[:-1])
    counts: list[int] = np.diff(np.concatenate([[0], changes, [mask.size]])).tolist()
    return counts


def decode_mask(counts: list[int], size: tuple[int, int]) -> Mask:
    """Return a mask of a picture from the lengths of its runs, as `encode_mask` makes them.

    Args:
        counts: numbers of pixels that are outside and inside in turn, from the top left, column by
            column. The first one is 0 if the first pixel is inside.
        size: height and width of the picture.

    Returns:
        Booleans, shape (height, width).

    Raises:
        InvalidValueError: the runs do not fill the picture.
    """
    height, width = size
    if sum(counts) != height * width:
        raise InvalidValueError(
            f"The runs of a mask cover {sum(counts)} pixels; they must cover {height} x {width}."
        )
    is_inside = np.arange(len(counts)) % 2 == 1
    return np.repeat(is_inside, counts).reshape(size, order="F")


def read_content(path: Path, refusal: str, advice: str = "") -> bytes:
    """Return the content of a file.

    Args:
        path: of the file.
        refusal: what the error says before the reason.
        advice: what it says behind the reason.

    Raises:
        InvalidValueError: it cannot be read.
    """
    try:
        return read_regular(path)
    except (OSError, InvalidValueError) as error:
        reason = str(error).rstrip(".")
        raise InvalidValueError(f"{refusal} ({reason}){advice}.") from error


def write_items(items: list[GroundingItem], folder: Path) -> bytes:
    """Write the items of a dataset into its folder; return the content of the file."""
    content = msgspec.json.Encoder().encode_lines(items)
    write_atomically(folder / ITEMS_FILE, content)
    return content


def decode_lines(content: bytes, kind: type[T], origin: Path) -> Iterator[tuple[int, T]]:
    """Yield the objects in a file of JSON lines, each with the number of its line, from 1.

    Empty lines are left out, but counted.

    Args:
        content: of the file.
        kind: type that a line must have.
        origin: path of the file, for messages.

    Raises:
        InvalidValueError: a line is no such object.
    """
    decoder = msgspec.json.Decoder(kind)
    for number, line in enumerate(content.splitlines(), start=1):
        if line.strip():
            try:
                decoded = decoder.decode(line)
            except (msgspec.DecodeError, UnicodeDecodeError) as error:
                raise InvalidValueError(f"{origin}, line {number}: not valid ({error}).") from error
            yield number, decoded


def read_items(folder: Path) -> list[GroundingItem]:
    """Read the items of an exported dataset of grounding questions.

    Args:
        folder: of the dataset.

    Raises:
        InvalidValueError: the folder has no items, or a line is no item.
    """
    path = folder / ITEMS_FILE
    content = read_content(
        path,
        f"{str(folder)!r} holds no grounding dataset",
        "; make one with: roboirg export grounding --out DIR",
    )
    return [item for _, item in decode_lines(content, GroundingItem, path)]
