"""Notes on an instruction: how many slots it hides, and what else *it* could mean."""

from __future__ import annotations

import pytest

from roboirg.core.word_pools import POOLS, PoolName
from roboirg.language import instruct, plain_settings, settings_of
from roboirg.language.templates import remarks
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import get_episode


@pytest.mark.parametrize(
    ("task", "index", "setting", "hidden"),
    [
        ("PickXtimes", 0, "explicit", 0),
        ("PickXtimes", 0, "direct", 2),
        ("PickXtimes", 0, "contextual", 2),
        ("PickXtimes", 0, "reasoning", 1),
        ("PickXtimes", 0, "spatial", 1),
        ("StopCube", 0, "direct", 1),
        ("VideoUnmask", 0, "direct", 1),
        ("VideoUnmask", 3, "direct", 2),  # every value of a slot counts
    ],
)
def test_values_that_the_command_does_not_state_are_counted(
    task: str, index: int, setting: str, hidden: int
) -> None:
    episode = get_episode(task, "test", index)
    assert instruct(episode, setting).metadata["hidden_slots"] == hidden
    assert instruct(episode, setting, "resolved").metadata["hidden_slots"] == 0


@pytest.mark.parametrize("pool", POOLS)
def test_a_thing_occurs_in_its_remark(pool: PoolName) -> None:
    neutral = remarks.NEUTRAL_DISTRACTORS.of(pool)
    named = [one for one in neutral if one.thing is not None]
    for remark in named:
        assert str(remark.thing).lower() in remark.text.lower()
    share = len(named) / len(neutral)
    assert 0.25 <= share <= 0.75, "one kind is too rare to be compared with the other"


def test_a_recency_rival_is_the_thing_of_the_last_remark_where_the_command_says_it() -> None:
    things = {one.text: one.thing for one in remarks.NEUTRAL_DISTRACTORS.everything}
    seen = set()
    for task in every_task().values():
        for index in range(12):
            for number in (1, 3):
                episode = get_episode(task.name, "test", index)
                said = instruct(episode, "contextual", distractors=number)
                last = [one.text for one in said.utterances if one.stage == "distractor"][-1]
                command = len(said.utterances) - 1
                says_it = any(
                    (one.expression, one.utterance) == ("it", command) for one in said.mentions
                )
                rival = said.metadata["recency_rival"]
                assert rival == (things[last] if says_it else None)
                seen.add((says_it, rival is not None))
    assert seen == {(True, True), (True, False), (False, False)}


def test_nothing_else_has_a_recency_rival() -> None:
    episode = get_episode("SwingXtimes", "test", 0)
    for setting in set(settings_of(every_task()["SwingXtimes"])) & set(plain_settings()):
        if setting != "contextual":
            assert instruct(episode, setting).metadata["recency_rival"] is None
    for stages in ((1, 5), (1, 2, 5)):
        said = instruct(episode, "contextual", stages=stages)
        assert said.metadata["recency_rival"] is None
    competing = instruct(episode, "contextual", distractor="competing")
    assert competing.metadata["recency_rival"] is None
    assert instruct(episode, "contextual", "resolved").metadata["recency_rival"] is None
