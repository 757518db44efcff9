"""Say an episode: explicit states the goal, any other setting chooses a scenario and says it.

- *setting*: how the goal is said, ``direct``; *request*: an episode, to be said in a setting.
- *scenario*: a template with slots for values: *{person} likes {color}. Lift it.* Chosen with it is
  a content plan: which words of the command are pronouns.
- *stage*: an utterance of the setting contextual between introduction and command, by its number.
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
from roboirg.language.scenarios.choice import ScenarioChoice, choose, explain_misfit
from roboirg.language.scenarios.declared import ChoosingRemark
from roboirg.language.scenarios.fillers import Fillers, goal_fillers
from roboirg.language.scenarios.literals import literal_refusal, say_literal
from roboirg.language.scenarios.markup import Text, pointers_in
from roboirg.language.scenarios.realizer import Realizer
from roboirg.language.scenarios.scenario import Scenario, TaskScenarios
from roboirg.language.scenarios.wording_store import task_words
from roboirg.language.scenarios.written import excerpt
from roboirg.language.settings import EXPLICIT, all_settings
from roboirg.language.settings.setting import Setting
from roboirg.tasks import Task

_CONTEXTUAL = "contextual"
_DISTRACTOR = 3
_STAGES: Mapping[int, UtteranceStage] = {2: "reinforcement", _DISTRACTOR: "distractor", 4: "cue"}
"""By number: those between introduction and command."""


class _CachedChoice(NamedTuple):
    """What a setting says of an episode, or why it says nothing.

    Attributes:
        episode: for which the choice was made, with its goal.
        chosen: the scenario with its slots filled; None if the setting refuses.
        log: the draws that led to it; they belong to the metadata of each instruction.
        refusal: why nothing is said; None exactly if something is.
    """

    episode: Episode
    chosen: ScenarioChoice | None
    log: list[str]
    refusal: str | None


_CHOICES: dict[tuple[object, ...], _CachedChoice] = {}
"""All forms and stages of an episode say the same, and a split is said again and again."""
_MOST_CHOICES = 256


def refusal(request: InstructionRequest) -> str | None:
    """Return why an episode cannot be said in its setting; None if it can.

    *nothing to see in this scene singles out a slot's value*, *words.toml has no direct scenario
    for it …*: there may be no words for the task, or no scenario that fits, or the setting itself
    refuses the episode. The text is the end of a sentence, without a stop.
    """
    setting = _setting_of(request)
    words = _find_words(request)
    is_explicit = setting.content_plans == EXPLICIT
    if words is not None and words.literals and is_explicit:
        return literal_refusal(request, words)  # whole sentences need no commands
    if words is None or not words.commands:
        return _no_words(request.task, setting)
    if is_explicit:
        return setting.refusal(request)
    return _choose(request).refusal


def _no_words(task: Task, setting: Setting) -> str:
    """Return why there are no words of a task in a setting: *PickXtimes is not among the tasks …*.

    Either the file that the setting or the task names does not serve the task, or none is named.
    """
    file = setting.words or task.words
    if file:
        return f"{task.name} is not among the tasks of {file}"
    return f"{task.name} names no file of words (write one, see docs/add-task.md)"


def say(request: InstructionRequest) -> InstructionSpec:
    """Return the words of an episode in its setting, with their meaning.

    In the explicit setting they are a command that states the goal, *Pick up the red cube twice.*,
    or a whole sentence if a wording file has them; in any other setting they are a scenario's.
    `refusal` must have returned None for the request.
    """
    words = cast("TaskScenarios", _find_words(request))
    if _setting_of(request).content_plans != EXPLICIT:
        choice = _choose(request)
        request.sampler.log.extend(choice.log)
        return say_chosen(request, words, cast("ScenarioChoice", choice.chosen))
    if words.literals:
        return say_literal(request, words)
    return say_explicit(request, words)


def _setting_of(request: InstructionRequest) -> Setting:
    """Return the setting in which an episode is to be said."""
    return all_settings()[request.options.setting]


def _find_words(request: InstructionRequest) -> TaskScenarios | None:
    """Return the commands and scenarios of a task in a setting; None if there is no file of them.

    An open wording file comes before our own files.
    """
    return task_words(request.task.name, request.options.setting, request.options.wordings)


def _choose(request: InstructionRequest) -> _CachedChoice:
    """Return the scenario that a setting says of an episode, or why it says nothing; cached.

    All forms of an instruction say the same, so one choice serves them. The key has everything on
    which the choice depends but the goal, so the cached episode is compared, too. A full cache is
    emptied.
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
    return "direct" if setting.content_plans == _CONTEXTUAL else setting.name


def _choose_anew(request: InstructionRequest, setting: Setting) -> _CachedChoice:
    """Draw the scenario that a setting says of an episode, or find out why it says nothing.

    A scenario is a template for a text; one is drawn among those of the setting in the pool of
    words, ``train`` or ``test``. The log of the request stays as it is: the draws are in the log of
    the result, and those of a refusal in none.
    """
    # A refusal may draw, but its draws are not those of the words: they go to a log of their own.
    reason = setting.refusal(_with_log(request, []))
    if reason is not None:
        return _CachedChoice(request.episode, None, [], reason)
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
            why = explain_misfit(_with_log(request, []), scenario_setting, scenarios)
            reason += f": {why}"
    return _CachedChoice(request.episode, chosen, log, reason)


def _with_log(request: InstructionRequest, log: list[str]) -> InstructionRequest:
    """Return a request that draws the same, and notes its draws in another log."""
    return replace(request, sampler=replace(request.sampler, log=log))


