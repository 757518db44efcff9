"""Check scenarios: what their sentences may not say, and what they mean in every scene."""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import cast

from roboirg.apps.language_lab.scenarios.leaks import find_leaks
from roboirg.apps.language_lab.scenarios.sentence_rules import (
    blanked,
    broken_sentences,
    sentences_of,
)
from roboirg.apps.language_lab.scenarios.text_rules import broken_text
from roboirg.core.episode import SPLITS, Episode
from roboirg.core.errors import InvalidValueError
from roboirg.core.goal_slots import MOMENTS
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.plain_text import counted
from roboirg.core.word_pools import POOLS
from roboirg.language.generator import request_of, spoken_instruction
from roboirg.language.instruction import FORMS, Instruction, Meaning, Mention
from roboirg.language.meaning import field_values, meant_goals
from roboirg.language.request import InstructionRequest
from roboirg.language.scenarios.choice import ScenarioChoice, choose, explain_misfit
from roboirg.language.scenarios.literals import in_words
from roboirg.language.scenarios.markup import slots_in
from roboirg.language.scenarios.scenario import Scenario, TaskScenarios
from roboirg.language.scenarios.scenario_file import written_words
from roboirg.language.scenarios.spoken import say_chosen
from roboirg.language.settings import all_settings
from roboirg.language.token_counts import USUAL_LIMIT, tokens_of, tokens_shown
from roboirg.shortcuts.command_chance import goals_of_command, is_right
from roboirg.tasks import get_task, goals_of, with_goal
from roboirg.tasks.splits.splits import get_episode, split_episodes

RANDOM_SCENES = 200
"""Scenes of a task beyond the published ones."""
SHOWN = 3
"""Texts of a scenario that its report shows."""
_CHOOSING_CLASSES = ("former", "latter", "first", "second", "third", "other")
"""Classes of words that choose one of a list."""


@dataclass(slots=True)
class ScenarioReport:
    """What was found about a scenario, a text template.

    Attributes:
        scenario: the scenario.
        broken: the rules that it breaks, with the number of scenes in which it does.
        examples: for each broken rule one text; empty for a rule about the sentences as written.
        renderings: texts, from different scenes.
        competing: a text with a competing remark; empty if the setting has none.
        fitting: the keys of the scenes that it fits.
        open: number of these where its command alone leaves several goals.
        longest: the text with most tokens.
        resolved: those of its texts that are resolved forms.
    """

    scenario: Scenario
    broken: Counter[str] = field(default_factory=Counter)
    examples: dict[str, str] = field(default_factory=dict)
    renderings: list[str] = field(default_factory=list)
    competing: str = ""
    fitting: list[str] = field(default_factory=list)
    open: int = 0
    longest: str = ""
    resolved: set[str] = field(default_factory=set)

    def add(self, rule: str, text: str) -> None:
        """Count that a text breaks a rule, and keep the first such text as its example."""
        self.broken[rule] += 1
        self.examples.setdefault(rule, text)


@functools.cache
def scenes_of(task: str, random: int = RANDOM_SCENES) -> tuple[Episode, ...]:
    """Return all published episodes of a task, and as many random ones as are asked for."""
    sampled = [get_episode(task, "random", index) for index in range(random)]
    return (*split_episodes([task], SPLITS), *sampled)


def check_scenarios(
    words: TaskScenarios, name: str | None, scenes: Sequence[Episode]
) -> list[ScenarioReport]:
    """Return a report on each scenario (text template) of a task, checked in some scenes.

    Args:
        words: all words of the task in the scenarios' file.
        name: of the frame (the situation) whose scenarios are checked; None for all.
        scenes: episodes of the task; at least one.
    """
    reports = []
    for scenario in words.scenarios:
        if name in (None, scenario.fields.frame):
            reports.append(check_scenario(scenario, words, scenes))
    return reports


def check_scenario(
    scenario: Scenario, words: TaskScenarios, scenes: Sequence[Episode]
) -> ScenarioReport:
    """Return a report on a scenario, a text template: all rules that it breaks, with examples.

    Checked are its sentences as they are written, and its texts in every scene that it fits. It
    must fit some scene, and in at least one of them its command alone must leave the goal open.

    Args:
        scenario: to check.
        words: all words of the task in the scenario's file.
        scenes: episodes of the task; at least one.
    """
    report = ScenarioReport(scenario)
    first = scenes[0]
    for complaint in broken_sentences(scenario, get_task(first.task).things.pointed):
        report.add(complaint, "")
    for complaint in _in_both_pools(scenario, words):
        report.add(complaint, "")
    checker = _SceneChecker(report, words)
    for scene in scenes:
        checker.check(scene)
    too_long = length_complaint(report.longest)
    if too_long:
        report.add(too_long, report.longest)

    if not report.fitting:
        request = request_of(first, checker.usual)
        why = explain_misfit(request, scenario.fields.setting, [scenario])
        report.add(f"fits none of the scenes; in {first.key} {why}", "")
    elif not report.open:
        report.add("its command alone gives the goal in every scene", "")
    return report


