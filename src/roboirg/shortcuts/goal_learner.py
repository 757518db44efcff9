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
    """One way to learn: what the model sees of an instruction, and the kind of model."""

    view: View
    model: Model


_VIEWS_OF_FLOOR: Mapping[LearnedFloor, tuple[View, ...]] = {
    "majority": (),
    "text-only": ("words", "order"),
    "scene-only": ("scene",),
    "union": ("words", "order", "scene"),
}
_WAYS = [Way(view, model) for view, model in itertools.product(_VIEWS_OF_FLOOR["union"], MODELS)]
_NGRAMS = (1, 3)
"""Lengths of the n-grams, in words."""
_SEED = 0
_NONE = "none"
"""Stands for a place that a goal does not have."""
_UNNAMED = "unnamed"
"""Stands for a value that the text does not name, where the others are ranks."""

InstructedEpisode = tuple[Episode, Instruction]
"""An episode and one of its instructions."""


class LearnerInput(NamedTuple):
    """What learners get of an instruction and its scene, without the goal.

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
    def of(cls, instructed: InstructedEpisode) -> LearnerInput:
        """Return what learners may know of an instruction and its scene; nothing of the goal.

        *There is a red cube and a blue one. Take the first one.* -> the goal slot ``color`` is
        open, as the command names no color; its candidates are red and blue, in this order. A slot
        whose values are not all mentioned has no candidates.
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
    """Return the goal slots, such as ``color``, whose values the command does not name.

    Among them are those that the instruction's metadata list as ``touched``: their values have to
    be seen in the scene.
    """
    episode, instruction = instructed
    touched = cast("list[str]", instruction.metadata.get("touched", []))
    return hidden_slots(instruction, episode.goal).union(touched)


def check_learning_support() -> None:
    """Check early that floors can be learned."""
    with extra_needed("The learned floors need scikit-learn", "report"):
        import sklearn.neural_network  # noqa: F401


class GoalLearner:
    """Baselines that learn to guess goals without understanding, for one task in one setting.

    The same input gives the same predictions. Each baseline is a *learned floor*: what a policy
    that understands has to exceed.

    Args:
        training: instructions of the task to learn from, with their episodes.
        validation: others, on which the best view and model of each place are chosen.
    """

    def __init__(
        self, training: Sequence[InstructedEpisode], validation: Sequence[InstructedEpisode]
    ) -> None:
        check_learning_support()
        if not training or not validation:
            raise InvalidValueError("The learned floors have no instruction to learn from.")
        episode, _ = training[0]
        self._vocabulary = goal_vocabulary(episode.task)
        examples = _examples(training)
        tests = _examples(validation)
        self._learners: dict[str, list[_PlaceLearner]] = {}
        for slot, vocabulary in self._vocabulary.items():
            learners: list[_PlaceLearner] = []
            for number in range(vocabulary.longest):
                place = _FieldPlace(slot, number, vocabulary)
                learners.append(_PlaceLearner(place, examples, tests))
            self._learners[slot] = learners

    def guesses(self, floor: LearnedFloor, inputs: Sequence[LearnerInput]) -> list[TextGuess]:
        """Return a baseline's guess of the goal of each instruction of the task.

        A guess has, by goal slot, a value for each place: of two colors to pick, the first and the
        second. For example ``{"colors": (("red",), ("blue",)), "repeats": ((2,),)}``.

        Values that the command states plainly are read from it, unless the baseline sees no words;
        a learner predicts all others.
        """
        guesses: list[dict[str, tuple[Candidates, ...]]] = [{} for _ in inputs]
        for slot, learners in self._learners.items():
            # A list for each place, with a value for each instruction: it is faster to predict the
            # values of all instructions at once.
            by_place = [learner.predict(floor, inputs) for learner in learners]
            for number, instruction in enumerate(inputs):
                predicted = [predictions[number] for predictions in by_place]
                present = [value for value in predicted if value is not None]
                stated = self._stated(floor, instruction, slot)
                guesses[number][slot] = tuple(certain(stated or present))
        return list(guesses)

    def _stated(self, floor: LearnedFloor, given: LearnerInput, slot: str) -> tuple[Value, ...]:
        """Return the values of a slot that a command states; none if the floor sees no words."""
        if slot in given.open or "words" not in _VIEWS_OF_FLOOR[floor]:
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


class _FieldPlace(NamedTuple):
    """One place of a goal slot, from 0: of the colors of two containers, the first one, say."""

    slot: str
    number: int
    vocabulary: SlotVocabulary

    def value_in(self, goal: Goal) -> Value | None:
        """Return what a goal has at the place; None if its slot is shorter."""
        values = values_in(goal[self.slot])
        return values[self.number] if self.number < len(values) else None

    def open_in(self, examples: Sequence[_Example]) -> list[_Example]:
        """Return the examples whose command leaves the slot open."""
        return [example for example in examples if self.slot in example.given.open]


