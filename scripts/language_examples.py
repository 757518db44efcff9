"""Examples of what is said, in Markdown, for the pages about the settings.

`write_language_card.py` writes them into docs/language.md and docs/harder-settings.md, and the
words that point back into docs/scenario-marks.md.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from written_parts import table, with_part

from roboirg.core.episode import Episode
from roboirg.language.generator import instruct
from roboirg.language.instruction import Described, Instruction
from roboirg.language.meaning import field_values
from roboirg.language.scenarios.scenario_file import pointer_table
from roboirg.language.settings import all_settings, plain_settings
from roboirg.language.variants import instructions
from roboirg.tasks.splits.splits import get_episode, split_episodes

WALK = ("PickXtimes", 6)
"""A test episode that all settings can express, each by another way."""
RIVALS: Mapping[str, str] = {
    "former": "PickXtimes",
    "latter": "StopCube",
    "not_former": "VideoUnmask",
    "not_latter": "VideoPlaceButton",
}
"""For each kind of remark the task of its example."""
SEEN = (
    ("place", "PickXtimes"),
    ("place", "VideoUnmaskSwap"),
    ("betweenness", "VideoUnmask"),
    ("sets", "ButtonUnmask"),
    ("counts", "VideoRepick"),
    ("counts", "BinFill"),
    ("events", "VideoRepick"),
    ("events", "VideoPlaceOrder"),
)
"""Kinds of what has to be seen, each with the task of an example."""


def language_page(page: str) -> str:
    """Return the page of the settings with its examples."""
    page = with_part(page, "walk", _texts_of_walk())
    return with_part(page, "meanings", _meanings_of_walk())


def harder_page(page: str) -> str:
    """Return the page of the harder settings with its examples."""
    page = with_part(page, "rivals", _rivals())
    return with_part(page, "seen", _seen())


def marks_page(page: str) -> str:
    """Return the page of marks with all words that point back, in the order of their file."""
    rows = []
    for row in pointer_table():
        words = row.words.replace("|", r"\|")
        rows.append((", ".join(row.of), row.operation, row.kind, f"`{words}`"))
    heads = ("stands for", "follows by", "class", "words")
    return with_part(page, "pointers", table(heads, rows))


def walk() -> dict[str, Instruction]:
    """Return what every setting says of the example, the main ones first."""
    task, index = WALK
    episode = get_episode(task, "test", index)
    harder = [name for name, setting in all_settings().items() if setting.plain is not None]
    names = [*plain_settings(), *harder]
    return {name: instruct(episode, name) for name in names}


def _texts_of_walk() -> str:
    rows = []
    for name, said in walk().items():
        turns = marked_turns(said)
        if name == "contextual":
            turns = [f"({number}) {turn}" for number, turn in enumerate(turns, start=1)]
        rows.append((f"`{name}`", " ".join(turns)))
    return table(("setting", "what is said"), rows)


def _meanings_of_walk() -> str:
    task, index = WALK
    episode = get_episode(task, "test", index)
    rows = []
    for name, said in walk().items():
        for cells in _meanings(said, episode):
            rows.append((f"`{name}`", *cells))
    return table(("setting", "introduced", "points back", "operation", "value"), rows)


def _meanings(said: Instruction, episode: Episode) -> Iterator[tuple[str, str, str, str]]:
    """Yield how each field that the command leaves open gets its value."""
    if said.meaning is None:
        return
    for field, term in said.meaning.terms.items():
        if field in said.meaning.settled:
            continue
        operands = [_operand(operand) for operand in term.operands]
        operation = str(term.operation)
        if term.rank:
            operation = f"{operation} {term.rank}"
        values = field_values(said.meaning, field, episode)
        value = ", ".join(sorted(map(str, values)))
        yield ", ".join(operands), _pointers(said), operation, value


def _operand(operand: str | int | Described) -> str:
    return operand.phrase if isinstance(operand, Described) else str(operand)


def _pointers(said: Instruction) -> str:
    """Return the words of the command that point back, each once."""
    last = len(said.utterances) - 1
    words = []
    for mention in said.mentions:
        if mention.utterance == last and mention.role == "anaphor":
            words.append(f"*{said.span(mention)}*")
    return ", ".join(dict.fromkeys(words))


def _rivals() -> str:
    rows = []
    for remark, task in RIVALS.items():
        episode, said = _first_with(task, "direct-rival", "rival_reference", remark)
        values = [value for _, _, _, value in _meanings(said, episode)]
        rows.append((f"`{remark}`", marked(said), ", ".join(values)))
    return table(("remark", "what is said", "meant"), rows)


def _seen() -> str:
    rows = []
    for kind, task in SEEN:
        _, said = _first_with(task, "grounded", "pattern", kind)
        rows.append((kind, task, marked(said)))
    return table(("kind", "task", "what is said"), rows)


def _first_with(task: str, setting: str, note: str, wanted: str) -> tuple[Episode, Instruction]:
    """Return the first test episode of a task whose words have something in their metadata."""
    for episode, said in instructions(split_episodes([task], ["test"]), [setting], ["implicit"]):
        if said.metadata[note] == wanted:
            return episode, said
    raise LookupError(f"No test episode of {task} has {wanted} in {setting}.")


def marked(instruction: Instruction) -> str:
    """Return the prompt in Markdown, with antecedents in italics and anaphors in bold."""
    return " ".join(marked_turns(instruction))


def marked_turns(instruction: Instruction) -> list[str]:
    """Return the utterances, marked like that."""
    turns: list[str] = []
    for number, utterance in enumerate(instruction.utterances):
        text = utterance.text
        for mention in reversed(instruction.mentions):
            if mention.utterance == number:
                sign = "*"
                if mention.role == "anaphor":
                    sign = "**"
                span = text[mention.start : mention.end]
                text = f"{text[: mention.start]}{sign}{span}{sign}{text[mention.end :]}"
        turns.append(text)
    return turns
