"""Learners that do not understand: of the words alone, of the scene alone, and of either.

Each predicts every place of a goal by itself, and sees it in several ways: the text as it is, to
predict the value; the text in which every named value is its rank in the order of mention, to
predict which of them is meant; and what can be seen, to predict the value. Each view has a linear
model and a small neural network. A floor takes for each place what is right most often on
instructions that were not learned from.
"""

from __future__ import annotations

import itertools
import warnings
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, cast, get_args

from roboirg.core.episode import Episode, Goal, values_in
from roboirg.core.errors import InvalidValueError
from roboirg.core.extras import extra_needed
from roboirg.language.instruction import Instruction, hidden_slots
from roboirg.shortcuts.goal_vocabulary import SlotVocabulary, Value, goal_vocabulary
from roboirg.shortcuts.named_values import marked_text, named_values, stated_values
from roboirg.shortcuts.scene_facts import SceneFacts, scene_facts
from roboirg.shortcuts.surface_rules import Candidates, certain
from roboirg.shortcuts.text_guess import TextGuess

LearnedFloor = Literal["majority", "text-only", "scene-only", "union"]
LEARNED_FLOORS: tuple[LearnedFloor, ...] = get_args(LearnedFloor)
View = Literal["words", "order", "scene"]
Model = Literal["linear", "network"]
MODELS: tuple[Model, ...] = get_args(Model)


class Way(NamedTuple):
    """One way to learn: a model that sees an instruction in a view."""

    view: View
    model: Model


_VIEWS: Mapping[LearnedFloor, tuple[View, ...]] = {
    "majority": (),
    "text-only": ("words", "order"),
    "scene-only": ("scene",),
    "union": ("words", "order", "scene"),
}
_WAYS = [Way(view, model) for view, model in itertools.product(_VIEWS["union"], MODELS)]
_NGRAMS = (1, 3)
"""Lengths of the n-grams, in words."""
_SEED = 0
_NONE = "none"
"""Stands for a place that a goal does not have."""
_UNNAMED = "unnamed"
"""Stands for a value that the text does not name, where the others are ranks."""

InstructedEpisode = tuple[Episode, Instruction]
"""An episode and one of its instructions."""


class Heard(NamedTuple):
    """What learners get of an instruction.

    Attributes:
        text: all of its words.
        open: the slots that the command does not state.
        candidates: by slot, the values that the text introduces on equal terms, in the order of
            mention.
        facts: of the scene; none for learners of the words.
    """

    text: str
    open: Collection[str] = ()
    candidates: Mapping[str, tuple[Value, ...]] = MappingProxyType({})
    facts: SceneFacts = MappingProxyType({})

    @classmethod
    def of(cls, instructed: InstructedEpisode) -> Heard:
        """Return what there is to hear and to see; nothing of the goal.

        *There is a red cube and a blue one. Take the first one.* -> the slot ``color`` is open, and
        its candidates are red and blue, in this order. A slot whose values are not all mentioned
        has no candidates.
        """
        episode, instruction = instructed
        introduced = cast("Mapping[str, list[Value]]", instruction.metadata["candidates"])
        # An antecedent introduces what the command refers back to.
        antecedents = [
            mention.value for mention in instruction.mentions if mention.role == "antecedent"
        ]
        candidates: dict[str, tuple[Value, ...]] = {}
        for slot, values in introduced.items():
            mentioned = [value for value in antecedents if value in values]
            each_once = tuple(dict.fromkeys(mentioned))
            if len(each_once) == len(values):
                candidates[slot] = each_once
        return cls(instruction.text, open_slots(instructed), candidates, scene_facts(episode.scene))


def open_slots(instructed: InstructedEpisode) -> frozenset[str]:
    """Return the slots that the command leaves to its context, or that it says are to be seen."""
    episode, instruction = instructed
    touched = cast("list[str]", instruction.metadata.get("touched", []))
    return hidden_slots(instruction, episode.goal).union(touched)


def check_learning_support() -> None:
    """Check early that floors can be learned."""
    with extra_needed("The learned floors need scikit-learn", "report"):
        import sklearn.neural_network  # noqa: F401