def length_complaint(text: str) -> str:
    """Return a complaint if a text has more tokens than usual policies read; empty if it has not.

    ``needs 71 tokens; only 64 are heard``. A bound, which is not a number alone, is none.
    """
    shown = tokens_shown(text)
    if tokens_of(text) <= USUAL_LIMIT or not shown.isdecimal():
        return ""
    return f"needs {shown} tokens; only {USUAL_LIMIT} are heard"


class _SceneChecker:
    """Says a scenario, a text template, of scenes, and reports what is wrong with the texts.

    Args:
        report: of the scenario, to which all is added.
        words: of the task.

    Attributes:
        usual: the options with which the scenario is said; a scenario of direct is said in
            contextual, which has all of its sentences.
    """

    def __init__(self, report: ScenarioReport, words: TaskScenarios) -> None:
        self._report = report
        self._words = words
        fields = report.scenario.fields
        setting = "contextual" if fields.setting == "direct" else fields.setting
        self.usual = InstructionOptions(setting, wordings=fields.pool)

    def check(self, episode: Episode) -> None:
        """Check what the scenario says of an episode, and add what is found to the report.

        It is said in every form: implicit, and resolved, which names all values. In the spatial
        setting, sides are said as the robot sees them, and once more as the camera does. Nothing is
        added if it does not fit the episode.
        """
        try:
            instruction = self._check_texts(episode, self.usual)
            if self.usual.setting == "spatial":
                self._check_texts(episode, replace(self.usual, frame="camera"))
        except InvalidValueError as error:
            complaint = f"cannot be said: {str(error).rstrip('.')}"
            self._report.add(complaint, _key_with_goal(episode))
            return
        if instruction:
            self._add_fit(episode, implicit=instruction[0])

    def _add_fit(self, episode: Episode, implicit: Instruction) -> None:
        """Add a scene that the scenario fits to the report.

        Its key is added, and its text if too few are shown yet, of every third scene. It is counted
        if the command alone leaves the goal open. It is a broken rule if the scenario says the same
        of another goal of the scene.

        Args:
            episode: with the scene.
            implicit: what the scenario says of it in the implicit form.
        """
        report = self._report
        number = len(report.fitting)
        if len(report.renderings) < SHOWN and number % 3 == 0:  # neighbors are similar
            report.renderings.append(implicit.text)
        report.fitting.append(episode.key)
        if not all(is_right(goal, episode) for goal in goals_of_command(implicit, episode)):
            report.open += 1

        # One other goal is enough for each scene; it is not always the first, so all occur.
        others = [goal for goal in goals_of(episode) if goal != episode.goal]
        if others:
            other = with_goal(episode, others[number % len(others)])
            if self._text(other) == implicit.text:
                report.add("says the same of another goal", implicit.text)

    def _text(self, episode: Episode) -> str | None:
        """Return what the scenario says of an episode; None if it does not fit."""
        request = request_of(episode, self.usual)
        chosen = self._chosen(request)
        if chosen is None:
            return None
        return self._instruction_of(request, chosen).text

    def _check_texts(self, episode: Episode, usual: InstructionOptions) -> list[Instruction]:
        """Check all texts of the scenario for an episode, and return them, the implicit one first.

        They differ in their form; in the contextual setting each is also said with a competing
        remark, which names another value. Empty if the scenario does not fit the episode.

        Args:
            episode: that is spoken of.
            usual: options of the texts, but for the form.
        """
        chosen = self._chosen(request_of(episode, usual))
        if chosen is None:
            return []
        variants = [replace(usual, form=form) for form in FORMS]
        if usual.setting == "contextual":
            variants += [replace(variant, distractor="competing") for variant in variants]
        return [self._check_text(request_of(episode, options), chosen) for options in variants]

    def _check_text(self, request: InstructionRequest, chosen: ScenarioChoice) -> Instruction:
        """Check one text of the scenario, add what is found to the report, and return the text.

        Args:
            request: the episode, and the options of the text.
            chosen: the scenario with the fillers of its slots for the episode.
        """
        report = self._report
        instruction = self._instruction_of(request, chosen)
        if request.resolved:
            report.resolved.add(instruction.text)
        for rule in _broken_rules(request, chosen, instruction):
            report.add(rule, instruction.text)
        report.longest = max(report.longest, instruction.text, key=tokens_of)
        if request.options.distractor == "competing" and not report.competing:
            report.competing = instruction.text
        return instruction

    def _chosen(self, request: InstructionRequest) -> ScenarioChoice | None:
        """Return the scenario with the fillers of its slots for an episode.

        None if it does not fit, or its setting cannot express the episode.
        """
        if _is_refused(request):
            return None
        scenario = self._report.scenario
        return choose(request, scenario.fields.setting, [scenario])

    def _instruction_of(self, request: InstructionRequest, chosen: ScenarioChoice) -> Instruction:
        """Return the instruction that the filled scenario gives."""
        return spoken_instruction(request, say_chosen(request, self._words, chosen))


