"""The learned floor: logistic regression on n-grams, trained on the words of the train split."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from roboirg.core.errors import InvalidValueError
from roboirg.core.extras import extra_needed
from roboirg.shortcuts.goal_vocabulary import Value, goal_vocabulary, values_in
from roboirg.shortcuts.shortcut_scores import ShortcutScore, Told, hidden_slots

NGRAMS = (1, 3)
"""Lengths of the n-grams, in words."""
SEED = 0
MAX_ITERATIONS = 1000
INVERSE_REGULARIZATION = 10.0
"""Of 1, 10 and 100, the one that predicts direct and reasoning of the val split best."""

Place = tuple[str, int]
"""A slot, and the position of a value in it."""


def check_learning_support() -> None:
    """Check early that the floor can be learned."""
    with extra_needed("The learned floor needs scikit-learn", "report"):
        import sklearn.linear_model  # noqa: F401


class LearnedFloor:
    """Classifiers for one task: one for each place of each slot, all on the same n-grams.

    The same instructions in the same order give the same classifiers.

    Args:
        told: instructions of the task to learn from, with their episodes.
    """

    def __init__(self, told: Sequence[Told]) -> None:
        check_learning_support()
        if not told:
            raise InvalidValueError("The learned floor has no instruction to learn from.")
        from sklearn.feature_extraction.text import CountVectorizer

        self._task = told[0][0].task
        # Presence counts, frequency does not.
        self._ngrams = CountVectorizer(ngram_range=NGRAMS, binary=True)
        features = self._ngrams.fit_transform([instruction.text for _, instruction in told])
        goals = [places_of(episode.goal.as_mapping(), self._task) for episode, _ in told]
        self._models = {
            place: _fit(features, [str(goal[place]) for goal in goals]) for place in goals[0]
        }

    def predict(self, texts: Sequence[str]) -> list[dict[Place, str]]:
        """Return for each text the value of every place in words; ``None`` if it has none."""
        features = self._ngrams.transform(texts)
        columns = {
            place: [model] * len(texts) if isinstance(model, str) else list(model.predict(features))
            for place, model in self._models.items()
        }
        return [
            {place: str(column[row]) for place, column in columns.items()}
            for row in range(len(texts))
        ]

    def scores(self, told: Sequence[Told]) -> list[ShortcutScore]:
        """Score the predictions for instructions of the task."""
        if not told:
            return []
        found = self.predict([instruction.text for _, instruction in told])
        return [self._score(one, guess) for one, guess in zip(told, found, strict=True)]

    def _score(self, told: Told, guess: Mapping[Place, str]) -> ShortcutScore:
        goal = told[0].goal
        places = places_of(goal.as_mapping(), self._task)
        right = {place: guess[place] == str(value) for place, value in places.items()}
        slots = [
            [right[slot, index] for index in range(len(values_in(goal[slot])))]
            for slot in hidden_slots(told)
        ]
        return ShortcutScore(
            tuple(Fraction(sum(one), len(one)) for one in slots), Fraction(all(right.values()))
        )


def places_of(slots: Mapping[str, Any], task: str) -> dict[Place, Value | None]:
    """Return the value at every place that a task's slots can have; None where there is none."""
    found: dict[Place, Value | None] = {}
    for slot, vocabulary in goal_vocabulary(task).items():
        values = values_in(slots[slot])
        for index in range(vocabulary.longest):
            found[slot, index] = values[index] if index < len(values) else None
    return found


def _fit(features: Any, labels: Sequence[str]) -> Any:  # noqa: ANN401 - scikit-learn has no types
    """Return a fitted classifier; the label itself if all are the same."""
    from sklearn.linear_model import LogisticRegression

    if len(set(labels)) == 1:
        return labels[0]
    model = LogisticRegression(C=INVERSE_REGULARIZATION, max_iter=MAX_ITERATIONS, random_state=SEED)
    return model.fit(features, labels)
