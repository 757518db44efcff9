"""Check scenarios: what their sentences may not say, and what they mean in every scene."""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

from roboirg.apps.language_lab.scenarios.sentence_rules import blanked, broken_sentences
from roboirg.apps.language_lab.scenarios.text_rules import broken_text
from roboirg.apps.language_lab.validation.episode_checks import leaking, places_of
from roboirg.core.episode import SPLITS, Episode, describe_goal
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.plain_text import counted
from roboirg.language.generator import request_of, spoken_instruction
from roboirg.language.instruction import FORMS, Instruction, Mention
from roboirg.language.meaning import field_values, meant_goals
from roboirg.language.request import InstructionRequest
from roboirg.language.scenarios.choice import Chosen, choose
from roboirg.language.scenarios.markup import slots_in
from roboirg.language.scenarios.scenario import Scenario, TaskScenarios
from roboirg.language.scenarios.scenario_file import written_words
from roboirg.language.scenarios.spoken import say_chosen
from roboirg.language.settings import all_settings
from roboirg.language.token_counts import USUAL_LIMIT, tokens_of, tokens_shown
from roboirg.shortcuts.command_chance import goals_of_command, is_right
from roboirg.tasks import get_task, goals_of, with_goal
from roboirg.tasks.splits.splits import get_episode

RANDOM_SCENES = 200
SHOWN = 3
_RANKED = ("former", "latter", "first", "second", "third", "last", "choice", "other")


@dataclass(slots=True)
class ScenarioReport:
    """What was found about a scenario.

    Attributes:
        scenario: the scenario.
        broken: the rules that it breaks, with the number of scenes in which it does.
        examples: for each broken rule one text.
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

    @property
    def scenes(self) -> int:
        """Number of scenes that it fits."""
        return len(self.fitting)

    def add(self, rule: str, text: str) -> None:
        """Count a broken rule."""
        self.broken[rule] += 1
        self.examples.setdefault(rule, text)


@functools.cache
def scenes_of(task: str, random: int = RANDOM_SCENES) -> tuple[Episode, ...]:
    """Return all published episodes of a task, and random ones."""
    return tuple(get_episode(*place) for place in places_of([task], SPLITS, random))


def check_scenarios(
    words: TaskScenarios, name: str | None, scenes: Sequence[Episode]
) -> list[ScenarioReport]:
    """Check the scenarios of a task, or only those of one frame, in scenes."""
    chosen = [one for one in words.scenarios if name in (None, one.fields.frame)]
    return [_checked(one, words, scenes) for one in chosen]


@functools.cache
def our_scenarios() -> tuple[Scenario, ...]:
    """Return the scenarios of all tasks; one that several tasks say is there for each of them."""
    found: list[Scenario] = []
    for words in written_words().values():
        found += words.scenarios
    return tuple(found)


def unserved_settings(
    reports: Sequence[ScenarioReport], scenes: Sequence[Episode]
) -> Iterator[str]:
    """Yield each setting of a user's file that has no scenario for some scenes."""
    fitting: dict[str, set[str]] = {}
    for report in reports:
        fields = report.scenario.fields
        if fields.pool is None:  # those of ours are never alone
            fitting.setdefault(fields.setting, set()).update(report.fitting)
    for name, keys in fitting.items():
        options = InstructionOptions(name, language=4)
        refusal = all_settings()[name].refusal
        lacking = [
            episode
            for episode in scenes
            if episode.key not in keys and refusal(request_of(episode, options)) is None
        ]
        if lacking:
            scene = lacking[0]
            yield (
                f"{name} has no scenario that fits {counted(len(lacking), 'scene')}, such as "
                f"{_with_goal(scene)}; look at it with `roboirg show {scene.task} {scene.index} "
                f"--split {scene.split}`"
            )


def _with_goal(episode: Episode) -> str:
    """Return the key of an episode with its goal: ``PickXtimes/train/3 (red, twice)``."""
    return f"{episode.key} ({describe_goal(episode.goal.as_mapping())})"


def _in_both_pools(scenario: Scenario, words: TaskScenarios) -> Iterator[str]:
    """Yield the frame and the sentences that the other pool has, in its own file or in ours.

    A scenario of a user, which serves both pools, has no other one.
    """
    theirs: set[str] = set()
    for other in (*words.scenarios, *our_scenarios()):
        pools = {other.fields.pool, scenario.fields.pool}
        if pools == {"train", "test"}:
            theirs.update(blanked(other))
    for shared in sorted(theirs.intersection(blanked(scenario))):
        yield f"the other pool has {shared!r}, too"


def _checked(
    scenario: Scenario, words: TaskScenarios, episodes: Sequence[Episode]
) -> ScenarioReport:
    report = ScenarioReport(scenario)
    pointed = get_task(episodes[0].task).commands.pointed
    for complaint in (*broken_sentences(scenario, pointed), *_in_both_pools(scenario, words)):
        report.add(complaint, "")
    for episode in episodes:
        _check_episode(report, words, episode)
    longest = report.longest
    if tokens_of(longest) > USUAL_LIMIT:
        report.add(f"needs {tokens_shown(longest)} tokens; only {USUAL_LIMIT} are heard", longest)
    if not report.scenes:
        report.add("fits none of the scenes", "")
    elif not report.open:
        report.add("its command alone gives the goal in every scene", "")
    return report


