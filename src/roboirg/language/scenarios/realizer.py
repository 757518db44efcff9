"""Put a scenario into words: its sentences with the slots filled, and the command.

- *scenario*: a template, with sentences such as ``{person} likes {color}.`` and, for a field of the
  command, words such as ``<it color: it>``.
- *pointer*: words that point back (an anaphor), *it*, with the slot that they stand for.
- *lead*: the words before the command, *So,*.
- *hidden*: of a field for which the command says a pointer, so that the context has to give its
  value.
- *settled*: of a field whose value the command alone gives.
- *resolved form*: the same instruction with names in place of pointers, *Lift the red cube.*
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
    NOUNS,
    NUMBERS,
    amount_text,
    hidden_fields,
    hidden_term,
    stated_counts,
)
from roboirg.language.scenarios.choice import fillers_with_rival
from roboirg.language.scenarios.declared import ChoosingRemark, DiscourseHistory
from roboirg.language.scenarios.fillers import Fillers, ReferredValue
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

_PLANS_BY_SIGHT = ("spatial", "grounded")
"""Settings in which the scene gives a value; the resolved form says where to look."""
_ALWAYS_CAPITAL = re.compile(r"I\b|[A-Z]{2}")
"""*I*, *I'd*, and words in capitals: they stay as they are within a sentence."""


