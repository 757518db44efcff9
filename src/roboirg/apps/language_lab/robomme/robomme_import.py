"""Make a wording file from the sentences of RoboMME's repository.

Every template is checked: it gives the sentences back exactly, and the interpreter reads them back
to the goals in scenes of the task. Where it cannot, the template is left out with the reason. The
implicit commands are validated as our own are; a setting whose commands break a rule keeps ours.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from roboirg.apps.language_lab.robomme.goal_sentences import (
    FUNCTION,
    SentenceError,
    SentenceFunction,
    ask,
    load_function,
)
from roboirg.apps.language_lab.robomme.phrase_widening import widen
from roboirg.apps.language_lab.robomme.template_search import find_templates
from roboirg.apps.language_lab.robomme.wording_writer import wording_text
from roboirg.apps.language_lab.validation.episode_checks import check_episode
from roboirg.core.episode import DIFFICULTIES, Episode, Goal, Split
from roboirg.core.plain_text import counted
from roboirg.language.settings import EXPLICIT, all_settings, settings_of
from roboirg.language.worded_command import (
    ROBOMME_NAME,
    TaskWordings,
    WordedCommand,
    Wordings,
    describe_goal,
    goal_fields,
)
from roboirg.language.wordings.robomme_sentences import check_robomme_name
from roboirg.language.wordings.wording_file import check_name, parse_wordings
from roboirg.language.wordings.wording_store import forget_wordings, register_wordings
from roboirg.reader import interpret
from roboirg.tasks import Task, all_tasks
from roboirg.tasks.splits.published_episodes import published_episode
from roboirg.tasks.splits.splits import SIZES

SPLIT: Split = "train"
READ_SCENES = 8
"""Scenes in which all goals are read back; of the others, the goals that these lack."""
CHECKED_EPISODES = 10
"""Episodes whose implicit instructions are validated, with other goals than their own, too."""
_REPEATEDLY = re.compile(r"\b(?:repeatedly|over and over) ", re.IGNORECASE)
_RELATIVE_CLAUSE = re.compile(
    r"(?P<clause>\b(?:that|which) (?:was|were|is|are|has|have|had)\b[^,;.{}]*) (?=\{repeats\})"
)


class Refused(NamedTuple):
    """A template that the wording file does not have.

    Attributes:
        task: name of the task.
        case: the goals that it is for.
        reason: why it was left out, in words.
    """

    task: str
    case: str
    reason: str


class ImportedWordings(NamedTuple):
    """What an import gives.

    Attributes:
        text: of the wording file.
        wordings: its content; None if no sentence can be used.
        refused: what it lacks.
    """

    text: str
    wordings: Wordings | None
    refused: tuple[Refused, ...]


def import_robomme(root: Path, name: str = ROBOMME_NAME) -> ImportedWordings:
    """Make wordings from a clone of RoboMME's repository.

    Args:
        root: folder of the clone.
        name: of the wordings.
    """
    where = "imported wording file"
    check_name(name, where)
    function = load_function(root)
    tasks: dict[str, TaskWordings] = {}
    refused: list[Refused] = []
    for task in all_tasks().values():
        importer = _TaskImport(task, function)
        found = importer.run()
        refused += importer.refused
        if found is not None:
            tasks[task.name] = found
    source = f"The first sentences of {FUNCTION} in RoboMME's repository."
    text = wording_text(name, source, tasks)
    wordings = parse_wordings(text, where) if tasks else None
    if wordings is not None:
        check_robomme_name(wordings, where)
    return ImportedWordings(text, wordings, tuple(refused))


class _TaskImport:
    """The import of one task.

    Attributes:
        refused: what was left out so far.
    """

    def __init__(self, task: Task, function: SentenceFunction) -> None:
        self.refused: list[Refused] = []
        self._task = task
        self._function = function
        self._episodes = tuple(_train_episodes(task))

    def run(self) -> TaskWordings | None:
        """Return the commands of the task; None if none can be used."""
        try:
            sentences = self._sentences()
        except SentenceError as error:
            self._refuse("all goals", str(error))
            return None
        commands, stuck = self._commands(sentences)
        wordings = self._readable(TaskWordings(tuple(commands)), sentences)
        if not wordings.commands:
            return None
        wordings = TaskWordings(with_pointing(wordings.commands))
        if not self._kept_in_file(wordings, sentences):
            return None
        own = {setting for setting in settings_of(self._task) if self._needs_own(setting, stuck)}
        wordings = replace(wordings, own=frozenset(own))
        broken = own | self._broken(wordings)
        # A setting takes its harder one along.
        return replace(wordings, own=frozenset(all_settings()[one].plain or one for one in broken))

    def _sentences(self) -> dict[Goal, str]:
        """Return the sentence of every goal of the task."""
        shapes: dict[int, set[str]] = defaultdict(set)
        for episode in self._episodes:
            shapes[len(goal_fields(episode.goal))].add(episode.difficulty)
        goals = (goal for episode in self._episodes for goal in self._task.goals(episode.scene))
        return {
            goal: ask(
                self._function,
                self._task.name,
                goal,
                sorted(shapes.get(len(goal_fields(goal)), DIFFICULTIES)),
            )
            for goal in dict.fromkeys(goals)
        }

    def _commands(self, sentences: Mapping[Goal, str]) -> tuple[list[WordedCommand], set[str]]:
        """Return the templates, and the slots whose words cannot be replaced."""
        merged: dict[str, WordedCommand] = {}
        stuck: set[str] = set()
        for draft in find_templates(sentences):
            wide = widen(draft, self._task.commands.thing)
            stuck |= {name.partition(".")[0] for name in wide.stuck}
            command = WordedCommand(wide.text, draft.when, wide.phrases)
            twin = merged.get(wide.text)
            both = None if twin is None else _merged(twin, command)
            merged[wide.text if both or twin is None else f"{wide.text}|{draft.when}"] = (
                both or command
            )
        found = sorted(merged.values(), key=lambda one: -len(one.when))
        return found, stuck

    def _readable(self, wordings: TaskWordings, sentences: Mapping[Goal, str]) -> TaskWordings:
        """Return the templates that give their sentences, which read as the goals."""
        reasons: dict[int, str] = {}
        unread = set(sentences)
        without: dict[Goal, None] = {}
        for number, episode in enumerate(self._episodes):
            goals = self._task.goals(episode.scene)
            for goal in goals if number < READ_SCENES else [one for one in goals if one in unread]:
                unread.discard(goal)
                command = wordings.find(goal)
                if command is None:
                    without[goal] = None
                    continue
                reason = self._misread(command, goal, sentences[goal], episode)
                if reason is not None:
                    reasons.setdefault(wordings.commands.index(command), reason)
        for goal in without:
            self._refuse(describe_goal(goal), "no template fits")
        for index, reason in sorted(reasons.items()):
            self._refuse(_case(wordings.commands[index]), reason)
        kept = (one for index, one in enumerate(wordings.commands) if index not in reasons)
        return TaskWordings(tuple(kept))

    def _misread(
        self, command: WordedCommand, goal: Goal, sentence: str, episode: Episode
    ) -> str | None:
        """Return why a goal's command cannot be used; None if it can."""
        stated = command.state(goal)
        if stated != sentence:
            return f"it gives {stated!r} instead of {sentence!r}"
        found = interpret(stated, episode.scene, self._task.name)
        if found.not_understood:
            return f"{stated!r}: the interpreter: {found.not_understood[0]}"
        if found.goals != (goal,):
            read = "; ".join(map(describe_goal, found.goals))
            return f"{stated!r}: the interpreter finds {counted(len(found.goals), 'goal')}: {read}"
        return None

    def _kept_in_file(self, wordings: TaskWordings, sentences: Mapping[Goal, str]) -> bool:
        """Return whether a file with these templates gives the sentences; refuse the task if not.

        A file has common phrases in one table, so that a template may fit further goals.
        """
        name = self._task.name
        read = parse_wordings(wording_text("a", "", {name: wordings}), "file").tasks[name]
        for goal in sentences:
            command, written = wordings.find(goal), read.find(goal)
            wanted = None if command is None else command.state(goal)
            said = None if written is None else written.state(goal)
            if said != wanted:
                self._refuse("all goals", f"the file would give {said!r} instead of {wanted!r}")
                return False
        return True

    def _needs_own(self, setting: str, stuck: set[str]) -> bool:
        """Return whether a setting would replace words that are no whole phrase."""
        colors = {"color", "colors", "cubes"}
        return setting != EXPLICIT and bool(stuck & colors if setting == "spatial" else stuck)

    def _broken(self, wordings: TaskWordings) -> set[str]:
        """Return the settings whose instructions break a rule of validation."""
        identity = register_wordings(
            Wordings("import", self._task.name, {self._task.name: wordings})
        )
        broken: set[str] = set()
        try:
            for episode in self._checked(wordings):
                found = check_episode(episode, wordings=identity)
                broken |= {failure.setting for failure in found.failures}
        finally:
            forget_wordings(identity)
        # Both have the same command.
        pair = {"direct", "contextual"}
        return (broken | pair if broken & pair else broken) - {EXPLICIT}

    def _checked(self, wordings: TaskWordings) -> Iterator[Episode]:
        """Yield episodes, each with its own goal and with another one of its scene."""
        for number, episode in enumerate(self._episodes[:CHECKED_EPISODES]):
            goals = self._task.goals(episode.scene)
            for goal in (episode.goal, goals[number % len(goals)]):
                if wordings.find(goal) is not None:
                    yield replace(episode, goal=goal)

    def _refuse(self, case: str, reason: str) -> None:
        self.refused.append(Refused(self._task.name, case, reason))


