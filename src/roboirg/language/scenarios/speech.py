"""The words of one scenario: its sentences with values filled in, and the command.

- *lead*: the words before the command, *So,*.
- *skeleton*: a command with fields to be filled, *Pick up {color}*.
- *hidden*: of a field whose words point back, so that the context has to give its value.
- *settled*: of a field whose value the command alone gives.
"""

from __future__ import annotations

import functools
import itertools
import re
from collections.abc import Callable, Iterator, Mapping
from typing import cast

from roboirg.core.errors import InvalidValueError
from roboirg.language.instruction import REFERENCE, Expression, Meaning, Term
from roboirg.language.phrases import (
    Phrase,
    TaggedText,
    anaphor,
    antecedent,
    fill,
    listed,
    plain,
    swap_particles,
    words_of,
)
from roboirg.language.request import AMOUNT_FIELD, InstructionRequest
from roboirg.language.scenarios.amounts import (
    NUMBERS,
    amount_text,
    amount_texts,
    hidden_fields,
    hidden_term,
    stated_counts,
)
from roboirg.language.scenarios.choice import rival_values
from roboirg.language.scenarios.declared import ChoosingRemark, SaidValues
from roboirg.language.scenarios.introduced import Introduced, PointedValue
from roboirg.language.scenarios.markup import (
    Agreement,
    Pointer,
    Slot,
    Text,
    parse,
    pointers_in,
    slots_in,
)
from roboirg.language.scenarios.scenario import Scenario, TaskScenarios
from roboirg.language.scenarios.scenario_file import general
from roboirg.language.settings import all_settings

_WAYS_BY_SIGHT = ("spatial", "grounded")
"""Ways to the goal on which the scene gives a value; the resolved form says where to look."""
_ALWAYS_CAPITAL = re.compile(r"I\b|[A-Z]{2}")
"""*I*, *I'd*, and words in capitals: they stay as they are within a sentence."""


