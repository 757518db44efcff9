"""Baselines that learn to guess goals without understanding: from the words or the scene alone.

A *learned floor* is such a baseline: what a policy that understands has to exceed. For each value
of a goal it is the best of several models, by their right guesses on validation instructions that
they were not fitted on. Models differ in their *view*, what they see:

- ``words``: the text as it is; they predict the value, ``blue``.
- ``order``: the text with ranks for named values, *rank0 and rank1*; they predict the rank.
- ``scene``: what can be seen of the scene, without the words; they predict the value.

Each view has a linear model and a small neural network.
"""

from __future__ import annotations

import itertools
import warnings
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, cast, get_args

from roboirg.core.episode import Episode, Goal, values_in
from roboirg.core.errors import InvalidValueError
from roboirg.core.extras import extra_needed
from roboirg.language.instruction import Instruction, hidden_slots
from roboirg.shortcuts.goal_vocabulary import (
    GoalVocabulary,
    SlotVocabulary,
    Value,
    goal_vocabulary,
)
from roboirg.shortcuts.named_values import marked_text, named_values, stated_values
from roboirg.shortcuts.scene_facts import SceneFacts, scene_facts
from roboirg.shortcuts.surface_rules import Candidates, certain
from roboirg.shortcuts.text_guess import TextGuess

LearnedFloor = Literal["majority", "text-only", "scene-only", "union"]
LEARNED_FLOORS: tuple[LearnedFloor, ...] = get_args(LearnedFloor)
View = Literal["words", "order", "scene"]
ModelKind = Literal["linear", "network"]
MODEL_KINDS: tuple[ModelKind, ...] = get_args(ModelKind)


class ModelSpec(NamedTuple):
    """A model to fit: what it sees of an instruction, and its kind."""

    view: View
    kind: ModelKind


_VIEWS_OF_FLOOR: Mapping[LearnedFloor, tuple[View, ...]] = {
    "majority": (),
    "text-only": ("words", "order"),
    "scene-only": ("scene",),
    "union": ("words", "order", "scene"),
}
"""Among the models of these views each floor has its choice; ``majority`` has no model."""
_MODEL_SPECS = [
    ModelSpec(view, kind) for view, kind in itertools.product(_VIEWS_OF_FLOOR["union"], MODEL_KINDS)
]
_NGRAMS = (1, 3)
"""Lengths of the n-grams, in words: the shortest and the longest."""
_SEED = 0
_NONE = "none"
"""Label of a position that a goal does not have, such as a second color."""
_UNNAMED = "unnamed"
"""Label of a value that the text does not name, where the other labels are ranks."""

InstructedEpisode = tuple[Episode, Instruction]
"""An episode and one of its instructions."""


class LearnerInput(NamedTuple):
    """What learners get of an instruction and its scene, without the goal.

    Attributes:
        text: all words of the instruction.
        open_slots: the goal slots that the command does not state; only these are predicted.
        candidates: by slot, the values that the text introduces on equal terms, in the order of
            mention.
        facts: features of the scene; none for learners of the words.
    """

    text: str
    open_slots: Collection[str] = ()
    candidates: Mapping[str, tuple[Value, ...]] = MappingProxyType({})
    facts: SceneFacts = MappingProxyType({})

    @classmethod
    def of(cls, instructed: InstructedEpisode) -> LearnerInput:
        """Return what learners may know of an instruction and its scene; nothing of the goal.

        *There is a red cube and a blue one. Take the first one.* -> the goal slot ``color`` is
        open, as the command names no color; its candidates are red and blue, in this order. A slot
        whose values are not all mentioned has no candidates.
        """
        episode, instruction = instructed
        candidates = _candidates_in(instruction)
        return cls(instruction.text, open_slots(instructed), candidates, scene_facts(episode.scene))