class _PlaceLearner:
    """Predicts one value of a goal: all fitted models, and which of them each floor uses.

    Learns from instructions whose command does not name the value. Without any, it predicts the
    most frequent value.
    """

    def __init__(
        self, place: _FieldPlace, training: Sequence[_Example], validation: Sequence[_Example]
    ) -> None:
        self._place = place
        # By frequency; None, where a goal does not have the place, counts as a value.
        counts = Counter(place.value_in(example.goal) for example in training)
        self._by_frequency = [value for value, _ in counts.most_common()]
        self._models: dict[Way, Any] = {}
        self._best_ways: dict[LearnedFloor, Way] = {}
        open_examples = place.open_in(training)
        if open_examples and len(self._by_frequency) > 1:
            self._learn(open_examples, place.open_in(validation))

    def _learn(self, training: Sequence[_Example], validation: Sequence[_Example]) -> None:
        """Fit a model for every way; each floor gets the one that is right most often.

        Args:
            training: to fit the models.
            validation: other instructions, on which right predictions are counted.
        """
        numbers_right: dict[Way, int] = {}
        for way in _WAYS:
            self._models[way] = self._fit(way, training)
            numbers_right[way] = self._count_right(way, validation)
        for floor, views in _VIEWS_OF_FLOOR.items():
            ways = [way for way in _WAYS if way.view in views]
            if ways:
                self._best_ways[floor] = max(ways, key=numbers_right.__getitem__)

    def _count_right(self, way: Way, validation: Sequence[_Example]) -> int:
        """Return for how many instructions a fitted model predicts the goal's value."""
        if not validation:
            return 0
        predicted = self._predict(way, [example.given for example in validation])
        count = 0
        for value, example in zip(predicted, validation, strict=True):
            if value == self._place.value_in(example.goal):
                count += 1
        return count

    def predict(self, floor: LearnedFloor, inputs: Sequence[LearnerInput]) -> list[Value | None]:
        """Return the value that a floor predicts for each instruction.

        None predicts that the goal has no value at this place, such as no second color.
        """
        if floor not in self._best_ways or not inputs:
            return [self._by_frequency[0]] * len(inputs)
        return self._predict(self._best_ways[floor], inputs)

    def _fit(self, way: Way, examples: Sequence[_Example]) -> Any:  # noqa: ANN401 - scikit-learn has no types
        """Return a scikit-learn pipeline, fitted on all examples, which it sees in one way."""
        labels = [self._label(way.view, example) for example in examples]
        features = self._model_inputs(way.view, [example.given for example in examples])
        model = _unfitted_model(way, is_constant=len(set(labels)) == 1)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that an iteration more would be better
            return model.fit(features, labels)

    def _predict(self, way: Way, inputs: Sequence[LearnerInput]) -> list[Value | None]:
        """Return the value that the model of a way predicts for each instruction.

        None predicts that the goal has no value at this place.
        """
        labels = self._models[way].predict(self._model_inputs(way.view, inputs))
        pairs = zip(inputs, labels, strict=True)
        return [self._value_of_label(way.view, instruction, label) for instruction, label in pairs]

    def _model_inputs(self, view: View, inputs: Sequence[LearnerInput]) -> list[str | SceneFacts]:
        return [self._model_input(view, instruction) for instruction in inputs]

    def _model_input(self, view: View, given: LearnerInput) -> str | SceneFacts:
        """Return what a model sees of an instruction: the scene, the words, or marked words.

        In the last view, ``order``, ranks stand for named values: *rank0 and rank1; the rank0 one*.
        """
        if view == "scene":
            return given.facts
        if view == "words":
            return given.text
        return marked_text(given.text, self._place.slot, self._place.vocabulary)

    def _label(self, view: View, example: _Example) -> str:
        """Return the class that a model should predict for a example, as a text.

        It is the goal's value: ``"blue"``. In the view ``order`` it is the value's rank among the
        values that the text names, from 0: ``"1"`` for blue after red.
        """
        value = self._place.value_in(example.goal)
        if value is None:
            return _NONE
        if view != "order":
            return str(value)
        named = self._introduced(example.given)
        return str(named.index(value)) if value in named else _UNNAMED

    def _value_of_label(self, view: View, given: LearnerInput, label: str) -> Value | None:
        """Return the value that a predicted label stands for, the reverse of `_label`.

        In the view ``order``, ``"1"`` is the second value that the text names.
        """
        if label == _NONE:
            return None
        if view != "order":
            return next(value for value in self._by_frequency if str(value) == label)
        named = self._introduced(given)
        if label != _UNNAMED and int(label) < len(named):
            return named[int(label)]
        # The label is `_UNNAMED`, or a rank above the number of named values.
        for value in self._by_frequency:
            if value is not None and value not in named:
                return value
        return self._by_frequency[0]

    def _introduced(self, given: LearnerInput) -> tuple[Value, ...]:
        """Return the slot's values in the order in which the text introduces them, each once.

        If the instruction lists no candidates, all values that the text names count.
        """
        if self._place.slot in given.candidates:
            return given.candidates[self._place.slot]
        named = named_values(given.text, self._place.slot, self._place.vocabulary)
        return tuple(dict.fromkeys(mention.value for mention in named))


def _unfitted_model(way: Way, *, is_constant: bool) -> Any:  # noqa: ANN401 - scikit-learn has no types
    """Return a scikit-learn pipeline, not fitted, that turns a view into numbers and classifies it.

    Args:
        way: the view and the kind of model.
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
    if way.model == "linear":
        predictor = LogisticRegression(C=10.0, max_iter=200)
    else:
        predictor = MLPClassifier((32,), alpha=1e-3, max_iter=30, random_state=_SEED)
    if way.view == "scene":
        return make_pipeline(DictVectorizer(), MaxAbsScaler(), predictor)
    # An n-gram counts once in a text; one that only a single text has cannot help with others.
    ngrams = CountVectorizer(ngram_range=_NGRAMS, binary=True, min_df=2)
    return make_pipeline(ngrams, predictor)