def _train_episodes(task: Task) -> Iterator[Episode]:
    for index in range(SIZES[SPLIT]):
        found = published_episode(task.name, SPLIT, index)
        if found is not None:
            seed, difficulty, scene, goal = found
            stages = task.stages(scene, goal)
            yield Episode(task.name, SPLIT, index, seed, difficulty, scene, goal, stages)


def _merged(first: WordedCommand, second: WordedCommand) -> WordedCommand | None:
    """Return one template for the goals of both, if their phrases agree."""
    tables = [*first.phrases.items(), *second.phrases.items()]
    phrases: dict[str, dict[str, object]] = {}
    for name, table in tables:
        known = phrases.setdefault(name, {})
        if any(known.get(value, phrase) != phrase for value, phrase in table.items()):
            return None
        known.update(table)
    # A condition on a slot that the fields hold anyway is not needed.
    told = {one.partition(".")[0] for one in first.fields}
    told |= {"colors", "counts"} if "cubes" in told else set()
    when = {slot: value for slot, value in first.when.items() if slot not in told}
    other = {slot: value for slot, value in second.when.items() if slot not in told}
    if when != other:
        return None
    return WordedCommand(first.text, when, phrases)  # type: ignore[arg-type]


def _case(command: WordedCommand) -> str:
    """Return the goals that a template is for, in words."""
    conditions = [
        f"{slot} {' and '.join(map(str, value)) if isinstance(value, tuple) else value}"
        for slot, value in command.when.items()
    ]
    return ", ".join([*conditions, *(f"any {name}" for name in command.fields)])


def summary(found: Wordings) -> Sequence[str]:
    """Return what was imported, one line for each task."""
    lines: list[str] = []
    for task, wordings in found.tasks.items():
        own = f"; own commands in {', '.join(sorted(wordings.own))}" if wordings.own else ""
        lines.append(f"{task}: {counted(len(wordings.commands), 'command')}{own}")
    return lines


def with_pointing(commands: Iterable[WordedCommand]) -> tuple[WordedCommand, ...]:
    """Return the commands, with those that are for referring expressions before the others."""
    found: list[WordedCommand] = []
    for command in commands:
        text = _pointing(command.text)
        if text != command.text:
            found.append(replace(command, text=text, pointed=frozenset({"repeats"})))
        found.append(command)
    return tuple(found)


def _pointing(text: str) -> str:
    if "{repeats}" not in text:
        return text
    rest = _REPEATEDLY.sub("", text)
    if text[0].isupper():
        rest = rest[0].upper() + rest[1:]
    return _RELATIVE_CLAUSE.sub(r"\g<clause>, doing so ", rest)
