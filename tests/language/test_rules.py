"""What the language promises: no leaks, paired words, exact spans, balanced patterns, English."""

import itertools
import json
import re
from collections import Counter

import pytest
from language_variants import TASKS, default_variants, random_episodes, split_episodes, variants

from roboirg.episode import COLOURS
from roboirg.language import STAGE_SETS, instruct, templates
from roboirg.language.patterns import deduction, sequence
from roboirg.language.settings import all_settings
from roboirg.language.words import CARDINALS
from roboirg.splits import get_episode
from roboirg.tasks import all_tasks, get_task

SPELLINGS = {
    1: ("1", "one", "ones", "once", "first", "single", "1st"),
    2: ("2", "two", "twos", "twice", "second", "double", "2nd", "both", "pair"),
    3: ("3", "three", "threes", "thrice", "third", "3rd"),
    4: ("4", "four", "fours", "fourth", "4th"),
    5: ("5", "five", "fives", "fifth", "5th"),
}


def words_of(text):
    return re.findall(r"[a-z0-9]+", text.lower())


COLOUR_SLOTS = {"colour", "colours"}
DERIVED = {
    "colour exclusion": COLOUR_SLOTS,
    "number deduction": {"repeats", "counts", "visit"},
    "sequential relation": {"visit", "placement", "relation"},
    "contextual logic": {"colours", "relation"},
}
TIME_WORDS = {"before", "after", "earlier", "later", "previous", "previously", "next", "following"}


def hidden_slots(instruction, goal):
    """The slots that the command must not state."""
    slots = {slot for slot, _ in goal.slots}
    if instruction.setting in ("direct", "contextual"):
        return slots
    if instruction.setting == "spatial":
        return slots & COLOUR_SLOTS
    return slots & DERIVED[instruction.metadata["pattern"]]


def spellings(value):
    if isinstance(value, tuple):
        return set().union(*(spellings(one) for one in value))
    if isinstance(value, int):
        return set(SPELLINGS[value])
    if value in COLOURS:
        return {*COLOURS, "reds", "greens", "blues"}
    return TIME_WORDS


def without_ranks(instruction):
    """The command without what only ranks the introduced values: *the first* of three colours."""
    text = instruction.command
    last = len(instruction.utterances) - 1
    ranks = ("first", "second", "third")
    for mention in reversed(instruction.mentions):
        if mention.utterance == last and mention.expression in ranks:
            text = text[: mention.start] + text[mention.end :]
    return text


@pytest.mark.parametrize("task", TASKS)
def test_implicit_commands_leak_no_hidden_value(task):
    for episode in split_episodes(task):
        for setting, form, options in default_variants(episode):
            if form == "resolved" or setting == "explicit":
                continue
            instruction = instruct(episode, setting, form, **options)
            words = set(words_of(without_ranks(instruction)))
            hidden = hidden_slots(instruction, episode.goal)
            assert hidden
            for slot in hidden:
                leaked = words & spellings(episode.goal[slot])
                assert not leaked, (instruction.command, episode.goal)
            for landmark in instruction.metadata["landmarks"]:
                assert landmark not in instruction.command


@pytest.mark.parametrize("task", TASKS)
def test_one_episode_has_one_wording(task):
    for episode in itertools.islice(split_episodes(task), 100):
        explicit = instruct(episode)
        direct, contextual = instruct(episode, "direct"), instruct(episode, "contextual")
        assert instruct(episode, "contextual", stages=(1, 5)).turns == direct.turns
        assert contextual.turns[0] == direct.turns[0]
        assert contextual.command == direct.command
        resolved = instruct(episode, "direct", "resolved")
        assert resolved.turns == (direct.turns[0], explicit.command)
        long = instruct(episode, "contextual", distractors=4)
        assert long.turns[:3] == contextual.turns[:3]
        assert long.turns[-2:] == contextual.turns[-2:]


@pytest.mark.parametrize("task", TASKS)
def test_resolved_differs_from_implicit_only_in_its_references(task):
    for episode in itertools.islice(split_episodes(task), 100):
        for setting in all_settings():
            if setting not in {variant[0] for variant in default_variants(episode)}:
                continue
            implicit, resolved = (instruct(episode, setting, form) for form in FORM_PAIR)
            assert implicit.turns[:-1] == resolved.turns[:-1]
            assert without_mentions(implicit) == without_mentions(resolved)
            last = len(resolved.utterances) - 1
            assert not [
                one for one in resolved.mentions if one.utterance == last and one.role == "anaphor"
            ]
            if setting != "explicit":
                assert implicit.command != resolved.command


FORM_PAIR = ("implicit", "resolved")


def without_mentions(instruction):
    last = len(instruction.utterances) - 1
    text = instruction.command
    for mention in reversed([one for one in instruction.mentions if one.utterance == last]):
        text = text[: mention.start] + "@" + text[mention.end :]
    return text