class GoalLearner:
    """The learned floors of one task in one setting; the same input gives the same predictions.

    Args:
        taught: instructions of the task to learn from, with their episodes.
        judged: others, on which the best view and model of each place are chosen.
    """

    def __init__(
        self, taught: Sequence[InstructedEpisode], judged: Sequence[InstructedEpisode]
    ) -> None:
        check_learning_support()
        if not taught or not judged:
            raise InvalidValueError("The learned floors have no instruction to learn from.")
        episode, _ = taught[0]
        self._vocabulary = goal_vocabulary(episode.task)
        lessons = _lessons(taught)
        tests = _lessons(judged)
        self._learners: dict[str, list[_PlaceLearner]] = {}
        for slot, vocabulary in self._vocabulary.items():
            learners: list[_PlaceLearner] = []
            for number in range(vocabulary.longest):
                place = _FieldPlace(slot, number, vocabulary)
                learners.append(_PlaceLearner(place, lessons, tests))
            self._learners[slot] = learners

    def guesses(self, floor: LearnedFloor, heard: Sequence[Heard]) -> list[TextGuess]:
        """Return a floor's guess of the goal of each instruction of the task.

        A guess has a value for each place of each slot. What a command states plainly is taken from
        it, by all but the floors without words; for the rest, the learner of the place decides.
        """
        guesses: list[dict[str, tuple[Candidates, ...]]] = [{} for _ in heard]
        for slot, learners in self._learners.items():
            # A list for each place, with a value for each instruction: models predict all at once.
            by_place = [learner.predict(floor, heard) for learner in learners]
            for number, instruction in enumerate(heard):
                predicted = [predictions[number] for predictions in by_place]
                present = [value for value in predicted if value is not None]
                stated = self._stated(floor, instruction, slot)
                guesses[number][slot] = tuple(certain(stated or present))
        return list(guesses)

    def _stated(self, floor: LearnedFloor, heard: Heard, slot: str) -> tuple[Value, ...]:
        """Return the values that a command states; none for floors without words."""
        if slot in heard.open or "words" not in _VIEWS[floor]:
            return ()
        return stated_values(heard.text, slot, self._vocabulary[slot])


class _Lesson(NamedTuple):
    """What learners get of an instruction, and the right goal."""

    heard: Heard
    goal: Goal


def _lessons(texts: Sequence[InstructedEpisode]) -> list[_Lesson]:
    return [
        _Lesson(Heard.of((episode, instruction)), episode.goal) for episode, instruction in texts
    ]


class _FieldPlace(NamedTuple):
    """One place of a slot: of the colors of two containers, the first one, say."""

    slot: str
    number: int
    vocabulary: SlotVocabulary

    def value_in(self, goal: Goal) -> Value | None:
        """Return what a goal has at the place; None if its slot is shorter."""
        values = values_in(goal[self.slot])
        return values[self.number] if self.number < len(values) else None

    def open_in(self, lessons: Sequence[_Lesson]) -> list[_Lesson]:
        """Return the lessons whose command leaves the slot open."""
        return [lesson for lesson in lessons if self.slot in lesson.heard.open]