def _candidates_in(instruction: Instruction) -> dict[str, tuple[Value, ...]]:
    """Return the values that a text introduces on equal terms, by slot, in the order of mention.

    *Red or blue? …* -> ``{"color": ("red", "blue")}``. A slot whose values are not all mentioned is
    left out.
    """
    introduced = cast("Mapping[str, list[Value]]", instruction.metadata["candidates"])
    # An antecedent introduces what the command refers back to.
    antecedents: dict[Value, None] = {}  # each once, in order
    for mention in instruction.mentions:
        if mention.role == "antecedent":
            antecedents[mention.value] = None
    candidates: dict[str, tuple[Value, ...]] = {}
    for slot, values in introduced.items():
        if antecedents.keys() >= set(values):
            candidates[slot] = tuple(value for value in antecedents if value in values)
    return candidates


def open_slots(instructed: InstructedEpisode) -> frozenset[str]:
    """Return the goal slots, such as ``color``, whose values the command does not name.

    Among them are those that the instruction's metadata list as ``touched``: their values have to
    be seen in the scene.
    """
    episode, instruction = instructed
    touched = cast("list[str]", instruction.metadata.get("touched", []))
    return hidden_slots(instruction, episode.goal).union(touched)


def check_learning_support() -> None:
    """Raise `MissingDependencyError` if scikit-learn is missing, before work starts."""
    with extra_needed("The learned floors need scikit-learn", "report"):
        import sklearn.neural_network  # noqa: F401


class GoalLearner:
    """Learned floors for one task in one setting: they guess goals without understanding.

    The same input gives the same predictions.

    Args:
        training: instructions of the task to learn from, with their episodes.
        validation: others, on which the best model for each value of a goal is chosen.
    """

    def __init__(
        self, training: Sequence[InstructedEpisode], validation: Sequence[InstructedEpisode]
    ) -> None:
        check_learning_support()
        if not training or not validation:
            raise InvalidValueError("The learned floors have no instruction to learn from.")
        episode, _ = training[0]
        self._vocabulary = goal_vocabulary(episode.task)
        training_examples = _examples(training)
        validation_examples = _examples(validation)
        # By slot, a learner for each value that the slot may hold: the first color, the second.
        self._learners: dict[str, list[_ValueLearner]] = {}
        for position in _positions(self._vocabulary):
            learner = _ValueLearner(position, training_examples, validation_examples)
            self._learners.setdefault(position.slot, []).append(learner)

    def guesses(self, floor: LearnedFloor, inputs: Sequence[LearnerInput]) -> list[TextGuess]:
        """Return the goal that a floor guesses for each of some instructions of the task.

        Each guess is certain: it has one value for each position of a slot, ``{"colors":
        (("red",), ("blue",)), "repeats": ((2,),)}``. Values that the command states plainly are
        read from it, unless the floor sees no words; models predict all others.
        """
        guesses: list[dict[str, tuple[Candidates, ...]]] = [{} for _ in inputs]
        for slot in self._learners:
            slot_values = self._guessed_values(floor, inputs, slot)
            for guess, values in zip(guesses, slot_values, strict=True):
                guess[slot] = tuple(certain(values))
        return list(guesses)

    def _guessed_values(
        self, floor: LearnedFloor, inputs: Sequence[LearnerInput], slot: str
    ) -> Iterator[tuple[Value, ...]]:
        """Yield the values of a slot that a floor guesses for each instruction, in order."""
        # All instructions at once, which is faster: a list for each position of the slot.
        predictions = [learner.predict(floor, inputs) for learner in self._learners[slot]]
        for given, predicted in zip(inputs, zip(*predictions, strict=True), strict=True):
            stated = self._stated(floor, given, slot)
            # None predicts that the goal has no such value.
            yield stated or tuple(value for value in predicted if value is not None)

    def _stated(self, floor: LearnedFloor, given: LearnerInput, slot: str) -> tuple[Value, ...]:
        """Return the values of a slot that a command states; none if the floor sees no words."""
        if slot in given.open_slots or "words" not in _VIEWS_OF_FLOOR[floor]:
            return ()
        return stated_values(given.text, slot, self._vocabulary[slot])