class Speech:
    """The words of one scenario in one episode, and what they mean.

    Sentences are said in the order of the text, since words can point back only at what was said:
    introduction, remarks, `begin_command`, lead, fields, `command`, and then `meaning`.

    Args:
        request: the episode, and how to instruct it.
        words: of the task.
        introduced: the values that can be named.
        scenario: None for a command alone.
    """

    def __init__(
        self,
        request: InstructionRequest,
        words: TaskScenarios,
        introduced: Introduced,
        scenario: Scenario | None = None,
    ) -> None:
        self._request = request
        self._words = words
        self._introduced = introduced
        self._scenario = scenario
        self._said = SaidValues(request.frame)  # by all sentences so far
        self._terms: dict[str, Term] = {}  # of the fields that were said
        self._hidden: set[str] = set()  # those of them that point back
        self._agrees: dict[str, bool] = {}  # by slot, whether the last utterance speaks of one

    def begin_command(self) -> None:
        """Forget with what the words before agree: the last utterance begins."""
        self._agrees.clear()

    def phrase(
        self, text: Text, introduced: Introduced | None = None, *, resolved: bool = False
    ) -> Phrase:
        """Return a sentence with its slots filled, such as *Red is nice* for ``{color} is nice``.

        What it names counts as said from now on.

        Args:
            text: the sentence.
            introduced: the values of its slots; None for the usual ones.
            resolved: whether words that point back are replaced by what they stand for.
        """
        values = introduced or self._introduced
        pieces: list[TaggedText] = []
        for part in text:
            if isinstance(part, TaggedText):
                pieces.append(part)
            elif isinstance(part, Slot):
                pieces.extend(self._slot(part, values))
            elif isinstance(part, Agreement):
                pieces.append(self._agreeing(part, values))
            elif resolved:
                pieces.extend(self._named(part))
            else:
                pieces.extend(self._pointing(part))
        return tuple(piece for piece in pieces if piece.text)

    def _slot(self, slot: Slot, values: Introduced) -> Phrase:
        """Return the words for a slot; amounts are said color by color."""
        if slot.name in ("amounts", "reference") and "amounts" in values.values:
            texts = amount_texts(NUMBERS[slot.name], len(values.values["colors"]))
            return listed([self.phrase(text, values) for text in texts])
        self._said.add(slot.name, values.values[slot.name])
        return values.phrase(slot)

    def _agreeing(self, agreement: Agreement, values: Introduced) -> TaggedText:
        """Return the singular or the plural of words, and remember with which value they agree.

        ``[repeats: lap|laps]``, an agreement, is *laps* for two repeats.
        """
        controller = agreement.controller
        if controller == "step":  # *right before*, *two before*
            self._said.add("step", values.values["step"])
        is_single = values.count(controller) == 1
        self._agrees[controller] = is_single
        return TaggedText(agreement.one if is_single else agreement.many)

    def _pointing(self, pointer: Pointer) -> Phrase:
        """Return words that point back, tagged with what they stand for: *it*, the color red.

        A rank, *the latter*, gets the position of its value in the list.
        """
        values = self._introduced
        expression = cast("Expression", pointer.expression)
        if pointer.expression == "rank":
            values, expression = values.ranked(pointer.of, ordinals="ordinal" in pointer.words)
        words = words_of(self.phrase(pointer.parts, values))
        referent = values.referent(pointer.of)
        return anaphor(words, expression, referent.slot, referent.value)

    def _named(self, pointer: Pointer) -> Phrase:
        """Return words that name what a pointer stands for: *the red cube* in place of *it*.

        A pointer is words that point back. It is replaced in the resolved form of an instruction.
        """
        text = pointer.resolved
        if not text:
            text = self._referent(pointer.of)
            # "on the left" needs a noun, unless it takes the place of "there".
            kind = self._introduced.values[pointer.of][-1].kind
            if kind == "place" and pointer.expression != "there":
                noun = self._request.task.things.pointed.removeprefix("hidden_")
                text = (TaggedText(f"the {noun} "), *text)
        referent = self._introduced.referent(pointer.of)
        return antecedent(words_of(self.phrase(text)), referent.slot, referent.value)

    def _referent(self, name: str) -> Text:
        """Return a sentence part that names what a slot holds, with marks: *the {color} cube*.

        By the type of the value: a color gets a noun, a visit or placement *the*, a number *twice*.
        """
        values = self._introduced.values[name]
        kind = values[0].kind if len(values) == 1 else "several"
        if kind in ("placement", "relation") and name in self._words.stated:
            return self._words.stated[name]
        if kind == "color":
            noun = self._request.task.things.colored
            return (TaggedText("the "), Slot(name), TaggedText(f" {noun}"))
        if kind in ("visit", "placement"):
            return (TaggedText("the "), Slot(name))
        if kind == "number" and name != REFERENCE:
            return (Slot(name, "times"),)
        return (Slot(name),)

    def field(self, name: str, words: Text, remark: ChoosingRemark | None = None) -> Phrase:
        """Return the words for a field of the command, and remember what they mean.

        In the resolved form, words that name the value may take their place.

        Args:
            name: of the field, ``color``.
            words: of the scenario, such as *it*, or those that state the value.
            remark: words before the command that have chosen what they point at, if any have.
        """
        if self._request.resolved and self._scenario:
            words = self._resolved(name, words, self._scenario)
        phrases = [self.phrase(words, resolved=self._request.resolved)]
        fields = self._request.fields_in(name)
        # The colors that the words leave out are stated after them. A field of amounts holds two
        # fields of the goal for each color, its name and its count; other words leave out none.
        colors_said = stated_counts(words) or len(fields)
        for at in range(colors_said, len(fields) // 2):
            phrases.append(self.phrase(amount_text("counts", at)))

        hidden = hidden_fields(words, fields)
        for field in fields:
            self._terms[field] = Term("same", self._said.operands(field))
        for field in hidden:
            self._terms[field] = hidden_term(field, words, remark, self._said)
        self._hidden.update(hidden)
        return listed(phrases)

    def _resolved(self, name: str, words: Text, scenario: Scenario) -> Text:
        """Return the words for a field of the command when it has to name its value.

        They are the scenario's own if it has any, or those that state the value, or else the same
        words, in which those that point back will be replaced.
        """
        own = scenario.texts.get(f"resolved.{name}")
        if own:
            return own[0]
        if self._is_stated(words, scenario):
            return self._words.stated[name]
        return words

    def _is_stated(self, words: Text, scenario: Scenario) -> bool:
        """Return whether the resolved form states the value for which some words stand."""
        way = all_settings()[scenario.fields.setting].offers
        if way not in _WAYS_BY_SIGHT:
            return way != "reasoning"
        fields = [value.field for value in self._request.goal_values]
        return all(pointer.of in fields for pointer in pointers_in(words))

    def meaning(self, command: Phrase) -> Meaning:
        """Return how the value of each field follows from what has been said.

        It also has the fields whose values the command alone gives, ``settled``: it names them, or
        their words do not point back.
        """
        fields = [value.field for value in self._request.goal_values]
        terms = {field: self._terms[field] for field in fields}
        settled = set(fields)
        if not self._request.resolved:
            settled -= self._hidden
        named_values = _named_values(command)
        for field in fields:
            if self._introduced.referent(field) in named_values:
                settled.add(field)
        return Meaning(terms, frozenset(settled), agrees=dict(self._agrees))

    def command(self, fields: Mapping[str, Phrase], lead: Phrase) -> Phrase:
        """Return the command with the words for some fields; all other fields state their values.

        The lead, words before it, comes first: *So, pick it up.* or *All right. Pick it up.*
        """
        skeleton = self._skeleton(fields)
        if lead:
            # After "So," the command goes on in small letters; after "All right." it does not.
            lead = _with_first_letter(lead, str.upper)
            is_sentence = lead[-1].text.endswith((". ", "! ", "? "))
            if not is_sentence and not _ALWAYS_CAPITAL.match(skeleton[0].text):
                skeleton = _with_first_letter(skeleton, str.lower)
        return (*lead, *skeleton)

    def _skeleton(self, fields: Mapping[str, Phrase]) -> Phrase:
        """Return a command of the task, filled with the words for its fields.

        Fields for which no words are given state their values: ``Pick up {color} {repeats}.`` with
        *it* for the color becomes *Pick it up twice*.
        """
        wanted = {value.field for value in self._request.goal_values}
        if self._request.values_of("amount"):
            wanted = {AMOUNT_FIELD}
        templates = self._commands_with(wanted)
        template = self._request.sampler.pick(f"command-{len(wanted)}", templates)
        words = dict(fields)
        for name in wanted - fields.keys():
            words[name] = self.field(name, self._words.stated[name])
        for name in wanted:
            if not words[name]:  # nothing is said of one: "put it back, then press the button"
                template = template.replace(f" {{{name}}}", "")
        filled = fill(template, words)
        return swap_particles(filled) if fields else filled

    def _commands_with(self, wanted: set[str]) -> list[str]:
        """Return the commands of the pool that have exactly the wanted fields as marks.

        For ``{"color", "repeats"}``: *Pick up {color} {repeats}.* Raises InvalidValueError if there
        is none.
        """
        pool = self._request.pool
        commands = [text for text in self._words.commands[pool] if _fields_in(text) == wanted]
        if not commands:
            marks = " and ".join(f"{{{name}}}" for name in sorted(wanted))
            raise InvalidValueError(
                f"{self._words.file} has no command of {self._request.task.name} with {marks} in "
                f"the pool {pool}."
            )
        return commands

    def neutral(self, scenario: Scenario) -> Iterator[Phrase]:
        """Yield remarks for ever: the scenario's own in any order, then those about anything."""
        own = scenario.texts.get("distractors", ())
        in_any_order = self._request.sampler.cycle("own distractor", own)
        yield from map(self.phrase, itertools.islice(in_any_order, len(own)))
        known = general().distractors[self._request.pool]
        yield from map(plain, self._request.sampler.cycle("distractor", known))

    def competing(self, scenario: Scenario) -> Iterator[Phrase]:
        """Return remarks about values that are not meant, in any order and for ever.

        They are those of the scenario, each with every such value for which it has a slot.

        Raises:
            LookupError: none of them has a value for all of its slots.
        """
        texts = scenario.texts["competing"]
        remarks: dict[Phrase, None] = {}  # each once, in order
        for text in texts:
            slots = set(slots_in(text))
            for values in rival_values(self._request, self._introduced):
                if slots <= values.values.keys():
                    remarks[self.phrase(text, values)] = None
        if not remarks:
            said = itertools.chain.from_iterable(map(slots_in, texts))
            lacking = sorted(set(said) - self._introduced.values.keys())
            raise LookupError(f"a competing remark with a value for {' or '.join(lacking)}")
        return self._request.sampler.cycle("competing distractor", list(remarks))


@functools.cache  # of the same few for every episode
def _fields_in(command: str) -> frozenset[str]:
    """Return the fields that a command says."""
    return frozenset(slots_in(parse(command)))


def _named_values(words: Phrase) -> set[PointedValue]:
    """Return the values that words name, each with its slot."""
    found: set[PointedValue] = set()
    for piece in words:
        if piece.tag and piece.tag.role == "antecedent":
            found.add(PointedValue(piece.tag.slot, piece.tag.value))
    return found


def _with_first_letter(words: Phrase, case: Callable[[str], str]) -> Phrase:
    """Return words whose first letter is made a capital, or small."""
    first, *rest = words
    text = case(first.text[:1]) + first.text[1:]
    return (first._replace(text=text), *rest)
