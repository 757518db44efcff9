"""Check scenarios: what their sentences may not say, and what they mean in every scene."""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from importlib.resources import files

from roboirg.apps.language_lab.scenarios.meaning import exchanged, meant_value, open_goals
from roboirg.apps.language_lab.scenarios.sentence_rules import (
    blanked,
    broken_sentences,
    undeclared,
)
from roboirg.apps.language_lab.validation.leaks import find_leaks
from roboirg.core.episode import SPLITS, Episode
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language.generator import request_of, spoken_instruction
from roboirg.language.instruction import FORMS, Instruction, Mention
from roboirg.language.request import InstructionRequest
from roboirg.language.scenarios.choice import Chosen, choose, rival_values
from roboirg.language.scenarios.markup import slots_in
from roboirg.language.scenarios.scenario import Scenario, TaskScenarios
from roboirg.language.scenarios.spoken import say_chosen
from roboirg.language.settings import all_settings
from roboirg.language.token_counts import ADDED_TOKENS, USUAL_LIMIT, count_tokens
from roboirg.reader import interpret
from roboirg.tasks.splits.splits import SIZES, get_episode

RANDOM_SCENES = 200
SHOWN = 3
READ_EVERY = 8
"""Of the scenes that fit, the interpreter reads every eighth: it takes most of the time."""
_RANKED = ("former", "latter", "first", "second", "third", "last", "choice", "other")


@dataclass(slots=True)
class ScenarioReport:
    """What was found about a scenario.

    Attributes:
        scenario: the scenario.
        broken: the rules that it breaks, with the number of scenes in which it does.
        examples: for each broken rule one text.
        renderings: texts, from different scenes.
        scenes: number of scenes that it fits.
        open: of these, where its command alone leaves several goals.
        tokens: of the longest text.
        longest: that text.
        read: number of texts that the interpreter has read.
        refused: of these, the ones that it does not understand.
        misread: of these, the ones from which it gets another goal: a fault of the interpreter,
            unless a person gets it, too.
    """

    scenario: Scenario
    broken: Counter[str] = field(default_factory=Counter)
    examples: dict[str, str] = field(default_factory=dict)
    renderings: list[str] = field(default_factory=list)
    scenes: int = 0
    open: int = 0
    tokens: int = 0
    longest: str = ""
    read: int = 0
    refused: int = 0
    misread: list[str] = field(default_factory=list)

    def add(self, rule: str, text: str) -> None:
        """Count a broken rule."""
        self.broken[rule] += 1
        self.examples.setdefault(rule, text)


@functools.cache
def _tokenizer() -> Callable[[str], list[int]] | None:
    """Return the tokenizer with 32,000 pieces; None if it is not installed."""
    try:
        from sentencepiece import SentencePieceProcessor
    except ImportError:
        return None
    model = files("mistral_common").joinpath("data/tokenizer.model.v1")
    return SentencePieceProcessor(model_file=str(model)).encode


def tokens_of(text: str) -> int:
    """Return the number of tokens of a text; without the tokenizer, new words are counted high."""
    encode = _tokenizer()
    return count_tokens(text) if encode is None else len(encode(text)) + ADDED_TOKENS


@functools.cache
def scenes_of(task: str, random: int = RANDOM_SCENES) -> tuple[Episode, ...]:
    """Return all published episodes of a task, and random ones."""
    sizes = {**{split: SIZES[split] for split in SPLITS}, "random": random}
    return tuple(
        get_episode(task, split, index) for split, size in sizes.items() for index in range(size)
    )


def check_scenarios(
    words: TaskScenarios, name: str | None = None, scenes: Sequence[Episode] | None = None
) -> list[ScenarioReport]:
    """Check the scenarios of a file, or the one of a frame, in scenes, by default in all of them.

    Raises:
        InvalidValueError: there is no scenario of that frame.
    """
    frames = list(dict.fromkeys(one.fields.frame for one in words.scenarios))
    if name is not None and name not in frames:
        raise InvalidValueError(f"There is no scenario {name!r}; there are {', '.join(frames)}.")
    reports = [
        _checked(one, words, scenes_of(words.task) if scenes is None else scenes)
        for one in words.scenarios
        if name in (None, one.fields.frame)
    ]
    for report in reports:
        for complaint in _in_both_pools(report.scenario, words.scenarios):
            report.add(complaint, "")
    return reports


def _in_both_pools(scenario: Scenario, others: Sequence[Scenario]) -> Iterator[str]:
    """Yield what a scenario shares with one of the other pool."""
    own = set(blanked(scenario))
    for other in others:
        if other.fields.pool == scenario.fields.pool:
            continue
        where = f"the pool {other.fields.pool}"
        if other.fields.frame == scenario.fields.frame:
            yield f"frame: {where} has the frame {other.fields.frame!r}, too"
        for sentence in sorted(own & set(blanked(other))):
            yield f"sentence: {where} has it, too: {sentence!r}"