@pytest.mark.parametrize("task", TASKS)
def test_mention_spans_are_exact(task):
    for episode in itertools.islice(split_episodes(task), 60):
        for setting, form, options in variants(episode):
            instruction = instruct(episode, setting, form, **options)
            order = [(one.utterance, one.start, one.end) for one in instruction.mentions]
            assert order == sorted(order)
            for mention in instruction.mentions:
                span = instruction.span(mention)
                assert span
                assert span == span.strip()
                assert (mention.expression is None) == (mention.role == "antecedent")
                if mention.role == "anaphor":
                    assert not set(words_of(span)) & set(COLOURS)
                if (
                    mention.expression not in (None, "pair", "other")
                    and "those" not in span.lower()
                ):
                    assert mention.expression in span.lower().split()


@pytest.mark.parametrize("task", TASKS)
def test_mentions_hold_the_goals_values_and_point_at_something(task):
    for episode in split_episodes(task):
        for setting, form, options in variants(episode):
            instruction = instruct(episode, setting, form, **options)
            introduced = set()
            for mention in instruction.mentions:
                values = values_of(episode.goal, mention)
                assert mention.slot == "reference" or mention.value in values, mention
                if mention.role == "antecedent":
                    introduced.add((mention.slot, mention.value))
                else:
                    assert referents(mention) <= introduced, (instruction.text, mention)
                if mention.expression == "other":
                    check_other(instruction, mention)


def values_of(goal, mention):
    value = goal.as_mapping().get(mention.slot)
    values = value if isinstance(value, tuple) else (value,)
    return (" and ".join(values),) if mention.expression == "them" else values


def referents(mention):
    """What an anaphor needs to have been introduced."""
    if mention.expression == "other":
        return set()  # derived: the goal's value itself never was
    values = mention.value.split(" and ") if mention.expression == "them" else [mention.value]
    return {(mention.slot, value) for value in values}


def check_other(instruction, mention):
    pair, chosen = (one.value for one in instruction.mentions[:2])
    assert {chosen, mention.value} == set(pair.split(" and "))
    assert {one.slot for one in instruction.mentions[:2]} == {"reference"}


@pytest.mark.parametrize("task", TASKS)
def test_every_choice_is_noted(task):
    for episode in itertools.islice(split_episodes(task), 24):
        said = instruct(episode, "contextual", distractors=30)
        chosen = [int(one.split("/")[1]) for one in noted(said, "distractor/")]
        remarks = [one.text for one in said.utterances if one.stage == "distractor"]
        assert [templates.NEUTRAL_DISTRACTORS[index] for index in chosen] == remarks
        rivals = instruct(episode, "contextual", distractor="competing", distractors=5)
        assert len(noted(rivals, "competing distractor/")) == 5
        derived = instruct(episode, "reasoning")
        if noted(derived, "pair anaphor/"):
            (index,) = (int(one[-1]) for one in noted(derived, "pair anaphor/"))
            assert templates.PAIR_ANAPHORS[index] in derived.command
        elif derived.metadata["relation"] != "neighbor":
            assert len(noted(derived, "relation/" if named(derived) else "complement/")) == 1
        if "spatial" in get_task(task).settings:
            placed = instruct(episode, "spatial")
            assert len(noted(placed, "landmark-")) == len(placed.metadata["landmarks"])


def named(instruction):
    return instruction.metadata["relation"] is not None


def noted(instruction, purpose):
    return [one for one in instruction.metadata["templates"] if one.startswith(purpose)]


@pytest.mark.parametrize("task", TASKS)
def test_english(task):
    for episode in random_episodes(task, 40):
        for setting, form, options in variants(episode):
            for text in instruct(episode, setting, form, **options).turns:
                check_english(text)


def check_english(text):
    assert text == text.strip()
    assert text[0].isupper()
    assert text.endswith(".")
    assert not re.search(r"[{}\[\]|]|  | [,.;]|,,|\.\.", text), text
    assert all(sentence[0].isupper() for sentence in text.split(". ")), text
    words = words_of(text)
    assert not [one for one, two in itertools.pairwise(words) if one == two], text
    assert not re.search(r"\ba [aeio]", text.lower()), text
    assert not re.search(r"\ban [^aeiou]", text.lower()), text
    assert not re.search(r"\b(one|1) (times|cubes|containers|cats|minutes|meetings)\b", text), text
    assert not re.search(r"\b(two|three|four|five) (time|cube|container|cat|minute)\b", text), text
    colour = "(red|blue|green)"
    assert not re.search(rf"\bone (more |fewer )?{colour} cubes\b", text), text
    assert not re.search(rf"\b(two|three|four|five|ten|many) {colour} cube\b", text), text
    assert not re.search(r"\b(up|down) it\b|colour|favourite|neighbour", text), text


