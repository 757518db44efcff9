"""Say a scenario: its sentences with values and people filled in, and the command after a lead."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple, cast

from roboirg.core.errors import InvalidValueError
from roboirg.core.word_pools import PoolName
from roboirg.language.instruction import REFERENCE, Expression
from roboirg.language.phrases import (
    Phrase,
    TaggedText,
    anaphor,
    antecedent,
    plain,
    swap_particles,
)
from roboirg.language.request import (
    InstructionRequest,
    InstructionSpec,
    NoCommandError,
    UtteranceSpec,
)
from roboirg.language.scenarios.choice import Chosen, choose, rival_values
from roboirg.language.scenarios.introduced import Introduced, IntroducedValue, goal_values
from roboirg.language.scenarios.markup import Agreement, Pointer, Slot, Text, parse, slots_in
from roboirg.language.scenarios.scenario import Scenario, TaskScenarios
from roboirg.language.scenarios.scenario_file import (
    PERSON,
    general,
    row_of,
    task_scenarios,
    type_of,
)
from roboirg.language.settings import all_settings, contextual
from roboirg.language.settings.setting import Setting

_EXPLICIT, _CONTEXTUAL, _DIRECT = "explicit", "contextual", "direct"
_STATING = ("direct", "direct-rival")
"""Settings whose resolved form states the value; the others keep how it follows."""


class _Choice(NamedTuple):
    """What was chosen last, for which words, and the draws that led to it."""

    key: tuple[object, ...]
    chosen: Chosen | None
    log: list[str]


_LAST: dict[str, _Choice] = {}
"""By setting: all forms and stages of an episode say the same, one after the other."""


def _last(request: InstructionRequest, name: str) -> _Choice | None:
    """Return the choice for a request if it was the last one."""
    last = _LAST.get(name)
    return last if last and last.key == _key(request) else None


def _key(request: InstructionRequest) -> tuple[object, ...]:
    own = request.wordings is None
    return (request.episode, request.sampler.key, request.frame, request.pool, own)


def _choose(request: InstructionRequest, name: str) -> _Choice:
    choice = _last(request, name)
    if choice is None:
        log: list[str] = []
        drawing = replace(request, sampler=replace(request.sampler, log=log))
        known = _known(request.task.name, name, request.pool)
        choice = _LAST[name] = _Choice(_key(request), choose(drawing, name, known), log)
    return choice


@functools.cache
def in_language_4(name: str) -> Setting:
    """Return a setting that speaks in scenarios."""
    setting, of = all_settings()[name], _DIRECT if name == _CONTEXTUAL else name

    def refusal(request: InstructionRequest) -> str | None:
        if task_scenarios(request.task.name) is None:
            return f"language 4 has no scenarios of {request.task.name} yet"
        reason = None if _last(request, of) else setting.refusal(request)
        if reason or name == _EXPLICIT or _choose(request, of).chosen:
            return reason
        return f"language 4 has no scenario for it in the pool {request.pool}"

    return replace(setting, say=lambda request: say(request, name, of), refusal=refusal)


def say(request: InstructionRequest, setting: str, of: str) -> InstructionSpec:
    """Return the words of an episode in a setting, which has scenarios of itself or of direct."""
    words = cast("TaskScenarios", task_scenarios(request.task.name))
    if setting == _EXPLICIT:
        speech = Speech(request, words, Introduced(goal_values(request)))
        return InstructionSpec((UtteranceSpec("command", speech.command({}, ())),))
    choice = _choose(request, of)
    request.sampler.log.extend(choice.log)
    return say_chosen(request, setting, words, cast("Chosen", choice.chosen))


@functools.cache
def _known(task: str, setting: str, pool: PoolName) -> tuple[Scenario, ...]:
    """Return the scenarios of a setting in a pool."""
    every = cast("TaskScenarios", task_scenarios(task)).scenarios
    return tuple(one for one in every if (one.fields.setting, one.fields.pool) == (setting, pool))


def say_chosen(
    request: InstructionRequest, setting: str, words: TaskScenarios, chosen: Chosen
) -> InstructionSpec:
    """Return the words of a scenario."""
    scenario, options = chosen.scenario, request.options
    speech = Speech(request, words, _with_people(request, chosen), scenario)
    utterances = [UtteranceSpec("introduction", speech.phrase(scenario.text("introduction")))]
    notes: dict[str, object] = {**chosen.introduced.notes, "scenario": scenario.fields.frame}
    if setting == _CONTEXTUAL:
        utterances += _stages(request, speech, scenario)
        notes["stages"] = list(options.stages)
        if contextual.DISTRACTOR in options.stages:
            notes |= {"distractor": options.distractor, "distractors": options.distractors}
    said = {scenario.said[0]: chosen.first}
    for name in scenario.said[1:]:
        said[name] = request.sampler.pick(f"{name} words", scenario.texts[f"say.{name}"])
    fields = {name: speech.field(name, text) for name, text in said.items()}
    command = speech.command(fields, _lead(request, chosen))
    return InstructionSpec((*utterances, UtteranceSpec("command", command)), notes)


def _lead(request: InstructionRequest, chosen: Chosen) -> Text:
    """Return the words before the command: the lead, and the remark that chooses."""
    scenario = chosen.scenario
    if request.resolved and "resolved.lead" in scenario.texts:
        return scenario.text("resolved.lead")
    if not chosen.remark:
        return scenario.text("lead")
    remark = request.sampler.pick("remark", scenario.texts[f"remarks.{chosen.remark}"])
    return (*scenario.text("lead"), *remark)


def _stages(
    request: InstructionRequest, speech: Speech, scenario: Scenario
) -> Iterator[UtteranceSpec]:
    """Yield the stages between introduction and command that are asked for."""
    stages, options = request.options.stages, request.options
    if contextual.REINFORCEMENT in stages:
        yield UtteranceSpec("reinforcement", speech.phrase(scenario.text("reinforcement")))
    if contextual.DISTRACTOR in stages:
        remarks = speech.competing if options.distractor == "competing" else speech.neutral
        for phrase in itertools.islice(remarks(scenario), options.distractors):
            yield UtteranceSpec("distractor", phrase)
    if contextual.CUE in stages:
        yield UtteranceSpec("cue", speech.phrase(scenario.text("cue")))


def _with_people(request: InstructionRequest, chosen: Chosen) -> Introduced:
    """Add two people, who are different, and their pronouns, to what is introduced."""
    if not chosen.scenario.people:
        return chosen.introduced
    people = chosen.scenario.people
    one = request.sampler.pick("person", people)
    other = request.sampler.pick("other person", [each for each in people if each is not one])
    added = {
        f"{slot}{number}": (IntroducedValue("", "person", word, word),)
        for number, words in (("", one), (".2", other))
        for slot, word in zip(PERSON, words, strict=True)
    }
    return chosen.introduced.with_values(**added)


class Speech:
    """The words of one scenario in one episode.

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
        self._request, self._words, self._introduced = request, words, introduced
        self._scenario = scenario
        self._listed = scenario.fields.list if scenario else ""

    def phrase(self, text: Text, introduced: Introduced | None = None) -> Phrase:
        """Return a sentence with its marks filled."""
        values = introduced or self._introduced
        pieces: list[TaggedText] = []
        for part in text:
            if isinstance(part, str):
                pieces.append(TaggedText(part))
            elif isinstance(part, Slot):
                pieces.extend(values.phrase(part))
            elif isinstance(part, Agreement):
                words = part.one if values.count(part.controller) == 1 else part.many
                pieces.append(TaggedText(words))
            else:
                pieces.extend(self._pointing(part))
        return tuple(piece for piece in pieces if piece.text)

    def _pointing(self, pointer: Pointer) -> Phrase:
        """Return words that point back."""
        values, kind = self._introduced, cast("Expression", pointer.expression)
        if pointer.expression == "rank":
            values, kind = values.ranked(pointer.of, ordinals="ordinal" in pointer.words)
        words = self._joined(self.phrase(pointer.parts, values))
        return anaphor(words, kind, *values.referent(pointer.of))

    def resolved(self, text: Text) -> Phrase:
        """Return words with the referent for every pointer."""
        pieces: list[TaggedText] = []
        for part in text:
            if not isinstance(part, Pointer):
                pieces.extend(self.phrase((part,)))
                continue
            slot, value = self._introduced.referent(part.of)
            row = row_of(text, part, type_of(part.of, self._listed))
            named = parse(row.resolved) if row and row.resolved else self._referent(part.of)
            pieces.extend(antecedent(self._joined(self.phrase(named)), slot, value))
        return tuple(pieces)

    def _referent(self, name: str) -> Text:
        """Return the words for what a slot stands for."""
        found = self._introduced.values[name]
        kind = found[0].kind if len(found) == 1 else "several"
        ends = {"color": f" {self._request.task.commands.colored}", "visit": "", "placement": ""}
        if kind in ends:
            return ("the ", Slot(name), ends[kind])
        return (Slot(name, "times" if kind == "number" and name != REFERENCE else None),)

    def field(self, name: str, words: Text) -> Phrase:
        """Return the words for a field of the command, resolved if these are asked for."""
        if not self._request.resolved:
            return self.phrase(words)
        scenario, own = self._scenario, f"resolved.{name}"
        if scenario and own not in scenario.texts and scenario.fields.setting in _STATING:
            return self.phrase(self._words.stated[name])
        return self.resolved(scenario.texts.get(own, (words,))[0] if scenario else words)

    def command(self, fields: Mapping[str, Phrase], lead: Text) -> Phrase:
        """Return the command with the words for some fields; the others state their values."""
        before = self.resolved(lead) if self._request.resolved else self.phrase(lead)
        if self._request.wordings is not None:
            skeleton = self._request.command(
                {name: self._outside(name, words) for name, words in fields.items()}
            )
        else:
            skeleton = self._skeleton(fields)
        if lead:
            before = _begun(before, str.upper)
            ended = self._joined(before).endswith((". ", "! ", "? "))
            skeleton = skeleton if ended else _begun(skeleton, str.lower)
        return (*before, *skeleton)

    def _skeleton(self, fields: Mapping[str, Phrase]) -> Phrase:
        wanted = frozenset(one.field for one in self._request.goal_values)
        possible = self._words.commands.get((self._request.pool, wanted))
        if possible is None:
            raise InvalidValueError(
                f"Language 4 has no command of {self._words.task} with the fields "
                f"{', '.join(sorted(wanted))}."
            )
        pieces: list[TaggedText] = []
        for part in self._request.sampler.pick(f"command-{len(wanted)}", possible):
            if not isinstance(part, Slot):
                pieces.extend(self.phrase((part,)))
            elif part.name in fields:
                pieces.extend(fields[part.name])
            else:
                pieces.extend(self.phrase(self._words.stated[part.name]))
        return swap_particles(tuple(pieces)) if fields else tuple(pieces)

    def _outside(self, name: str, words: Phrase) -> Phrase:
        """Return words for a field of a command from outside.

        They take the place of its core: *it* that of *the red cube* in *the container over it*.
        """
        outside, commands = self._request.outside_phrase(name), self._request.task.commands
        direct = self._scenario is None or self._scenario.fields.setting == _DIRECT
        if outside is None or (self._request.resolved and direct):
            return self._request.outside_stated(name)
        if name in {one.field for one in self._request.values_of("number")}:
            return words  # what stays around it is added to numbers later
        prefix = commands.by_color.removesuffix("{cube}")
        core = _without_prefix(words, prefix)
        if prefix and commands.thing not in outside.core:
            if core == words:
                raise NoCommandError
            words = core
        return self._request.around(name, words)

    def neutral(self, scenario: Scenario) -> Iterator[Phrase]:
        """Yield remarks: first the scenario's own, then those about anything, for ever."""
        yield from map(self.phrase, scenario.of_kind("distractors"))
        known = general().distractors[self._request.pool]
        yield from map(plain, self._request.sampler.cycle("distractor", known))

    def competing(self, scenario: Scenario) -> Iterator[Phrase]:
        """Yield the scenario's remarks about other values, in any order, for ever."""
        found = dict.fromkeys(
            self.phrase(text, values)
            for text in scenario.of_kind("competing")
            for values in rival_values(self._request, self._introduced)
            if set(slots_in(text)) <= set(values.values)
        )
        return self._request.sampler.cycle("competing distractor", list(found))

    @staticmethod
    def _joined(phrase: Phrase) -> str:
        return "".join(piece.text for piece in phrase)


def _begun(words: Phrase, case: Callable[[str], str]) -> Phrase:
    first, *rest = words
    return (first._replace(text=case(first.text[:1]) + first.text[1:]), *rest)


def _without_prefix(words: Phrase, prefix: str) -> Phrase:
    first, *rest = words
    if not prefix or not first.text.startswith(prefix):
        return words
    left = first.text.removeprefix(prefix)
    return (*((first._replace(text=left),) if left else ()), *rest)