@functools.cache
def our_scenarios() -> tuple[Scenario, ...]:
    """Return the scenarios (text templates) of all our tasks.

    One that several tasks say is there for each of them.
    """
    found: list[Scenario] = []
    for words in written_words().values():
        found += words.scenarios
    return tuple(found)


def unserved_settings(
    reports: Sequence[ScenarioReport], scenes: Sequence[Episode], path: Path
) -> Iterator[str]:
    """Yield a complaint for each setting of a user's file in which some scenes have no words.

    Scenes that the setting cannot express need none.

    Args:
        reports: on all scenarios of the file for a task, with the scenes that each fits.
        scenes: episodes of the task.
        path: of the file, for the complaint.
    """
    for setting, keys in _served_scenes(reports).items():
        options = InstructionOptions(setting)
        others = [episode for episode in scenes if episode.key not in keys]
        lacking = [other for other in others if not _is_refused(request_of(other, options))]
        if lacking:
            example = lacking[0]
            yield (
                f"{setting} has no scenario that fits {counted(len(lacking), 'scene')}, such as "
                f"{_key_with_goal(example)}, so a run refuses them; see why with `roboirg show "
                f"{example.task} {example.index} --split {example.split} --words --wordings "
                f"{path}`, and write one more"
            )


def _is_refused(request: InstructionRequest) -> bool:
    """Return whether a setting cannot express an episode, whatever its scenarios."""
    return all_settings()[request.options.setting].refusal(request) is not None


def _served_scenes(reports: Sequence[ScenarioReport]) -> dict[str, set[str]]:
    """Return the keys of the scenes that scenarios of a user's file fit, by setting.

    For example ``{"direct": {"PickXtimes/train/3"}}``.
    """
    served: dict[str, set[str]] = {}
    for report in reports:
        fields = report.scenario.fields
        if fields.pool is None:  # a user's; ours serve one pool each, next to many others
            served.setdefault(fields.setting, set()).update(report.fitting)
    return served


def _key_with_goal(episode: Episode) -> str:
    """Return the key of an episode with its goal: ``PickXtimes/train/3 (red, twice)``."""
    return f"{episode.key} ({in_words(episode.goal)})"


def _in_both_pools(scenario: Scenario, words: TaskScenarios) -> Iterator[str]:
    """Yield a complaint for each sentence of a scenario that the other pool of words also has.

    The pools train and test must share neither sentences nor frames (names of scenarios). A
    scenario of a user's file serves both, so it has no other pool.

    Args:
        scenario: to check.
        words: all words of its file, which are compared next to those of the package.
    """
    if scenario.fields.pool is None:
        return
    (other_pool,) = set(POOLS) - {scenario.fields.pool}
    other_sentences = sentences_of((*words.scenarios, *our_scenarios()), other_pool)
    for shared in sorted(other_sentences.intersection(blanked(scenario))):
        yield f"the other pool has {shared!r}, too"


def _broken_rules(
    request: InstructionRequest, chosen: ScenarioChoice, instruction: Instruction
) -> Iterator[str]:
    """Yield a complaint for each rule that a text of a scenario breaks.

    Checked are its grammar, its meaning, that its command does not give the goal away, and that
    words such as *it* point at one thing. In the resolved form, whose command names all values,
    only the grammar counts.

    Args:
        request: the episode, and the options of the text.
        chosen: the scenario with the fillers of its slots.
        instruction: the text.
    """
    yield from broken_text(instruction, chosen, request)
    if request.resolved:
        return
    yield from _wrong_meaning(request, cast("Meaning", instruction.meaning))
    leaked = find_leaks(instruction, request.episode.goal)
    if leaked:
        yield f"the command gives away {', '.join(sorted(leaked))}"
    yield from _unclear_references(instruction, chosen.scenario)


def _wrong_meaning(request: InstructionRequest, meaning: Meaning) -> Iterator[str]:
    """Yield complaints if words do not mean the goal of their episode; nothing if they do.

    They may mean several goals if each of them is right. The first complaint is about the goal, the
    others about its values for which the words stand for another one.

    Args:
        request: the episode with the values of its goal.
        meaning: what the words declare to mean.
    """
    episode = request.episode
    goals = meant_goals(meaning, episode)
    if goals and all(is_right(goal, episode) for goal in goals):
        return
    yield "means no goal, another one, or several"
    for value in request.goal_values:
        found = field_values(meaning, value.field, episode)
        if found != {value.value}:
            words = " or ".join(sorted(map(str, found))) or "nothing that was introduced"
            yield f"say.{value.field} must stand for the goal's value; it stands for {words}"