class _PlaceLearner:
    """All that predict one place of a slot, and which of them each floor takes.

    Learns from instructions whose command leaves the slot open; without any it is the majority.
    """

    def __init__(
        self, place: _FieldPlace, taught: Sequence[_Lesson], judged: Sequence[_Lesson]
    ) -> None:
        self._place = place
        # By frequency; None, where a goal does not have the place, counts as a value.
        counts = Counter(place.value_in(lesson.goal) for lesson in taught)
        self._frequent = [value for value, _ in counts.most_common()]
        self._readers: dict[Way, Any] = {}
        self._best: dict[LearnedFloor, Way] = {}
        open_lessons = place.open_in(taught)
        if open_lessons and len(self._frequent) > 1:
            self._learn(open_lessons, place.open_in(judged))

    def _learn(self, taught: Sequence[_Lesson], judged: Sequence[_Lesson]) -> None:
        """Learn in every way; each floor takes the way that is right most often on the judged."""
        numbers_right: dict[Way, int] = {}
        for way in _WAYS:
            self._readers[way] = self._fit(way, taught)
            numbers_right[way] = self._count_right(way, judged)
        for floor, views in _VIEWS.items():
            ways = [way for way in _WAYS if way.view in views]
            if ways:
                self._best[floor] = max(ways, key=numbers_right.__getitem__)

    def _count_right(self, way: Way, judged: Sequence[_Lesson]) -> int:
        """Return for how many instructions a way predicts the value of the place in the goal."""
        if not judged:
            return 0
        predicted = self._predict(way, [lesson.heard for lesson in judged])
        count = 0
        for value, lesson in zip(predicted, judged, strict=True):
            if value == self._place.value_in(lesson.goal):
                count += 1
        return count

    def predict(self, floor: LearnedFloor, heard: Sequence[Heard]) -> list[Value | None]:
        """Return the value of the place for each instruction; None for none."""
        if floor not in self._best or not heard:
            return [self._frequent[0]] * len(heard)
        return self._predict(self._best[floor], heard)

    def _fit(self, way: Way, lessons: Sequence[_Lesson]) -> Any:  # noqa: ANN401 - scikit-learn has no types
        """Return a model that has learned in a way from all lessons."""
        labels = [self._label(way.view, lesson) for lesson in lessons]
        inputs = self._inputs(way.view, [lesson.heard for lesson in lessons])
        reader = _reader(way, is_constant=len(set(labels)) == 1)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that an iteration more would be better
            return reader.fit(inputs, labels)

    def _predict(self, way: Way, heard: Sequence[Heard]) -> list[Value | None]:
        """Return the value that a way predicts for each instruction; None for no value there."""
        labels = self._readers[way].predict(self._inputs(way.view, heard))
        pairs = zip(heard, labels, strict=True)
        return [self._value(way.view, instruction, label) for instruction, label in pairs]

    def _inputs(self, view: View, heard: Sequence[Heard]) -> list[str | SceneFacts]:
        return [self._input(view, instruction) for instruction in heard]

    def _input(self, view: View, heard: Heard) -> str | SceneFacts:
        """Return what a model sees of an instruction in a view."""
        if view == "scene":
            return heard.facts
        if view == "words":
            return heard.text
        return marked_text(heard.text, self._place.slot, self._place.vocabulary)

    def _label(self, view: View, lesson: _Lesson) -> str:
        """Return what a model is to predict: a value, or its rank in the order of mention.

        ``"blue"``; in the view ``order`` of a text that names red and then blue, ``"1"``.
        """
        value = self._place.value_in(lesson.goal)
        if value is None:
            return _NONE
        if view != "order":
            return str(value)
        named = self._named(lesson.heard)
        return str(named.index(value)) if value in named else _UNNAMED

    def _value(self, view: View, heard: Heard, label: str) -> Value | None:
        """Return the value that a predicted label stands for; see `_label`."""
        if label == _NONE:
            return None
        if view != "order":
            return next(value for value in self._frequent if str(value) == label)
        named = self._named(heard)
        if label != _UNNAMED and int(label) < len(named):
            return named[int(label)]
        # What the text does not name, or names too few of: the most frequent of the others.
        for value in self._frequent:
            if value is not None and value not in named:
                return value
        return self._frequent[0]

    def _named(self, heard: Heard) -> tuple[Value, ...]:
        """Return the candidates for the slot, or else the values that the text names, each once."""
        if self._place.slot in heard.candidates:
            return heard.candidates[self._place.slot]
        named = named_values(heard.text, self._place.slot, self._place.vocabulary)
        return tuple(dict.fromkeys(mention.value for mention in named))


def _reader(way: Way, *, is_constant: bool) -> Any:  # noqa: ANN401 - scikit-learn has no types
    """Return an unfitted model behind what makes numbers of a view."""
    from sklearn.dummy import DummyClassifier
    from sklearn.feature_extraction import DictVectorizer
    from sklearn.feature_extraction.text import CountVectorizer
    from sklearn.linear_model import LogisticRegression
    from sklearn.neural_network import MLPClassifier
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import MaxAbsScaler

    if is_constant:
        return DummyClassifier()
    if way.model == "linear":
        predictor = LogisticRegression(C=10.0, max_iter=200)
    else:
        predictor = MLPClassifier((32,), alpha=1e-3, max_iter=30, random_state=_SEED)
    if way.view == "scene":
        return make_pipeline(DictVectorizer(), MaxAbsScaler(), predictor)
    # Presence counts, frequency does not; words that occur once cannot help.
    ngrams = CountVectorizer(ngram_range=_NGRAMS, binary=True, min_df=2)
    return make_pipeline(ngrams, predictor)
