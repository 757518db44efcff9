"""Say an episode: explicit states the goal, any other setting chooses a scenario and says it.

- *choice*: what a setting says of an episode, and the draws that led to it; or its refusal.
- *stage*: an utterance of contextual between introduction and command, known by its number.
- *lead*: the words before the command, *So,*; a remark that chooses one of two values ends it.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple, cast

from roboirg.core.episode import Episode
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import outside_words
from roboirg.language.instruction import UtteranceStage
from roboirg.language.phrases import Phrase
from roboirg.language.request import InstructionRequest, InstructionSpec, UtteranceSpec
from roboirg.language.scenarios.choice import Chosen, choose, misfit
from roboirg.language.scenarios.declared import ChoosingRemark
from roboirg.language.scenarios.introduced import Introduced, goal_values
from roboirg.language.scenarios.literals import literal_refusal, say_literal
from roboirg.language.scenarios.markup import Text, pointers_in
from roboirg.language.scenarios.scenario import Scenario, TaskScenarios
from roboirg.language.scenarios.speech import Speech
from roboirg.language.scenarios.wording_store import task_words
from roboirg.language.scenarios.written import shown
from roboirg.language.settings import EXPLICIT, all_settings
from roboirg.language.settings.setting import Setting
from roboirg.tasks import Task

_CONTEXTUAL = "contextual"
_DISTRACTOR = 3
_STAGES: Mapping[int, UtteranceStage] = {2: "reinforcement", _DISTRACTOR: "distractor", 4: "cue"}
"""By number: those between introduction and command."""


class _Choice(NamedTuple):
    """What is said of an episode; the draws that led to it, or why there is nothing.

    Attributes:
        episode: the episode.
        chosen: what is said; None if the setting refuses.
        log: the draws.
        refusal: why there is nothing; None if there is something.
    """

    episode: Episode
    chosen: Chosen | None
    log: list[str]
    refusal: str | None


_CHOICES: dict[tuple[object, ...], _Choice] = {}
"""All forms and stages of an episode say the same, and a split is said again and again."""
_MOST_CHOICES = 256


def refusal(request: InstructionRequest) -> str | None:
    """Return why a setting, a way to say the goal, cannot express an episode; None if it can.

    It may lack words of the task, exclude the episode, or have no scenario that fits it.
    """
    setting = _setting_of(request)
    words = _find_words(request)
    is_explicit = setting.offers == EXPLICIT
    if words is not None and words.literals and is_explicit:
        return literal_refusal(request, words)  # whole sentences need no commands
    if words is None or not words.commands:
        return _no_words(request.task, setting)
    if is_explicit:
        return setting.refusal(request)
    return _choose(request).refusal


def _no_words(task: Task, setting: Setting) -> str:
    """Return why there are no words of a task in a setting."""
    file = setting.words or task.words
    if file:
        return f"{task.name} is not among the tasks of {file}"
    return f"{task.name} names no file of words (write one, see docs/add-task.md)"


def say(request: InstructionRequest) -> InstructionSpec:
    """Return the words of an episode in a setting, a way to say the goal, that does not refuse it.

    They are a scenario's, a whole sentence of a wording file, or a command that states the goal.
    """
    words = cast("TaskScenarios", _find_words(request))
    if _setting_of(request).offers != EXPLICIT:
        choice = _choose(request)
        request.sampler.log.extend(choice.log)
        return say_chosen(request, words, cast("Chosen", choice.chosen))
    if words.literals:
        return say_literal(request, words)
    return say_explicit(request, words)


def _setting_of(request: InstructionRequest) -> Setting:
    return all_settings()[request.options.setting]


def _find_words(request: InstructionRequest) -> TaskScenarios | None:
    """Return the words of a task in a setting; None if nothing has been written."""
    return task_words(request.task.name, request.options.setting, request.options.wordings)


def _choose(request: InstructionRequest) -> _Choice:
    """Return what a setting says of an episode, or why it says nothing; cached.

    All forms of an instruction say the same, so that one choice serves them. A cached choice counts
    only for the same episode, with its goal.
    """
    setting = _setting_of(request)
    key = (
        # What can be said:
        _scenario_setting(setting),
        setting.words,
        setting.refusal,
        outside_words(request.options.wordings),
        request.pool,
        # What is drawn and seen:
        request.sampler.key,
        request.frame,
    )
    cached_choice = _CHOICES.get(key)
    # The sampler's key has task and seed: the same scene with another goal is another episode.
    if cached_choice is not None and cached_choice.episode == request.episode:
        return cached_choice
    if len(_CHOICES) >= _MOST_CHOICES:
        _CHOICES.clear()
    choice = _choose_anew(request, setting)
    _CHOICES[key] = choice
    return choice


def _scenario_setting(setting: Setting) -> str:
    """Return the name of the setting whose scenarios are said: contextual says those of direct."""
    return "direct" if setting.offers == _CONTEXTUAL else setting.name


def _choose_anew(request: InstructionRequest, setting: Setting) -> _Choice:
    """Return what a setting says of an episode, with the draws noted; or why it says nothing.

    A scenario is what a person says of the task, with slots for values; one of the setting's
    scenarios for the pool of words is drawn.
    """
    # A refusal may draw, but its draws are not those of the words: they go to a log of their own.
    reason = setting.refusal(_with_log(request, []))
    if reason is not None:
        return _Choice(request.episode, None, [], reason)
    words = cast("TaskScenarios", _find_words(request))
    scenario_setting = _scenario_setting(setting)
    scenarios = [
        scenario
        for scenario in words.scenarios
        if scenario.fields.setting == scenario_setting and scenario.fields.is_in(request.pool)
    ]
    log: list[str] = []
    chosen = choose(_with_log(request, log), scenario_setting, scenarios)
    if chosen is None:
        file_name = setting.words or words.file
        reason = f"{file_name} has no {scenario_setting} scenario for it in the pool {request.pool}"
        if scenarios:
            reason += f": {misfit(_with_log(request, []), scenario_setting, scenarios)}"
    return _Choice(request.episode, chosen, log, reason)


def _with_log(request: InstructionRequest, log: list[str]) -> InstructionRequest:
    """Return a request that notes its draws in a log."""
    return replace(request, sampler=replace(request.sampler, log=log))


def say_explicit(request: InstructionRequest, words: TaskScenarios) -> InstructionSpec:
    """Return a command that states the goal."""
    speech = Speech(request, words, Introduced(goal_values(request)))
    command = speech.command({}, ())
    return InstructionSpec((UtteranceSpec("command", command),), speech.meaning(command))


def say_chosen(
    request: InstructionRequest, words: TaskScenarios, chosen: Chosen
) -> InstructionSpec:
    """Return the words of a scenario.

    Raises:
        InvalidValueError: it speaks of what has no value in the episode.
    """
    try:
        return _scenario_words(request, words, chosen)
    except LookupError as error:
        raise InvalidValueError(
            f"{words.file}, scenario {shown(chosen.scenario.fields.frame)}, lacks {error} in "
            "this episode."
        ) from error


def _scenario_words(
    request: InstructionRequest, words: TaskScenarios, chosen: Chosen
) -> InstructionSpec:
    """Return the utterances of a scenario, with what they mean and notes for the metadata.

    First the introduction, then the stages that are asked for, if any, and the command. Raises
    LookupError if the scenario speaks of what has no value in the episode.
    """
    scenario = chosen.scenario
    speech = Speech(request, words, chosen.introduced, scenario)
    utterances = [UtteranceSpec("introduction", speech.phrase(scenario.text("introduction")))]
    notes: dict[str, object] = {**chosen.offer.notes, "scenario": scenario.fields.frame}
    if _setting_of(request).offers == _CONTEXTUAL:
        utterances += _stages(request, speech, scenario)
        notes |= _stage_notes(request.options)
    command = _command(request, speech, chosen)
    utterances.append(UtteranceSpec("command", command))
    return InstructionSpec(tuple(utterances), speech.meaning(command), notes)


def _stage_notes(options: InstructionOptions) -> dict[str, object]:
    """Return the entries of the metadata for the stages that are asked for."""
    notes: dict[str, object] = {"stages": list(options.stages)}
    if _DISTRACTOR in options.stages:
        notes |= {"distractor": options.distractor, "distractors": options.distractors}
    return notes


def _command(request: InstructionRequest, speech: Speech, chosen: Chosen) -> Phrase:
    """Return the last utterance, such as *So, pick it up twice*.

    It has the words before the command, *So,*, then a command of the task with the scenario's
    words, *it*, in its fields.
    """
    field_words: dict[str, Text] = {}
    for name in chosen.scenario.said:
        texts = chosen.scenario.texts[f"say.{name}"]
        field_words[name] = request.sampler.pick(f"{name} words", texts)

    # The lead is said before the fields, which can point back at what it names.
    speech.begin_command()
    lead = _lead(request, chosen)
    lead_words = speech.phrase(lead.text, resolved=request.resolved)
    fields: dict[str, Phrase] = {}
    for name, text in field_words.items():
        fields[name] = speech.field(name, text, lead.remark)
    return speech.command(fields, lead_words)


class _Lead(NamedTuple):
    """The words before the command, and the remark in them that chooses, if one does."""

    text: Text
    remark: ChoosingRemark | None = None


def _lead(request: InstructionRequest, chosen: Chosen) -> _Lead:
    """Return the words before the command of a scenario, *So,*, with the remark in them if any.

    If a remark is to choose one of two values, *Let's skip the former*, one is drawn and comes
    after *So,*. In the resolved form, which names what is meant, no remark is needed.
    """
    scenario = chosen.scenario
    if request.resolved and "resolved.lead" in scenario.texts:
        # It names what is meant, so no remark has to choose.
        return _Lead(scenario.text("resolved.lead"))
    lead = scenario.text("lead")
    remark = chosen.offer.remark
    if not remark:
        return _Lead(lead)
    text = request.sampler.pick("remark", scenario.texts[f"remarks.{remark}"])
    pointer = next(pointers_in(text))
    sets_aside = remark.startswith("not_")
    return _Lead((*lead, *text), ChoosingRemark(pointer, sets_aside))


def _stages(
    request: InstructionRequest, speech: Speech, scenario: Scenario
) -> Iterator[UtteranceSpec]:
    """Yield the utterances between introduction and command, as far as they are asked for.

    The options have the numbers of these stages. One of them has several remarks that do not
    matter; each is an utterance.
    """
    for number, stage in _STAGES.items():
        if number not in request.options.stages:
            continue
        if number != _DISTRACTOR:
            yield UtteranceSpec(stage, speech.phrase(scenario.text(stage)))
            continue
        for remark in _distractors(request.options, speech, scenario):
            yield UtteranceSpec(stage, remark)


def _distractors(
    options: InstructionOptions, speech: Speech, scenario: Scenario
) -> Iterator[Phrase]:
    """Yield remarks that do not matter, as many as are asked for.

    They are neutral, or speak of values other than those that are meant (``competing``).
    """
    remarks = speech.neutral(scenario)
    if options.distractor == "competing":
        remarks = speech.competing(scenario)
    return itertools.islice(remarks, options.distractors)