class _Example(NamedTuple):
    """An instruction as learners get it, and the goal that they should predict."""

    given: LearnerInput
    goal: Goal


def _examples(texts: Sequence[InstructedEpisode]) -> list[_Example]:
    return [
        _Example(LearnerInput.of((episode, instruction)), episode.goal)
        for episode, instruction in texts
    ]


class _SlotPosition(NamedTuple):
    """One value of a goal slot, by its index: of two colors, the first one is 0.

    Attributes:
        slot: its name.
        value_index: of the value in the slot, from 0.
        vocabulary: of the slot.
    """

    slot: str
    value_index: int
    vocabulary: SlotVocabulary

    def value_in(self, goal: Goal) -> Value | None:
        """Return the value that a goal has here, ``"red"``; None if its slot holds fewer values."""
        values = values_in(goal[self.slot])
        return values[self.value_index] if self.value_index < len(values) else None

    def open_in(self, examples: Sequence[_Example]) -> list[_Example]:
        """Return the examples whose command does not state the slot."""
        return [example for example in examples if self.slot in example.given.open_slots]


def _positions(vocabulary: GoalVocabulary) -> Iterator[_SlotPosition]:
    """Yield every value that a goal may have, slot by slot: the first color, the second."""
    for slot, slot_vocabulary in vocabulary.items():
        for index in range(slot_vocabulary.longest):
            yield _SlotPosition(slot, index, slot_vocabulary)