def _checked(
    scenario: Scenario, words: TaskScenarios, episodes: Sequence[Episode]
) -> ScenarioReport:
    report = ScenarioReport(scenario)
    for complaint in (*broken_sentences(scenario), *undeclared(scenario)):
        report.add(complaint, "")
    for episode in episodes:
        _check_episode(report, words, episode)
    if report.tokens > USUAL_LIMIT:
        report.add(f"needs {report.tokens} tokens; at most {USUAL_LIMIT} are heard", report.longest)
    if not report.scenes:
        report.add("fits none of the scenes", "")
    elif not report.open:
        report.add("its command alone gives the goal in every scene", "")
    return report


def _check_episode(report: ScenarioReport, words: TaskScenarios, episode: Episode) -> None:
    """Check what a scenario says of an episode, in every form."""
    scenario = report.scenario
    name = "contextual" if scenario.fields.setting == "direct" else scenario.fields.setting
    options = InstructionOptions(name, language=4, wordings=scenario.fields.pool)
    chosen: Chosen | None = None
    for form in FORMS:
        request = request_of(episode, replace(options, form=form))
        if all_settings()[name].refusal(request) is not None:
            return
        try:
            chosen = choose(request, scenario.fields.setting, [scenario])
            if chosen is None:
                return
            told = spoken_instruction(request, say_chosen(request, name, words, chosen))
        except (InvalidValueError, LookupError) as error:
            report.add(f"cannot be said: {error}", episode.key)
            return
        for rule in _broken(request, chosen, told):
            report.add(rule, told.text)
        tokens = tokens_of(told.text)
        # What is seen is said again in the resolved form, which nobody has to hear.
        counts = form == "implicit" or name != "grounded"
        if counts and tokens > report.tokens:
            report.tokens, report.longest = tokens, told.text
        if report.scenes % READ_EVERY == 0:
            _read(report, episode, told)
        if form == "implicit" and len(report.renderings) < SHOWN and report.scenes % 3 == 0:
            report.renderings.append(told.text)
    report.open += len(open_goals(request, scenario.said)) > 1
    report.scenes += 1


def _broken(request: InstructionRequest, chosen: Chosen, told: Instruction) -> Iterator[str]:
    """Yield the rules that a text breaks."""
    scenario = chosen.scenario
    if request.resolved:
        return
    goal = {one.field: one.value for one in request.goal_values}
    others = exchanged(request, chosen.introduced)
    for name in scenario.said:
        for text in scenario.of_kind(f"say.{name}"):
            found = meant_value(request, chosen, name, text, chosen.introduced)
            if found != goal[name]:
                yield f"say.{name}: means {found}, but the goal is {goal[name]}"
            if meant_value(request, chosen, name, text, others) == goal[name] and _moves(text):
                yield f"say.{name}: other values in the introduction leave the goal as it is"
    leaks = find_leaks(told, request.episode.goal)
    if leaks:
        yield f"the command gives away {' and '.join(sorted(leaks))}"
    yield from _broken_pointers(told, listed=bool(scenario.fields.list))
    if scenario.fields.setting == "direct" and not _can_compete(request, chosen):
        yield "competing: no remark has another value here; add one with {rival …} of a number"


def _moves(text: object) -> bool:
    """Return whether exchanged values are known for the words: not for places and what is seen."""
    return not any(name.startswith(("place", "clue")) for name in slots_in(text))  # type: ignore[arg-type]


def _can_compete(request: InstructionRequest, chosen: Chosen) -> bool:
    known = [set(values.values) for values in rival_values(request, chosen.introduced)]
    people = {f"{word}{number}" for word in ("person", "he", "him", "his") for number in ("", ".2")}
    texts = chosen.scenario.of_kind("competing")
    return any(set(slots_in(text)) - people <= one for text in texts for one in known)


def _broken_pointers(told: Instruction, *, listed: bool) -> Iterator[str]:
    """Yield the pointers that have no antecedent of their value, or several."""
    before: list[Mention] = []
    ranked = False
    for mention in told.mentions:
        if mention.role == "antecedent":
            before.append(mention)
            continue
        words, parts = f"{told.span(mention)!r}", str(mention.value).split(" and ")
        of_kind = [one for one in before if isinstance(one.value, int) != parts[0].isalpha()]
        values = [str(one.value) for one in of_kind]
        # Of several, and of a pair, one may be named again to say that it is gone.
        once = len(parts) == 1 and mention.expression != "other"
        for part in parts:
            number = values.count(part)
            if not number or (once and number > 1):
                yield f"{words} has {number} antecedents {part}"
        if mention.expression in _RANKED:
            ranked = True
        elif len(parts) == 1 and len(set(values)) > 1 and not (listed and ranked):
            yield f"{words} can mean {' or '.join(dict.fromkeys(values))}"


def _read(report: ScenarioReport, episode: Episode, told: Instruction) -> None:
    """Have the interpreter read a text."""
    goals = interpret(told.text, episode.scene, episode.task).goals
    report.read += 1
    if len(goals) != 1:
        report.refused += 1
    elif goals[0] != episode.goal:
        report.misread.append(told.text)
