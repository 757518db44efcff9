"""Say a scenario: its sentences with values and people filled in, and the command after a lead."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple, cast

from roboirg.core.episode import Episode
from roboirg.core.errors import InvalidValueError
from roboirg.core.word_pools import outside_words
from roboirg.language.instruction import REFERENCE, Expression, Meaning, Term, UtteranceStage
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
from roboirg.language.request import (
    AMOUNT_FIELD,
    InstructionRequest,
    InstructionSpec,
    UtteranceSpec,
)
from roboirg.language.scenarios.amounts import (
    NUMBERS,
    amount_text,
    amount_texts,
    hidden_fields,
    hidden_term,
    stated_counts,
)
from roboirg.language.scenarios.choice import Chosen, choose, rival_values
from roboirg.language.scenarios.declared import ChoosingRemark, SaidValues
from roboirg.language.scenarios.introduced import Introduced, goal_values
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
from roboirg.language.scenarios.wording_store import task_words
from roboirg.language.settings import all_settings, contextual
from roboirg.language.settings.setting import Setting

_EXPLICIT, _CONTEXTUAL, _DIRECT = "explicit", "contextual", "direct"
_STAGES: Mapping[int, UtteranceStage] = {
    contextual.REINFORCEMENT: "reinforcement",
    contextual.DISTRACTOR: "distractor",
    contextual.CUE: "cue",
}
_FOLLOWING = ("reasoning", "spatial", "grounded")
"""Ways to the goal that the resolved form keeps; it states the value of others."""


class _Choice(NamedTuple):
    """What is said of an episode; the draws that led to it, or why there is nothing."""

    episode: Episode
    chosen: Chosen | None
    log: list[str]
    refusal: str | None


_CHOICES: dict[tuple[object, ...], _Choice] = {}
"""All forms and stages of an episode say the same, and a split is said again and again."""
_MOST_CHOICES = 256


def _choose(request: InstructionRequest) -> _Choice:
    """Return what a setting says of an episode; no choice if it refuses."""
    setting = all_settings()[request.options.setting]
    # Contextual says the scenarios of direct.
    name = _DIRECT if setting.offers == _CONTEXTUAL else setting.name
    sampler = request.sampler
    wordings = outside_words(request.options.wordings)
    key = (name, setting.words, sampler.key, request.frame, request.pool, wordings)
    found = _CHOICES.get(key)
    if found is None or found.episode != request.episode:
        if len(_CHOICES) >= _MOST_CHOICES:
            _CHOICES.clear()
        log: list[str] = []
        reason, chosen = setting.refusal(request), None
        if reason is None:
            words = _words(request)
            known = [
                scenario
                for scenario in words.scenarios
                if scenario.fields.setting == name and scenario.fields.pool in (None, request.pool)
            ]
            chosen = choose(replace(request, sampler=replace(sampler, log=log)), name, known)
            if chosen is None:
                file = setting.words or words.file
                reason = f"{file} has no {name} scenario for it in the pool {request.pool}"
        found = _CHOICES[key] = _Choice(request.episode, chosen, log, reason)
    return found


def _words(request: InstructionRequest) -> TaskScenarios:
    """Return the words of a task that has some."""
    return cast("TaskScenarios", _find_words(request))


def _find_words(request: InstructionRequest) -> TaskScenarios | None:
    """Return the words of a task in a setting; None if nothing has been written."""
    return task_words(request.task.name, request.options.setting, request.options.wordings)


def refusal(request: InstructionRequest) -> str | None:
    """Return why a setting cannot express an episode; None if it can."""
    task, setting = request.task, all_settings()[request.options.setting]
    words = _find_words(request)
    if words is None or not words.commands:  # whole sentences serve explicit alone
        file = setting.words or task.words
        if file:
            return f"{task.name} is not among the tasks of {file}"
        return f"language 4 has no scenarios of {task.name} yet"
    return None if setting.offers == _EXPLICIT else _choose(request).refusal


def say(request: InstructionRequest) -> InstructionSpec:
    """Return the words of an episode in a setting that does not refuse it."""
    words = _words(request)
    if all_settings()[request.options.setting].offers == _EXPLICIT:
        return say_explicit(request, words)
    choice = _choose(request)
    request.sampler.log.extend(choice.log)
    return say_chosen(request, words, cast("Chosen", choice.chosen))


def in_language_4(setting: Setting) -> Setting:
    """Return a setting that speaks in scenarios; the same if it offers them nothing to say."""
    return replace(setting, say=say, refusal=refusal) if setting.offers else setting


def say_explicit(request: InstructionRequest, words: TaskScenarios) -> InstructionSpec:
    """Return a command that states the goal."""
    speech = Speech(request, words, Introduced(goal_values(request)))
    command = UtteranceSpec("command", speech.command({}, ()))
    return InstructionSpec((command,), meaning=speech.meaning())


def say_chosen(
    request: InstructionRequest, words: TaskScenarios, chosen: Chosen
) -> InstructionSpec:
    """Return the words of a scenario."""
    scenario, options = chosen.scenario, request.options
    speech = Speech(request, words, chosen.introduced, scenario)
    utterances = [UtteranceSpec("introduction", speech.phrase(scenario.text("introduction")))]
    notes: dict[str, object] = {**chosen.introduced.notes, "scenario": scenario.fields.frame}
    if all_settings()[options.setting].offers == _CONTEXTUAL:
        utterances += _stages(request, speech, scenario)
        notes["stages"] = list(options.stages)
        if contextual.DISTRACTOR in options.stages:
            notes |= {"distractor": options.distractor, "distractors": options.distractors}
    said = {
        name: request.sampler.pick(f"{name} words", scenario.texts[f"say.{name}"])
        for name in scenario.said
    }
    speech.begin_command()
    lead, remark = _lead(request, chosen)
    before = speech.phrase(lead, resolved=request.resolved)
    fields = {name: speech.field(name, text, remark) for name, text in said.items()}
    command = speech.command(fields, before)
    utterances.append(UtteranceSpec("command", command))
    return InstructionSpec(tuple(utterances), notes, speech.meaning())


def _lead(request: InstructionRequest, chosen: Chosen) -> tuple[Text, ChoosingRemark | None]:
    """Return the words before the command, and the remark in them that chooses, if one does."""
    scenario = chosen.scenario
    if request.resolved and "resolved.lead" in scenario.texts:
        return scenario.text("resolved.lead"), None
    if not chosen.remark:
        return scenario.text("lead"), None
    text = request.sampler.pick("remark", scenario.texts[f"remarks.{chosen.remark}"])
    remark = ChoosingRemark(next(pointers_in(text)), chosen.remark.startswith("not_"))
    return (*scenario.text("lead"), *text), remark


def _stages(
    request: InstructionRequest, speech: Speech, scenario: Scenario
) -> Iterator[UtteranceSpec]:
    """Yield the stages between introduction and command that are asked for."""
    options = request.options
    remarks = speech.competing if options.distractor == "competing" else speech.neutral
    for number, stage in _STAGES.items():
        if number in options.stages:
            phrases: Iterable[Phrase] = [speech.phrase(scenario.text(stage))]
            if stage == "distractor":
                phrases = itertools.islice(remarks(scenario), options.distractors)
            yield from (UtteranceSpec(stage, phrase) for phrase in phrases)


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
        self._said = SaidValues(request.frame)
        self._terms: dict[str, Term] = {}
        self._hidden: set[str] = set()
        self._agrees: dict[str, bool] = {}

    def begin_command(self) -> None:
        """Forget with what the words before agree: the last utterance begins."""
        self._agrees.clear()

    def phrase(
        self, text: Text, introduced: Introduced | None = None, *, resolved: bool = False
    ) -> Phrase:
        """Return a sentence with its marks filled; resolved, pointers are replaced."""
        values = introduced or self._introduced
        pieces: list[TaggedText] = []
        for part in text:
            if isinstance(part, TaggedText):
                pieces.append(part)
            elif isinstance(part, Slot):
                pieces.extend(self._slot(part, values))
            elif isinstance(part, Agreement):
                is_one = values.count(part.controller) == 1
                self._agrees[part.controller] = is_one
                pieces.append(TaggedText(part.one if is_one else part.many))
                if part.controller == "step":  # *right before*, *two before*
                    self._said.add("step", values.values["step"])
            else:
                pieces.extend(self._named(part) if resolved else self._pointing(part))
        return tuple(piece for piece in pieces if piece.text)

    def _slot(self, slot: Slot, values: Introduced) -> Phrase:
        """Return the words for a slot; amounts are said color by color."""
        if slot.name in ("amounts", "reference") and "amounts" in values.values:
            texts = amount_texts(NUMBERS[slot.name], len(values.values["colors"]))
            return listed([self.phrase(text, values) for text in texts])
        self._said.add(slot.name, values.values[slot.name])
        return values.phrase(slot)

    def _pointing(self, pointer: Pointer) -> Phrase:
        """Return words that point back."""
        values, kind = self._introduced, cast("Expression", pointer.expression)
        if pointer.expression == "rank":
            values, kind = values.ranked(pointer.of, ordinals="ordinal" in pointer.words)
        words = words_of(self.phrase(pointer.parts, values))
        return anaphor(words, kind, values.referent(pointer.of))

    def _named(self, pointer: Pointer) -> Phrase:
        """Return words that name what a pointer stands for."""
        words = words_of(self.phrase(pointer.resolved or self._referent(pointer.of)))
        return antecedent(words, self._introduced.referent(pointer.of))

    def _referent(self, name: str) -> Text:
        """Return the words for what a slot stands for."""
        found = self._introduced.values[name]
        kind = found[0].kind if len(found) == 1 else "several"
        ends = {"color": f" {self._request.task.commands.colored}", "visit": "", "placement": ""}
        if kind in ends:
            return (TaggedText("the "), Slot(name), TaggedText(ends[kind]))
        return (Slot(name, "times" if kind == "number" and name != REFERENCE else None),)

    def field(self, name: str, words: Text, remark: ChoosingRemark | None = None) -> Phrase:
        """Return the words for a field of the command, resolved if these are asked for.

        A remark, if there is one, has chosen what they point at.
        """
        scenario = self._scenario
        if self._request.resolved and scenario:
            states = all_settings()[scenario.fields.setting].offers not in _FOLLOWING
            usual = self._words.stated[name] if states else words
            words = scenario.texts.get(f"resolved.{name}", (usual,))[0]
        phrase = self.phrase(words, resolved=self._request.resolved)
        fields = self._request.fields_in(name)
        # The colors that the words leave out are stated after them.
        left_out = range(stated_counts(words) or len(fields), len(fields) // 2)
        others = [self.phrase(amount_text("counts", at)) for at in left_out]
        hidden = hidden_fields(words, fields)
        self._hidden.update(hidden)
        for field in fields:
            term = Term("same", self._said.operands(field))
            if field in hidden:
                term = hidden_term(field, words, remark, self._said)
            self._terms[field] = term
        return listed([phrase, *others])

    def meaning(self) -> Meaning:
        """Return what has been said, of which some fields point back at what came before."""
        settled = set(self._terms)
        if not self._request.resolved:
            settled -= self._hidden
        return Meaning(dict(self._terms), frozenset(settled), agrees=dict(self._agrees))

    def command(self, fields: Mapping[str, Phrase], lead: Phrase) -> Phrase:
        """Return the command with the words for some fields; the others state their values."""
        skeleton = self._skeleton(fields)
        if lead:
            lead = _begun(lead, str.upper)
            ended = lead[-1].text.endswith((". ", "! ", "? "))
            skeleton = skeleton if ended else _begun(skeleton, str.lower)
        return (*lead, *skeleton)

    def _skeleton(self, fields: Mapping[str, Phrase]) -> Phrase:
        wanted = {value.field for value in self._request.goal_values}
        if self._request.values_of("amount"):
            wanted = {AMOUNT_FIELD}
        commands = self._words.commands[self._request.pool]
        possible = [command for command in commands if wanted == {*slots_in(parse(command))}]
        if not possible:
            marks = " and ".join(f"{{{name}}}" for name in sorted(wanted))
            raise InvalidValueError(
                f"{self._words.file} has no command of {self._request.task.name} with {marks} in "
                f"the pool {self._request.pool}."
            )
        template = self._request.sampler.pick(f"command-{len(wanted)}", possible)
        words = {
            name: fields.get(name) or self.field(name, self._words.stated[name]) for name in wanted
        }
        return swap_particles(fill(template, words)) if fields else fill(template, words)

    def neutral(self, scenario: Scenario) -> Iterator[Phrase]:
        """Yield remarks for ever: the scenario's own in any order, then those about anything."""
        own = scenario.texts.get("distractors", ())
        in_any_order = self._request.sampler.cycle("own distractor", own)
        yield from map(self.phrase, itertools.islice(in_any_order, len(own)))
        known = general().distractors[self._request.pool]
        yield from map(plain, self._request.sampler.cycle("distractor", known))

    def competing(self, scenario: Scenario) -> Iterator[Phrase]:
        """Yield the scenario's remarks about other values, in any order, for ever."""
        found = dict.fromkeys(
            self.phrase(text, values)
            for text in scenario.texts.get("competing", ())
            for values in rival_values(self._request, self._introduced)
            if set(slots_in(text)) <= set(values.values)
        )
        if not found:
            raise InvalidValueError("no competing remark has another value than the goal's")
        return self._request.sampler.cycle("competing distractor", list(found))


def _begun(words: Phrase, case: Callable[[str], str]) -> Phrase:
    first, *rest = words
    return (first._replace(text=case(first.text[:1]) + first.text[1:]), *rest)
