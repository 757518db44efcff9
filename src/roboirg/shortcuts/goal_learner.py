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
from roboirg.shortcuts.named_values import marked_text, named_values
from roboirg.shortcuts.scene_facts import SceneFacts, scene_facts
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
_NGRAMS = (1, 3)
"""Lengths of the n-grams, in words."""
_SEED = 0
_NONE, _UNNAMED = "none", "unnamed"

Told = tuple[Episode, Instruction]
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
    def of(cls, told: Told) -> Heard:
        """Return what there is to hear and to see; nothing of the goal."""
        episode, instruction = told
        found = cast("Mapping[str, list[Value]]", instruction.metadata["candidates"])
        mentioned = [one.value for one in instruction.mentions if one.role == "antecedent"]
        ordered = {
            slot: tuple(dict.fromkeys(value for value in mentioned if value in values))
            for slot, values in found.items()
        }
        candidates = {slot: one for slot, one in ordered.items() if len(one) == len(found[slot])}
        return cls(instruction.text, open_slots(told), candidates, scene_facts(episode.scene))


def open_slots(told: Told) -> frozenset[str]:
    """Return the slots that the command leaves to its context, or that it says are to be seen."""
    episode, instruction = told
    touched = cast("list[str]", instruction.metadata.get("touched", []))
    return hidden_slots(instruction, episode.goal).union(touched)


def check_learning_support() -> None:
    """Check early that floors can be learned."""
    with extra_needed("The learned floors need scikit-learn", "report"):
        import sklearn.neural_network  # noqa: F401


class GoalLearner:
    """The learned floors of one task in one setting; the same input gives the same predictions.

    Args:
        told: instructions of the task to learn from, with their episodes.
        judged: others, on which the best view and model of each place are chosen.
    """

    def __init__(self, told: Sequence[Told], judged: Sequence[Told]) -> None:
        check_learning_support()
        if not told or not judged:
            raise InvalidValueError("The learned floors have no instruction to learn from.")
        self._vocabulary = goal_vocabulary(told[0][0].task)
        sets = [[(Heard.of(one), one[0].goal) for one in each] for each in (told, judged)]
        self._places = {
            (slot, index): _PlaceLearner(slot, index, vocabulary, *sets)
            for slot, vocabulary in self._vocabulary.items()
            for index in range(vocabulary.longest)
        }

    def guesses(self, floor: LearnedFloor, heard: Sequence[Heard]) -> list[TextGuess]:
        """Return what a floor makes of some instructions of the task.

        What a command states plainly is taken from it, by all but the floors without words.
        """
        found = {place: one.predict(floor, heard) for place, one in self._places.items()}
        return [
            {
                slot: _stated(floor, one, slot, vocabulary)
                or tuple(
                    (value,)
                    for index in range(vocabulary.longest)
                    if (value := found[slot, index][row]) is not None
                )
                for slot, vocabulary in self._vocabulary.items()
            }
            for row, one in enumerate(heard)
        ]


def _stated(
    floor: LearnedFloor, heard: Heard, slot: str, vocabulary: SlotVocabulary
) -> tuple[tuple[Value, ...], ...]:
    if slot in heard.open or "words" not in _VIEWS[floor]:
        return ()
    named = named_values(heard.text, slot, vocabulary)
    return tuple((one.value,) for one in named if one.stated)


class _PlaceLearner:
    """All that predict one place of a slot, and which of them each floor takes.

    Learns from instructions whose command leaves the slot open; without any it is the majority.
    """

    def __init__(
        self,
        slot: str,
        index: int,
        vocabulary: SlotVocabulary,
        told: Sequence[tuple[Heard, Goal]],
        judged: Sequence[tuple[Heard, Goal]],
    ) -> None:
        self._slot, self._vocabulary = slot, vocabulary
        values = [dict(enumerate(values_in(goal[slot]))).get(index) for _, goal in told]
        self._frequent = [value for value, _ in Counter(values).most_common()]
        answers = [
            (heard, value)
            for (heard, _), value in zip(told, values, strict=True)
            if slot in heard.open
        ]
        self._readers: dict[Way, Any] = {}
        self._best: dict[LearnedFloor, Way] = {}
        if not answers or len(self._frequent) == 1:
            return
        right: dict[Way, int] = {}
        tested = [one for one in judged if slot in one[0].open]
        for way in itertools.starmap(Way, itertools.product(_VIEWS["union"], MODELS)):
            self._readers[way] = self._fit(way, answers)
            found = self._predict(way, [heard for heard, _ in tested]) if tested else []
            right[way] = sum(
                value == dict(enumerate(values_in(goal[slot]))).get(index)
                for value, (_, goal) in zip(found, tested, strict=True)
            )
        for floor, views in _VIEWS.items():
            ways = [way for way in right if way.view in views]
            if ways:
                self._best[floor] = max(ways, key=right.__getitem__)

    def predict(self, floor: LearnedFloor, heard: Sequence[Heard]) -> list[Value | None]:
        """Return the value of the place for each instruction; None for none."""
        if floor not in self._best or not heard:
            return [self._frequent[0]] * len(heard)
        return self._predict(self._best[floor], heard)

    def _fit(self, way: Way, answers: Sequence[tuple[Heard, Value | None]]) -> Any:  # noqa: ANN401 - scikit-learn has no types
        labels = [self._label(way.view, *answer) for answer in answers]
        inputs = [self._input(way.view, heard) for heard, _ in answers]
        reader = _reader(way, is_constant=len(set(labels)) == 1)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that an iteration more would be better
            return reader.fit(inputs, labels)

    def _predict(self, way: Way, heard: Sequence[Heard]) -> list[Value | None]:
        labels = self._readers[way].predict([self._input(way.view, one) for one in heard])
        return [self._value(way.view, one, label) for one, label in zip(heard, labels, strict=True)]

    def _input(self, view: View, heard: Heard) -> str | SceneFacts:
        if view == "scene":
            return heard.facts
        return (
            heard.text if view == "words" else marked_text(heard.text, self._slot, self._vocabulary)
        )

    def _label(self, view: View, heard: Heard, value: Value | None) -> str:
        if view != "order" or value is None:
            return _NONE if value is None else str(value)
        named = self._named(heard)
        return str(named.index(value)) if value in named else _UNNAMED

    def _value(self, view: View, heard: Heard, label: str) -> Value | None:
        if label == _NONE:
            return None
        if view != "order":
            return next(value for value in self._frequent if str(value) == label)
        named = self._named(heard)
        if label != _UNNAMED and int(label) < len(named):
            return named[int(label)]
        unnamed = [value for value in self._frequent if value not in named and value is not None]
        return unnamed[0] if unnamed else self._frequent[0]

    def _named(self, heard: Heard) -> tuple[Value, ...]:
        if self._slot in heard.candidates:
            return heard.candidates[self._slot]
        named = named_values(heard.text, self._slot, self._vocabulary)
        return tuple(dict.fromkeys(one.value for one in named))


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
    predictor = (
        LogisticRegression(C=10.0, max_iter=200)
        if way.model == "linear"
        else MLPClassifier((32,), alpha=1e-3, max_iter=30, random_state=_SEED)
    )
    if way.view == "scene":
        return make_pipeline(DictVectorizer(), MaxAbsScaler(), predictor)
    # Presence counts, frequency does not; words that occur once cannot help.
    ngrams = CountVectorizer(ngram_range=_NGRAMS, binary=True, min_df=2)
    return make_pipeline(ngrams, predictor)