def _unclear_references(instruction: Instruction, scenario: Scenario) -> Iterator[str]:
    """Yield a complaint for each word that points back, such as *it*, without a clear antecedent.

    An antecedent is an earlier mention of the value, such as *red* before *it*; there must be
    exactly one. *Red and blue are nice. Lift it.* -> *'it' can mean red or blue*. Once a word such
    as *the former* has chosen from a list, later ones may mean it: *Red or blue? Let's take the
    former. Lift it.* Values in distracting remarks do not count.

    Args:
        instruction: with its mentions in the order of speaking.
        scenario: from which it was made.
    """
    # "Red or blue? Red is gone." names one of two again, and so says which one is meant.
    is_named_again = "taken" in slots_in(scenario.text("introduction"))
    has_chosen = is_named_again  # whether one of the list has been chosen so far
    antecedents = []  # that came so far
    for mention in instruction.mentions:
        if mention.role == "antecedent":
            if instruction.utterances[mention.utterance].stage != "distractor":
                antecedents.append(mention)
            continue
        # Any other mention points back.
        possible = _possible_antecedents(mention, antecedents, instruction)
        values = [str(antecedent.value) for antecedent in possible]
        words = repr(instruction.span(mention))
        yield from _wrong_antecedents(mention, words, values, is_named_again=is_named_again)
        if mention.expression in _CHOOSING_CLASSES:
            has_chosen = True
        elif not (scenario.fields.list and has_chosen):
            yield from _ambiguous(mention, words, values)


def _ambiguous(pointer: Mention, words: str, values: Sequence[str]) -> Iterator[str]:
    """Yield a complaint if words that point back at one value could mean several.

    *'it' can mean red or blue*.

    Args:
        pointer: the words that point back.
        words: the same, quoted for the complaint.
        values: that were named before and are of its kind: *red*, *blue*.
    """
    named = list(dict.fromkeys(values))
    if len(_parts_of(pointer)) == 1 and len(named) > 1:
        yield f"{words} can mean {' or '.join(named)}"


def _parts_of(mention: Mention) -> list[str]:
    """Return the values of a mention: of ``red and blue`` both."""
    return str(mention.value).split(" and ")


def _wrong_antecedents(
    pointer: Mention, words: str, values: Sequence[str], *, is_named_again: bool
) -> Iterator[str]:
    """Yield a complaint for each value of a pointer that was not named exactly once before.

    *'it' points at what the introduction does not name*.

    Args:
        pointer: words that point back, *it*.
        words: the same, quoted for the complaint.
        values: of the mentions before it, of its kind, in order: *red*, *blue*, *red*.
        is_named_again: whether one of two was named again to say that it is gone; then a value may
            be named twice.
    """
    parts = _parts_of(pointer)
    must_be_once = len(parts) == 1 and pointer.expression != "other" and not is_named_again
    for part in parts:
        number = values.count(part)
        if number == 0:
            yield f"{words} points at what the introduction does not name"
        elif number > 1 and must_be_once:
            yield f"{words} has {number} antecedents {part}"


def _possible_antecedents(
    pointer: Mention, before: Sequence[Mention], instruction: Instruction
) -> Sequence[Mention]:
    """Return the earlier mentions that a word such as *it* could mean, by their kind.

    Numbers point at numbers, colors at colors, moments (*before*) at moments. *That cube* and *the
    one there* only mean what was introduced in one way: by its color, or by its place.

    Args:
        pointer: the word that points back.
        before: mentions before it.
        instruction: with all of them.
    """
    parts = _parts_of(pointer)
    kind = _kind_of(parts[0])
    of_kind = [mention for mention in before if _kind_of(str(mention.value)) == kind]
    of_value = [mention for mention in of_kind if str(mention.value) in parts]
    if pointer.expression not in ("there", "that") or not of_value:
        return of_kind
    # "That cube" was named by its color, "the one there" by its place.
    is_named = _says_value(of_value[0], instruction)
    return [mention for mention in of_kind if _says_value(mention, instruction) == is_named]


def _says_value(mention: Mention, instruction: Instruction) -> bool:
    """Return whether a mention says its value, *red*; else it describes it, *the left one*."""
    return instruction.span(mention) == mention.value


def _kind_of(value: str) -> str:
    """Return what a goal value is: ``before`` a ``moment``, ``2`` a ``number``, else ``color``."""
    if value in MOMENTS:
        return "moment"
    if value.isdecimal():
        return "number"
    return "color"