class _ValueLearner:
    """Predicts one value of a goal, such as the second color, with the best model of each floor.

    It learns from the instructions whose command does not name the value. Without any, it predicts
    the most frequent value. None, where a goal does not have the value, counts as a value.
    """

    def __init__(
        self, position: _SlotPosition, training: Sequence[_Example], validation: Sequence[_Example]
    ) -> None:
        self._position = position
        counts = Counter(position.value_in(example.goal) for example in training)
        self._by_frequency = [value for value, _ in counts.most_common()]
        self._models: dict[ModelSpec, Any] = {}
        self._best_specs: dict[LearnedFloor, ModelSpec] = {}
        open_examples = position.open_in(training)
        if open_examples and len(self._by_frequency) > 1:
            self._learn(open_examples, position.open_in(validation))

    def _learn(self, training: Sequence[_Example], validation: Sequence[_Example]) -> None:
        """Fit all models, and choose for each floor the one that is right most often.

        Args:
            training: to fit the models.
            validation: other instructions, on which right predictions are counted.
        """
        numbers_right = {}
        for spec in _MODEL_SPECS:
            self._models[spec] = self._fit(spec, training)
            numbers_right[spec] = self._count_right(spec, validation)
        for floor, views in _VIEWS_OF_FLOOR.items():
            specs = [spec for spec in _MODEL_SPECS if spec.view in views]
            if specs:  # of equally good ones the first
                self._best_specs[floor] = max(specs, key=numbers_right.__getitem__)

    def _count_right(self, spec: ModelSpec, validation: Sequence[_Example]) -> int:
        """Return for how many instructions a fitted model predicts the value that the goal has."""
        if not validation:
            return 0
        predicted = self._predict(spec, [example.given for example in validation])
        count = 0
        for value, example in zip(predicted, validation, strict=True):
            if value == self._position.value_in(example.goal):
                count += 1
        return count

    def predict(self, floor: LearnedFloor, inputs: Sequence[LearnerInput]) -> list[Value | None]:
        """Return the value that a floor predicts for each instruction.

        None predicts that the goal has no such value, for example no second color.
        """
        if floor not in self._best_specs or not inputs:
            return [self._by_frequency[0]] * len(inputs)
        return self._predict(self._best_specs[floor], inputs)

    def _fit(self, spec: ModelSpec, examples: Sequence[_Example]) -> Any:  # noqa: ANN401 - scikit-learn has no types
        """Return a scikit-learn pipeline that has learned to predict the labels of some examples.

        Its inputs are what the view of the model shows of them.
        """
        labels = [self._label(spec.view, example) for example in examples]
        features = [self._model_input(spec.view, example.given) for example in examples]
        model = _unfitted_model(spec, is_constant=len(set(labels)) == 1)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that an iteration more would be better
            return model.fit(features, labels)

    def _predict(self, spec: ModelSpec, inputs: Sequence[LearnerInput]) -> list[Value | None]:
        """Return the value that a fitted model predicts for each instruction.

        None predicts that the goal has no such value.
        """
        features = [self._model_input(spec.view, given) for given in inputs]
        labels = self._models[spec].predict(features)
        pairs = zip(inputs, labels, strict=True)
        return [self._value_of_label(spec.view, given, label) for given, label in pairs]

    def _model_input(self, view: View, given: LearnerInput) -> str | SceneFacts:
        """Return what a model sees of an instruction: features of the scene, or a text.

        In the view ``words`` that is the text as it is, *red and blue; the red one*, and in
        ``order`` the text with ranks for the slot's values, *rank0 and rank1; the rank0 one*.
        """
        if view == "scene":
            return given.facts
        if view == "words":
            return given.text
        return marked_text(given.text, self._position.slot, self._position.vocabulary)

    def _label(self, view: View, example: _Example) -> str:
        """Return the label that a model should predict for an example; see `_value_of_label`.

        It is the goal's value as a text, ``"blue"``. In the view ``order`` it is the value's rank
        among the values that the text names, from 0: ``"1"`` for blue after red.
        """
        value = self._position.value_in(example.goal)
        if value is None:
            return _NONE
        if view != "order":
            return str(value)
        named = self._introduced(example.given)
        return str(named.index(value)) if value in named else _UNNAMED

    def _value_of_label(self, view: View, given: LearnerInput, label: str) -> Value | None:
        """Return the value that a predicted label stands for, the reverse of `_label`.

        In the view ``order``, ``"1"`` is the second value that the text names. ``"unnamed"``, or a
        rank that is too high, is the most frequent value that it does not name.
        """
        if label == _NONE:
            return None
        if view != "order":
            return next(value for value in self._by_frequency if str(value) == label)
        named = self._introduced(given)
        if label != _UNNAMED and int(label) < len(named):
            return named[int(label)]
        for value in self._by_frequency:
            if value is not None and value not in named:
                return value
        return self._by_frequency[0]

    def _introduced(self, given: LearnerInput) -> tuple[Value, ...]:
        """Return the slot's values in the order in which the text introduces them, each once.

        If the instruction lists no candidates, all values that the text names count.
        """
        if self._position.slot in given.candidates:
            return given.candidates[self._position.slot]
        named = named_values(given.text, self._position.slot, self._position.vocabulary)
        return tuple(dict.fromkeys(mention.value for mention in named))


def _unfitted_model(spec: ModelSpec, *, is_constant: bool) -> Any:  # noqa: ANN401 - scikit-learn has no types
    """Return a scikit-learn pipeline, not fitted, that turns a view into numbers and classifies it.

    Args:
        spec: the view and the kind of model.
        is_constant: whether there is only one class, which most classifiers refuse.
    """
    from sklearn.dummy import DummyClassifier
    from sklearn.feature_extraction import DictVectorizer
    from sklearn.feature_extraction.text import CountVectorizer
    from sklearn.linear_model import LogisticRegression
    from sklearn.neural_network import MLPClassifier
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import MaxAbsScaler

    if is_constant:
        return DummyClassifier()
    if spec.kind == "linear":
        predictor = LogisticRegression(C=10.0, max_iter=200)
    else:
        predictor = MLPClassifier((32,), alpha=1e-3, max_iter=30, random_state=_SEED)
    if spec.view == "scene":
        return make_pipeline(DictVectorizer(), MaxAbsScaler(), predictor)
    # An n-gram counts once in a text; one that only a single text has cannot help with others.
    ngrams = CountVectorizer(ngram_range=_NGRAMS, binary=True, min_df=2)
    return make_pipeline(ngrams, predictor)