def test_neutral_remarks_and_cues_name_nothing_that_fills_a_slot():
    forbidden = {*COLOURS, "left", "right", "front", "back", "near", "far", "there", "corner"}
    forbidden |= {"closest", "farthest", "next", "last", "before", "cube", "container"}
    forbidden |= {"button", "target", "it", "them", "former", "latter", "half", "all"}
    forbidden |= {"after", "earlier", "then", "visit", "placement", "moment", "bin", "video"}
    forbidden |= set(itertools.chain.from_iterable(SPELLINGS.values()))
    allowed = {"last", "it", "all"}  # "last night", "it has been raining", "all right"
    for sentence in (*templates.NEUTRAL_DISTRACTORS, *templates.CUES):
        words = words_of(re.sub("all right", "", sentence.lower()))
        assert not set(words) & (forbidden - allowed), sentence


def test_there_are_enough_paraphrases():
    assert len(templates.NEUTRAL_DISTRACTORS) >= 8
    assert len(set(templates.NEUTRAL_DISTRACTORS)) == len(templates.NEUTRAL_DISTRACTORS)
    assert len(templates.CUES) >= 4
    for name, value in vars(templates).items():
        if name.endswith(("INTRODUCTIONS", "REINFORCEMENTS")):
            assert len(value) >= 3, name
    for task in all_tasks().values():
        by_parts = Counter(wording.parts for wording in task.commands.wordings)
        assert min(by_parts.values()) >= 2
        assert task.commands.patterns


@pytest.mark.parametrize("task", [task for task in TASKS if task != "BinFill"])
def test_patterns_are_balanced_in_every_difficulty(task):
    names = get_task(task).commands.patterns
    found: dict[str, Counter] = {}
    for index in range(48):
        episode = get_episode(task, "test", index)
        pattern = instruct(episode, "reasoning").metadata["pattern"]
        found.setdefault(episode.difficulty, Counter())[pattern] += 1
    for counts in found.values():
        assert set(counts) == set(names)
        assert max(counts.values()) - min(counts.values()) <= 2


def test_the_patterns_of_amounts_go_by_the_number_of_colours():
    found: dict[int, Counter] = {}
    for episode in split_episodes("BinFill"):
        pattern = instruct(episode, "reasoning").metadata["pattern"]
        found.setdefault(len(episode.goal.texts("colours")), Counter())[pattern] += 1
    assert set(found[1]) == {"colour exclusion", "number deduction"}
    assert set(found[2]) == {"contextual logic", "number deduction"}
    assert set(found[3]) == {"number deduction"}
    for colours in (1, 2):
        assert min(found[colours].values()) > 0.3 * found[colours].total()


def test_of_two_placements_none_is_told_by_its_direction():
    assert [step.name for step in sequence.steps(1, 2, (1, 2))] == ["neighbor"]
    assert [step.name for step in sequence.steps(2, 2, (1, 2))] == ["neighbor"]
    # Only the third of three is two after another one.
    assert [step.name for step in sequence.steps(3, 3, (1, 2, 3))] == ["right after"]
    four = {position: sequence.steps(position, 4, (1, 2, 3, 4)) for position in (1, 2, 3, 4)}
    assert [step.name for step in four[1]] == ["right before", "two before"]
    assert [step.name for step in four[2]] == ["right after", "right before"]  # "two" tells it
    assert [step.name for step in four[4]] == ["right after", "two after"]


def test_a_relation_leaves_the_number_open():
    names = [one.relation.name for one in deduction.deductions((3,), ((1,), (2,), (3,)))]
    # Of one to three only three is two more than something.
    assert names == ["one fewer", "one more", "two fewer", "half"]
    found = deduction.deductions((1, 3), ((1, 3), (2, 2), (1, 1), (3, 1)))
    assert [(one.relation.name, one.references) for one in found] == [
        ("two fewer", (3, 5)),
        ("half", (2, 6)),
    ]


def test_amounts_keep_count_and_colour_together():
    for episode in split_episodes("BinFill"):
        amounts = list(
            zip(episode.goal.texts("colours"), episode.goal.numbers("counts"), strict=True)
        )
        said = instruct(episode)
        values = [mention.value for mention in said.mentions]
        assert values == [value for colour, count in amounts for value in (count, colour)]
        for colour, count in amounts:
            cubes = "cube" if count == 1 else "cubes"
            assert f"{CARDINALS[count]} {colour} {cubes}" in said.text


def test_where_things_move_places_are_those_before():
    for task in TASKS:
        if "spatial" not in get_task(task).settings:
            continue
        for form in FORM_PAIR:
            said = instruct(get_episode(task, "test", 0), "spatial", form)
            moving = "Swap" in task
            assert ("before anything moved" in said.turns[0]) == moving
            assert ("before anything moved" in said.command) == moving


@pytest.mark.parametrize("task", TASKS)
def test_metadata_is_plain_and_complete(task):
    keys = None
    for episode in itertools.islice(split_episodes(task), 8):
        for setting, form, options in variants(episode):
            metadata = instruct(episode, setting, form, **options).metadata
            assert json.loads(json.dumps(metadata)) == dict(metadata)
            keys = keys or set(metadata)
            assert set(metadata) == keys
            assert metadata["language_version"] == templates.LANGUAGE_VERSION
            assert (metadata["frame"] is not None) == (setting == "spatial")
            if setting == "contextual":
                assert tuple(metadata["stages"]) in STAGE_SETS
