"""Counting what instructions are made of."""

from language_variants import TASKS, default_variants, split_episodes

from roboirg.language import instruct, statistics


def instructions(task):
    for episode in split_episodes(task):
        for setting, form, options in default_variants(episode):
            if form == "implicit":
                yield instruct(episode, setting, form, **options)


def test_expressions_are_counted_once_per_scene():
    said = [one for task in TASKS for one in instructions(task)]
    counts = statistics.expression_counts(said)
    assert statistics.expression_counts(said * 2) == counts
    scenes = len({one.episode for one in said})
    assert "explicit" not in counts
    assert max(number for by in counts.values() for number in by.values()) <= scenes
    ranks = {"former", "latter", "first", "second", "third"}
    assert set(counts["direct"]) == {"it", "them", "that", "then", *ranks}
    assert {"pair", "that", "other"} == set(counts["reasoning"])
    assert {"there", *ranks} == set(counts["spatial"])


def test_lengths_patterns_relations_and_landmarks():
    said = [one for task in TASKS for one in instructions(task)]
    lengths = statistics.word_counts(said)
    assert lengths["explicit"].mean < lengths["direct"].mean < lengths["contextual"].mean
    assert all(one.shortest <= one.mean <= one.longest for one in lengths.values())
    patterns = statistics.pattern_counts(said)
    assert patterns["PickXtimes"] == {"colour exclusion": 100, "number deduction": 100}
    assert sum(statistics.relation_counts(said)["PickXtimes"].values()) == 100
    assert set(statistics.relation_counts(said)["VideoPlaceOrder"]) >= {"right after", "neighbor"}
    assert set(statistics.landmark_counts(said)["VideoUnmask"]) >= {"1", "2", "3"}