def _check_episode(report: ScenarioReport, words: TaskScenarios, episode: Episode) -> None:
    """Check what a scenario says of an episode, in every form and frame."""
    fields = report.scenario.fields
    name = "contextual" if fields.setting == "direct" else fields.setting
    usual = InstructionOptions(name, language=4, wordings=fields.pool)
    try:
        told = _check_texts(report, words, episode, usual)
        if fields.setting == "spatial":
            _check_texts(report, words, episode, replace(usual, frame="camera"))
    except (InvalidValueError, LookupError) as error:
        report.add(f"cannot be said: {error}", _with_goal(episode))
        return
    if not told:
        return
    implicit, number = told[0], report.scenes
    if len(report.renderings) < SHOWN and number % 3 == 0:
        report.renderings.append(implicit.text)
    report.fitting.append(episode.key)
    report.open += not all(is_right(goal, episode) for goal in goals_of_command(implicit, episode))
    others = [goal for goal in goals_of(episode) if goal != episode.goal]
    for goal in others[number % max(1, len(others)) :][:1]:
        request = request_of(with_goal(episode, goal), usual)
        chosen = _chosen(request, report.scenario)
        if chosen and _said(request, words, chosen).text == implicit.text:
            report.add("says the same of another goal", implicit.text)


def _check_texts(
    report: ScenarioReport, words: TaskScenarios, episode: Episode, usual: InstructionOptions
) -> list[Instruction]:
    """Check and return what a scenario says in every form; nothing if it does not fit."""
    chosen = _chosen(request_of(episode, usual), report.scenario)
    if chosen is None:
        return []
    variants = [replace(usual, form=form) for form in FORMS]
    if usual.setting == "contextual":
        variants += [replace(variant, distractor="competing") for variant in variants]
    told: list[Instruction] = []
    for options in variants:
        request = request_of(episode, options)
        said = _said(request, words, chosen)
        if request.resolved:
            report.resolved.add(said.text)
        for rule in _broken(request, chosen, said):
            report.add(rule, said.text)
        report.longest = max(report.longest, said.text, key=tokens_of)
        if options.distractor == "competing":
            report.competing = report.competing or said.text
        told.append(said)
    return told


def _chosen(request: InstructionRequest, scenario: Scenario) -> Chosen | None:
    """Return how a scenario says an episode; None if it does not fit."""
    if all_settings()[request.options.setting].refusal(request) is not None:
        return None
    return choose(request, scenario.fields.setting, [scenario])


def _said(request: InstructionRequest, words: TaskScenarios, chosen: Chosen) -> Instruction:
    return spoken_instruction(request, say_chosen(request, words, chosen))


def _broken(request: InstructionRequest, chosen: Chosen, told: Instruction) -> Iterator[str]:
    """Yield the rules that a text breaks; a resolved one has to be right as a text only."""
    yield from broken_text(told, chosen, request)
    if request.resolved:
        return
    episode, meaning = request.episode, told.meaning
    if meaning is None:
        yield "declares no meaning"
        return
    goals = meant_goals(meaning, episode)
    if not goals or not all(is_right(goal, episode) for goal in goals):
        yield "means another goal, or several"
        for value in request.goal_values:
            found = field_values(meaning, value.field, episode)
            if found != {value.value}:
                words = " or ".join(sorted(map(str, found))) or "nothing"
                yield f"say.{value.field}: means {words}, but the goal is {value.value}"
    for _, words in leaking(told, episode):
        yield f"the command gives away {words}"
    yield from _broken_pointers(told, chosen.scenario)


def _broken_pointers(told: Instruction, scenario: Scenario) -> Iterator[str]:
    """Yield the pointers that have no antecedent of their value, or several."""
    listed = bool(scenario.fields.list)
    # Of two, one is named again: it is the one that is meant next.
    again = "taken" in slots_in(scenario.text("introduction"))
    before: list[Mention] = []
    ranked = again
    for mention in told.mentions:
        if mention.role == "antecedent":
            if told.utterances[mention.utterance].stage != "distractor":
                before.append(mention)
            continue
        words, parts = f"{told.span(mention)!r}", str(mention.value).split(" and ")
        of_kind = [one for one in before if isinstance(one.value, int) != parts[0].isalpha()]
        own = [one for one in of_kind if str(one.value) in parts]
        if mention.expression in ("there", "that") and own:
            # "That cube" was named by its color, "the one there" by its place.
            named = told.span(own[0]) == own[0].value
            of_kind = [one for one in of_kind if (told.span(one) == one.value) == named]
        values = [str(one.value) for one in of_kind]
        # Of several, and of a pair, one may be named again to say that it is gone.
        once = len(parts) == 1 and mention.expression != "other" and not again
        for part in parts:
            number = values.count(part)
            if not number:
                yield f"{words} points at what the introduction does not name"
            elif once and number > 1:
                yield f"{words} has {number} antecedents {part}"
        if mention.expression in _RANKED:
            ranked = True
        elif len(parts) == 1 and len(set(values)) > 1 and not (listed and ranked):
            yield f"{words} can mean {' or '.join(dict.fromkeys(values))}"