class Realizer:
    """Puts one scenario into words for one episode, and works out what they mean.

    It remembers what has been said, since pointers such as *it* can only mean what was said before.
    So its methods must be called in the order of the text: `realize` for the introduction and the
    remarks, `begin_command`, `realize` for the lead, `realize_field` for each field of the command,
    `realize_command`, and at last `meaning`.

    Args:
        request: the episode, and how to instruct it.
        words: of the task: its commands, and the words that state a value.
        fillers: of the slots that sentences can name.
        scenario: the template; None for a command alone.
    """

    def __init__(
        self,
        request: InstructionRequest,
        words: TaskScenarios,
        fillers: Fillers,
        scenario: Scenario | None = None,
    ) -> None:
        self._request = request
        self._words = words
        self._fillers = fillers
        self._scenario = scenario
        self._history = DiscourseHistory(request.frame)  # what all sentences so far have named
        self._terms: dict[str, Term] = {}  # how the value of each field so far follows
        self._hidden: set[str] = set()  # the fields for which the command says a pointer
        self._agrees: dict[str, bool] = {}  # by slot, whether the last utterance is in the singular

    def begin_command(self) -> None:
        """Begin the last utterance: only its words, singular or plural, count for the meaning."""
        self._agrees.clear()

    def realize(
        self, text: Text, fillers: Fillers | None = None, *, resolved: bool = False
    ) -> Phrase:
        """Return a sentence with its slots filled: *Red is nice* for ``{color} is nice``.

        What it names counts as said from now on, so that later sentences can point back at it.

        Args:
            text: the sentence, parsed.
            fillers: of its slots; None for those of the scenario.
            resolved: whether pointers are replaced by what they stand for, *it* by *the red cube*.
        """
        values = fillers or self._fillers
        pieces = []
        for part in text:
            if isinstance(part, TaggedText):
                pieces.append(part)
            elif isinstance(part, Slot):
                pieces.extend(self._filled_slot(part, values))
            elif isinstance(part, Agreement):
                pieces.append(self._singular_or_plural(part, values))
            elif resolved:
                pieces.extend(self._naming_words(part))
            else:
                pieces.extend(self._pointing_words(part))
        return tuple(piece for piece in pieces if piece.text)

    def _filled_slot(self, slot: Slot, fillers: Fillers) -> Phrase:
        """Return the words for a slot, and remember that it was said: *red* for ``{color}``.

        Where a goal counts cubes, ``{amounts}`` is said color by color: *two red cubes and one
        blue one*.
        """
        if slot.name in ("amounts", "reference") and "amounts" in fillers.values:
            phrases = []
            for at in range(len(fillers.values["colors"])):
                text = amount_text(NUMBERS[slot.name], at, NOUNS[at])
                phrases.append(self.realize(text, fillers))
            return listed(phrases)
        self._history.add(slot.name, fillers.values[slot.name])
        return fillers.phrase(slot)

    def _singular_or_plural(self, agreement: Agreement, fillers: Fillers) -> TaggedText:
        """Return the words in the singular or plural, and remember which, for the meaning.

        ``[repeats: lap|laps]`` is *laps* for two repeats.
        """
        controller = agreement.controller
        if controller == "step":  # *right before*, *two before*
            self._history.add("step", fillers.values["step"])
        is_single = fillers.count(controller) == 1
        self._agrees[controller] = is_single
        return TaggedText(agreement.one if is_single else agreement.many)

    def _pointing_words(self, pointer: Pointer) -> Phrase:
        """Return the words of a pointer, as a mention of what they stand for: *it*, the color red.

        For a rank, *the latter*, the position of its value in the list decides the words.
        """
        fillers = self._fillers
        expression = cast("Expression", pointer.expression)
        if pointer.expression == "rank":
            has_ordinal = "ordinal" in pointer.words  # ``{rank:ordinal}``
            fillers, expression = fillers.ranked(pointer.of, ordinals=has_ordinal)
        words = words_of(self.realize(pointer.parts, fillers))
        referent = fillers.referent(pointer.of)
        return anaphor(words, expression, referent.slot, referent.value)

    def _naming_words(self, pointer: Pointer) -> Phrase:
        """Return words that name what a pointer stands for, for the resolved form.

        *the red cube* in place of *it*. They are a mention that introduces the value.
        """
        text = pointer.resolved or self._text_in_place_of(pointer)
        referent = self._fillers.referent(pointer.of)
        return antecedent(words_of(self.realize(text)), referent.slot, referent.value)

    def _text_in_place_of(self, pointer: Pointer) -> Text:
        """Return a text, with slots, that names what a pointer such as *it* stands for.

        ``the {color} cube`` for a color. A place gets a noun, *the cube on the left*, unless it
        takes the place of *there*.
        """
        text = self._naming_text(pointer.of)
        kind = self._fillers.values[pointer.of][-1].kind
        if kind != "place" or pointer.expression == "there":
            return text
        noun = self._request.task.things.pointed.removeprefix("hidden_")
        return (TaggedText(f"the {noun} "), *text)

    def _naming_text(self, name: str) -> Text:
        """Return a text that names what a slot holds, with the slot in it.

        ``color`` gives ``the {color} cube``, ``visit`` gives ``the {visit}``, *the third*, and
        ``repeats`` gives ``{repeats:times}``, *twice*. For a placement or moment the task's own
        words are taken if it has any; anything else is the slot alone.
        """
        values = self._fillers.values[name]
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

    def realize_field(self, name: str, words: Text, remark: ChoosingRemark | None = None) -> Phrase:
        """Return the words for a field of the command, and remember what they mean.

        *it* for ``color``; in the resolved form, words that name the value may take their place.

        Args:
            name: of the field, ``color``.
            words: of the scenario, such as *it*, or those that state the value.
            remark: words before the command that have chosen what they point at, if any have.
        """
        if self._request.resolved and self._scenario:
            words = self._resolved_text(name, words, self._scenario)
        phrases = [self.realize(words, resolved=self._request.resolved)]
        fields = self._request.fields_in(name)
        # The colors that the words leave out are stated after them. A field of amounts holds two
        # fields of the goal for each color, its name and its count; other words leave out none.
        colors_said = stated_counts(words) or len(fields)
        for at in range(colors_said, len(fields) // 2):
            phrases.append(self.realize(amount_text("counts", at)))

        hidden = hidden_fields(words, fields)
        for field in fields:
            self._terms[field] = Term("same", self._history.operands(field))
        for field in hidden:
            self._terms[field] = hidden_term(field, words, remark, self._history)
        self._hidden.update(hidden)
        return listed(phrases)

    def _resolved_text(self, name: str, words: Text, scenario: Scenario) -> Text:
        """Return the words for a field of the command in the resolved form, which names its value.

        They are the scenario's own for this form if it has any, or those of the task that state the
        value, *the {color} cube*, or else the given words, whose pointers `realize` replaces.
        """
        own = scenario.texts.get(f"resolved.{name}")
        if own:
            return own[0]
        if self._is_stated(words, scenario):
            return self._words.stated[name]
        return words

    def _is_stated(self, words: Text, scenario: Scenario) -> bool:
        """Return whether the resolved form states the value of the goal in place of some words.

        In reasoning it does not: it names what the value follows from, *one fewer than three*. Nor
        for a place or another description, *the cube on the left*, which is named instead.
        """
        plans = all_settings()[scenario.fields.setting].content_plans
        if plans not in _PLANS_BY_SIGHT:
            return plans != "reasoning"
        fields = [value.field for value in self._request.goal_values]
        return all(pointer.of in fields for pointer in pointers_in(words))

    def meaning(self, command: Phrase) -> Meaning:
        """Return the meaning of all that has been said; call it last.

        After *Red is nice. Lift it twice.*: ``color`` is the same as *red*, ``repeats`` is 2, and
        ``repeats`` is settled, since the command alone gives it. Settled are the fields whose value
        the command names, and those for which it has no pointer such as *it*; in the resolved form
        all.

        Args:
            command: the last utterance.
        """
        fields = [value.field for value in self._request.goal_values]
        terms = {field: self._terms[field] for field in fields}
        settled = set(fields)
        if not self._request.resolved:
            settled -= self._hidden
        named_values = _named_values(command)
        for field in fields:
            if self._fillers.referent(field) in named_values:
                settled.add(field)
        return Meaning(terms, frozenset(settled), agrees=dict(self._agrees))

    def realize_command(self, fields: Mapping[str, Phrase], lead: Phrase) -> Phrase:
        """Return the command with the words for some fields; all other fields state their values.

        *So, pick it up.* or *All right. Pick it up.*

        Args:
            fields: the words for fields, *it* for ``color``.
            lead: words before the command, *So,*; may be empty.
        """
        command = self._filled_command(fields)
        if lead:
            # After "So," the command goes on in small letters; after "All right." it does not.
            lead = _with_first_letter(lead, str.upper)
            is_sentence = lead[-1].text.endswith((". ", "! ", "? "))
            if not is_sentence and not _ALWAYS_CAPITAL.match(command[0].text):
                command = _with_first_letter(command, str.lower)
        return (*lead, *command)

    def _filled_command(self, fields: Mapping[str, Phrase]) -> Phrase:
        """Draw a command of the task, and return it with the words for its fields.

        ``Pick up {color} {repeats}.`` with *it* for ``color`` becomes *Pick it up twice*: fields
        for which no words are given state their values.
        """
        wanted = {value.field for value in self._request.goal_values}
        if self._request.values_of("amount"):
            wanted = {AMOUNT_FIELD}
        templates = self._commands_with(wanted)
        template = self._request.sampler.pick(f"command-{len(wanted)}", templates)
        words = dict(fields)
        for name in wanted - fields.keys():
            words[name] = self.realize_field(name, self._words.stated[name])
        for name in wanted:
            if not words[name]:  # nothing is said of one: "put it back, then press the button"
                template = template.replace(f" {{{name}}}", "")
        filled = fill(template, words)
        return swap_particles(filled) if fields else filled

    def _commands_with(self, wanted: set[str]) -> list[str]:
        """Return the commands of the pool of words that have exactly the wanted fields.

        For ``{"color", "repeats"}``: ``["Pick up {color} {repeats}.", …]``.

        Raises:
            InvalidValueError: there is none.
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

    def neutral_remarks(self, scenario: Scenario) -> Iterator[Phrase]:
        """Yield distracting remarks that name no value, without end.

        The scenario's own come first, each once in an order that is drawn; then remarks about
        anything, again and again. They are drawn when they are asked for.
        """
        own = scenario.texts.get("distractors", ())
        in_any_order = self._request.sampler.cycle("own distractor", own)
        yield from map(self.realize, itertools.islice(in_any_order, len(own)))
        known = general().distractors[self._request.pool]
        yield from map(plain, self._request.sampler.cycle("distractor", known))

    def competing_remarks(self, scenario: Scenario) -> Iterator[Phrase]:
        """Return distracting remarks that name values that are not meant, without end.

        *Blue is out of fashion*, if red is meant. They are the scenario's, each with every such
        value for which it has a slot, again and again in an order that is drawn.

        Raises:
            LookupError: no remark has values for all of its slots.
        """
        texts = scenario.texts["competing"]
        remarks: dict[Phrase, None] = {}  # each once, in order
        for text in texts:
            slots = set(slots_in(text))
            for fillers in fillers_with_rival(self._request, self._fillers):
                if slots <= fillers.values.keys():
                    remarks[self.realize(text, fillers)] = None
        if not remarks:
            said = itertools.chain.from_iterable(map(slots_in, texts))
            lacking = sorted(set(said) - self._fillers.values.keys())
            raise LookupError(f"a competing remark with a value for {' or '.join(lacking)}")
        return self._request.sampler.cycle("competing distractor", list(remarks))


@functools.cache  # of the same few for every episode
def _fields_in(command: str) -> frozenset[str]:
    """Return the fields of a command: of ``Pick up {color}.``, ``{"color"}``."""
    return frozenset(slots_in(parse(command)))


def _named_values(words: Phrase) -> set[ReferredValue]:
    """Return the values that words name, each with its slot; those that they point at are none.

    Of *Lift it twice*: the repeats 2, and not the color.
    """
    found = set()
    for piece in words:
        if piece.tag and piece.tag.role == "antecedent":
            found.add(ReferredValue(piece.tag.slot, piece.tag.value))
    return found


def _with_first_letter(words: Phrase, case: Callable[[str], str]) -> Phrase:
    """Return words whose first letter is made a capital, or small, by `case`, ``str.upper``."""
    first, *rest = words
    text = case(first.text[:1]) + first.text[1:]
    return (first._replace(text=text), *rest)