def say_explicit(request: InstructionRequest, words: TaskScenarios) -> InstructionSpec:
    """Return a command of the task that states the goal, *Pick up the red cube twice*."""
    realizer = Realizer(request, words, Fillers(goal_fillers(request)))
    command = realizer.realize_command({}, ())
    return InstructionSpec((UtteranceSpec("command", command),), realizer.meaning(command))


def say_chosen(
    request: InstructionRequest, words: TaskScenarios, chosen: ScenarioChoice
) -> InstructionSpec:
    """Return the words of a scenario whose slots have been filled for an episode.

    Args:
        request: the episode.
        words: of its task, for the command.
        chosen: what `choose` returned for the request.

    Raises:
        InvalidValueError: the scenario names a slot that has no value in the episode.
    """
    try:
        return _scenario_words(request, words, chosen)
    except LookupError as error:
        raise InvalidValueError(
            f"{words.file}, scenario {excerpt(chosen.scenario.fields.frame)}, lacks {error} in "
            "this episode."
        ) from error


def _scenario_words(
    request: InstructionRequest, words: TaskScenarios, chosen: ScenarioChoice
) -> InstructionSpec:
    """Return the utterances of a filled scenario, with what they mean and notes for the metadata.

    They are realized in the order of speaking, as words can point back only at what was said:
    introduction, the stages that are asked for, command. Raises LookupError if the scenario names a
    slot that has no value in the episode.
    """
    scenario = chosen.scenario
    realizer = Realizer(request, words, chosen.fillers, scenario)
    introduction = realizer.realize(scenario.text("introduction"))
    utterances = [UtteranceSpec("introduction", introduction)]
    notes: dict[str, object] = {**chosen.plan.notes, "scenario": scenario.fields.frame}
    if _setting_of(request).content_plans == _CONTEXTUAL:
        utterances += _stages(request, realizer, scenario)
        notes |= _stage_notes(request.options)
    command = _command(request, realizer, chosen)
    utterances.append(UtteranceSpec("command", command))
    return InstructionSpec(tuple(utterances), realizer.meaning(command), notes)


def _stage_notes(options: InstructionOptions) -> dict[str, object]:
    """Return the metadata entries for the stages of contextual: ``{"stages": [1, 2, 5]}``.

    With distracting remarks, also their kind and number.
    """
    notes: dict[str, object] = {"stages": list(options.stages)}
    if _DISTRACTOR in options.stages:
        notes |= {"distractor": options.distractor, "distractors": options.distractors}
    return notes


def _command(request: InstructionRequest, realizer: Realizer, chosen: ScenarioChoice) -> Phrase:
    """Return the last utterance, such as *So, pick it up twice*.

    It has the words before the command, *So,*, then a command of the task with the scenario's
    words, *it*, in its fields. The draws come in the order of the code, which has to stay.
    """
    field_words = {}
    for name in chosen.scenario.said:
        texts = chosen.scenario.texts[f"say.{name}"]
        field_words[name] = request.sampler.pick(f"{name} words", texts)

    # The lead is said before the fields, which can point back at what it names.
    realizer.begin_command()
    lead = _lead(request, chosen)
    lead_words = realizer.realize(lead.text, resolved=request.resolved)
    fields = {}
    for name, text in field_words.items():
        fields[name] = realizer.realize_field(name, text, lead.remark)
    return realizer.realize_command(fields, lead_words)


class _Lead(NamedTuple):
    """The words before the command, such as *So, let's skip the former*.

    Attributes:
        text: the words.
        remark: what in them chooses one of two values, *the former*; None if nothing does.
    """

    text: Text
    remark: ChoosingRemark | None = None


def _lead(request: InstructionRequest, chosen: ScenarioChoice) -> _Lead:
    """Return the words before the command of a scenario, *So,*.

    If the content plan asks for a remark that chooses one of two values, *Let's skip the former*,
    one is drawn and comes after *So,*. The resolved form names what is meant, so a scenario may
    have a lead for it that needs no remark.
    """
    scenario = chosen.scenario
    if request.resolved and "resolved.lead" in scenario.texts:
        return _Lead(scenario.text("resolved.lead"))
    lead = scenario.text("lead")
    remark = chosen.plan.remark
    if not remark:
        return _Lead(lead)
    text = request.sampler.pick("remark", scenario.texts[f"remarks.{remark}"])
    pointer = next(pointers_in(text))
    sets_aside = remark.startswith("not_")
    return _Lead((*lead, *text), ChoosingRemark(pointer, sets_aside))


def _stages(
    request: InstructionRequest, realizer: Realizer, scenario: Scenario
) -> Iterator[UtteranceSpec]:
    """Yield the utterances between introduction and command, as far as the options ask for them.

    For the stages (1, 3, 4, 5): the distracting remarks, stage 3, each an utterance, and the cue,
    stage 4. Stages 1 and 5 are introduction and command.
    """
    for number, stage in _STAGES.items():
        if number not in request.options.stages:
            continue
        if number != _DISTRACTOR:
            yield UtteranceSpec(stage, realizer.realize(scenario.text(stage)))
            continue
        for remark in _distractors(request.options, realizer, scenario):
            yield UtteranceSpec(stage, remark)


def _distractors(
    options: InstructionOptions, realizer: Realizer, scenario: Scenario
) -> Iterator[Phrase]:
    """Yield distracting remarks, as many as the options ask for.

    They are neutral, *Did you hear that thunder?*, or ``competing``: they name values that are not
    meant, *Blue is out of fashion.*
    """
    remarks = realizer.neutral_remarks(scenario)
    if options.distractor == "competing":
        remarks = realizer.competing_remarks(scenario)
    return itertools.islice(remarks, options.distractors)
