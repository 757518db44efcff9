"""Rules of the language: English, exact spans, balanced patterns, noted choices."""

import functools
import itertools
import json
import re
from collections import Counter

import pytest
from language_variants import SPATIAL_TASKS, TASKS, split_episodes
from selection import slow_but

from roboirg.core.episode import ALL_COLORS
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import POOLS, pool_of
from roboirg.language import FORMS, LANGUAGE_VERSION, STAGE_SETS, instruct, instruct_with
from roboirg.language.number_words import CARDINALS, ORDINALS
from roboirg.language.patterns import deduction, sequence
from roboirg.language.request import InstructionRequest
from roboirg.language.settings import reasoning, settings_of
from roboirg.language.slot_types.number import SAME_NUMBER
from roboirg.language.template_sampler import TemplateSampler
from roboirg.language.templates import derivations, introductions, remarks
from roboirg.language.variants import expressible_options
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode

COLOR_NAMES = frozenset(ALL_COLORS)
SAID_AS = {
    "that": ("that", *SAME_NUMBER.everything),
    "them": ("them", "those", "these"),
}
"""The words for a class of expressions, if they are not its name."""
OF_SEVERAL = ("them", "each")
"""Expressions that refer to all colors of the goal."""


UNNAMED = ("pair", "other", "choice")
"""Expression classes whose name need not be in the words."""


def words_of(text):
    return re.findall(r"[a-z0-9]+", text.lower())


@pytest.mark.parametrize("every", slow_but([31], [31, 3]))
@pytest.mark.parametrize("task", TASKS)
def test_every_text_of_the_splits(task, every):
    """English, mentions and their referents, in every setting, form and option."""
    for episode in itertools.islice(split_episodes(task), 0, None, every):
        for options in expressible_options(episode):
            instruction = instruct_with(episode, options)
            for text in instruction.turns:
                check_english(text)
            check_spans(instruction)
            check_values(instruction, episode.goal)


def check_spans(instruction):
    order = [(one.utterance, one.start, one.end) for one in instruction.mentions]
    assert order == sorted(order)
    for mention in instruction.mentions:
        span = instruction.span(mention)
        words = span.lower().split()
        assert span
        assert span == span.strip()
        assert (mention.expression is None) == (mention.role == "antecedent")
        if mention.role == "anaphor":
            assert COLOR_NAMES.isdisjoint(words)
        if mention.expression not in (None, *UNNAMED) and "those" not in words:
            said = SAID_AS.get(mention.expression, (mention.expression,))
            assert any(one in words or one == span.lower() for one in said), span


def check_values(instruction, goal):
    introduced = set()
    for mention in instruction.mentions:
        assert mention.slot == "reference" or mention.value in values_of(goal, mention), mention
        if mention.role == "antecedent":
            introduced.add((mention.slot, mention.value))
        elif mention.slot == "reference" and mention.expression == "them":
            # The value that is meant, and the others of the list.
            assert set(mention.value.split(" and ")) <= {str(value) for _, value in introduced}
        else:
            assert referents(mention) <= introduced, (instruction.text, mention)
        if mention.expression == "other" and not instruction.metadata["rival_slot"]:
            check_other(instruction, mention)


def values_of(goal, mention):
    value = goal.as_mapping().get(mention.slot)
    values = value if isinstance(value, tuple) else (value,)
    # Resolved, "of each" names all colors with the numbers to count from.
    named = mention.role == "antecedent" and mention.value == " and ".join(map(str, values))
    return (mention.value,) if named or mention.expression in OF_SEVERAL else values


def referents(mention):
    """The values that must be introduced before an anaphor."""
    if mention.expression == "other":
        return set()  # it follows from others, and was never introduced itself
    several = mention.expression in OF_SEVERAL
    values = mention.value.split(" and ") if several else [mention.value]
    return {(mention.slot, value) for value in values}


def check_other(instruction, mention):
    *pair, chosen = (one for one in instruction.mentions if one.utterance == 0)
    assert {one.slot for one in (*pair, chosen)} == {"reference"}
    values = {value for one in pair for value in str(one.value).split(" and ")}
    assert {str(chosen.value), str(mention.value)} == values


@pytest.mark.parametrize("task", TASKS)
def test_every_choice_is_noted(task):
    for episode in itertools.islice(split_episodes(task), 12):
        said = instruct(episode, "contextual", distractors=30)
        chosen = [int(one.split("/")[1]) for one in noted(said, "distractor/")]
        said_remarks = [one.text for one in said.utterances if one.stage == "distractor"]
        pool = pool_of(episode.split)
        neutral = remarks.NEUTRAL_DISTRACTORS.of(pool)
        assert [neutral[index].text for index in chosen] == said_remarks
        rivals = instruct(episode, "contextual", distractor="competing", distractors=5)
        assert len(noted(rivals, "competing distractor/")) == 5
        derived = instruct(episode, "reasoning")
        if noted(derived, "exclusion/"):
            (index,) = (int(one[-1]) for one in noted(derived, "exclusion/"))
            names = str(derived.mentions[0].value)
            pools = (derivations.EXCLUSIONS, derivations.SINGLE_EXCLUSIONS)[" and " not in names]
            assert pools.of(pool)[index].words in derived.command
        else:
            purposes = (
                ("relation/", "neighbor introduction/")
                if named(derived)
                else ("two moments/", "complement/")
            )
            assert sum(len(noted(derived, one)) for one in purposes) == 1
        if "spatial" in settings_of(get_task(task)):
            placed = instruct(episode, "spatial")
            for purpose in ("landmark class-", "landmark-"):
                assert len(noted(placed, purpose)) == len(placed.metadata["landmarks"])


def named(instruction):
    return instruction.metadata["relation"] is not None


def noted(instruction, purpose):
    return [one for one in instruction.metadata["templates"] if one.startswith(purpose)]


@functools.lru_cache(maxsize=4096)
def check_english(text):
    assert text == text.strip()
    assert text[0].isupper()
    assert text.endswith(".")
    assert not re.search(r"[{}\[\]|]|  | [,.;]|,,|\.\.", text), text
    assert not re.search(r"[,.;](?! |$)", text), text
    assert all(sentence[0].isupper() for sentence in text.split(". ")), text
    for sentence in text.split(". "):
        words = words_of(sentence)
        assert not [one for one, two in itertools.pairwise(words) if one == two], text
    lower = text.lower()
    assert not re.search(r"\ba [aeio]", lower), text
    assert not re.search(r"\ban [^aeiou]", lower), text
    assert not re.search(r"\b(up|down) it\b|colour|favourite|neighbour", text), text
    check_numbers(lower)
    check_agreement(lower)


def check_numbers(lower):
    things = "(time|cube|container|box|tape|visit|cat|minute|meeting|car|hour|apple)"
    color = f"({'|'.join(ALL_COLORS)})"
    assert not re.search(rf"\b(one|1) {things}e?s\b", lower), lower
    assert not re.search(rf"\b({MANY}) {things}\b", lower), lower
    assert not re.search(rf"\bone (more |fewer )?{color} (cubes|boxes|tapes)\b", lower), lower
    assert not re.search(rf"\b({MANY}|many) {color} (cube|box|tape)\b", lower), lower
    owned = rf"(?<!instead )(?<!\bfond )(?<!\bproud )\bof the {color} (cube|box|tape)\b"
    assert not re.search(owned, lower), lower


MANY = "|".join(CARDINALS[2:])
THING = "cube|container|box|tape"


def check_agreement(lower):
    """Verbs agree with their subject: one thing, or several joined by *and*."""
    for sentence in re.split(r"(?<=\.) ", lower):
        several = r"\b(cubes|containers|boxes|tapes|colors|those) (is|was|has)\b"
        assert not re.search(several, sentence), sentence
        # A relative clause has a verb of its own: "the corner that is near the robot".
        main = re.sub(
            r"\b(that|which|whose color) (?:(?:now|initially) )?(is|was|has|had)\b",
            r"\1",
            sentence,
        )
        found = re.search(r"\b(is|are|was|were|has|have|looks?|makes?|stands?) ", main)
        subject = main[: found.start()] if found else ""
        if re.search(r"\b(i|you|we|they|those|there)( would| still| should really)? $", subject):
            continue
        if found and re.search(rf"\b({THING}|number|visit|placement)\b", subject):
            things = rf"({THING}|visit|placement)"
            several = re.search(
                rf"\b{things}\b.* and the (\w+ )?{things}|\bthe \w+ and the \w+ {things}\b"
                rf"|\bthe {things}(e?s)\b|\b{things}\b.* and the one\b",
                subject,
            )
            plural = ("are", "were", "have", "look", "make", "stand")
            assert (found[1] in plural) == bool(several), sentence


def test_neutral_remarks_and_cues_name_nothing_that_fills_a_slot():
    forbidden = {*ALL_COLORS, "left", "right", "front", "back", "near", "far", "there", "corner"}
    forbidden |= {"closest", "farthest", "next", "last", "before", *THING.split("|")}
    forbidden |= {"button", "target", "it", "them", "former", "latter", "half", "all"}
    forbidden |= {"after", "earlier", "then", "visit", "placement", "moment", "bin", "video"}
    forbidden |= {*CARDINALS, *ORDINALS, "once", "twice", "double", "both", "pair", "single"}
    neutral = [remark.text for remark in remarks.NEUTRAL_DISTRACTORS.everything]
    for sentence in (*neutral, *remarks.CUES.everything):
        words = words_of(
            re.sub("^(Oh, |Ah, )?[Ii]t (is|may) ", "", sentence)
        )  # "It is raining again."
        assert not set(words) & forbidden, sentence


@pytest.mark.parametrize("pool", POOLS)
def test_there_are_enough_paraphrases(pool):
    neutral = remarks.NEUTRAL_DISTRACTORS.of(pool)
    assert len({remark.text for remark in neutral}) == len(neutral) >= 8
    assert len(remarks.CUES.of(pool)) >= 4
    for module in (introductions, remarks, derivations):
        for name, value in vars(module).items():
            if name.endswith(("INTRODUCTIONS", "REINFORCEMENTS")):
                assert len(value.of(pool)) >= 3, name


@pytest.mark.parametrize("task", TASKS)
def test_the_patterns_that_an_episode_allows_come_up_alike(task):
    found: dict[tuple, Counter] = {}
    for index in range(64):
        episode = get_episode(task, "random", index)
        request = request_of(episode)
        names = tuple(name for name, _ in reasoning.possible_patterns(request))
        counts = found.setdefault((episode.difficulty, names), Counter(dict.fromkeys(names, 0)))
        counts[instruct(episode, "reasoning").metadata["pattern"]] += 1
    for (_, names), counts in found.items():
        assert set(counts) == set(names)
        if counts.total() >= 24:
            assert min(counts.values()) >= 0.4 * counts.total() / len(names)


PATTERNS_OF = {
    "BinFill": {"color exclusion", "number deduction", "contextual logic"},
    "PickXtimes": {"color exclusion", "number deduction", "contextual logic"},
    "SwingXtimes": {"color exclusion", "number deduction", "contextual logic"},
    "StopCube": {"number deduction", "sequential relation", "contextual logic"},
    "VideoUnmask": {"color exclusion", "contextual logic"},
    "ButtonUnmask": {"color exclusion", "contextual logic"},
    "VideoUnmaskSwap": {"color exclusion", "contextual logic"},
    "ButtonUnmaskSwap": {"color exclusion", "contextual logic"},
    "VideoRepick": {"number deduction", "contextual logic"},
    "VideoPlaceButton": {"color exclusion", "sequential relation", "contextual logic"},
    "VideoPlaceOrder": {
        "color exclusion", "number deduction", "sequential relation", "contextual logic",
    },
    "PutInBox": {"color exclusion", "contextual logic"},
    "PickByCount": {"color exclusion", "number deduction", "contextual logic"},
}  # fmt: skip


@pytest.mark.parametrize(("task", "patterns"), PATTERNS_OF.items())
def test_every_pattern_that_makes_sense_for_a_task_is_in_the_test_split(task, patterns):
    found = {instruct(get_episode(task, "test", index), "reasoning").metadata["pattern"]
             for index in range(50)}  # fmt: skip
    assert found == patterns


def request_of(episode):
    options = InstructionOptions("reasoning")
    return InstructionRequest(episode, get_task(episode.task), options, TemplateSampler("any"))


def test_as_few_colors_are_excluded_as_leave_one():
    """In BinFill, PickXtimes and SwingXtimes scenes have one, two or three colors."""
    found = Counter()
    for task, index in itertools.product(("BinFill", "PickXtimes", "SwingXtimes"), range(96)):
        episode = get_episode(task, "test", index % 50)
        said = instruct(episode, "reasoning")
        if said.metadata["pattern"] != "color exclusion":
            continue
        present = {cube.color for cube in episode.scene.of_kind("cube")}
        (target,) = {*episode.goal.as_mapping().get("colors", ())} or {episode.goal["color"]}
        excluded = set(said.mentions[0].value.split(" and "))
        assert target not in excluded
        assert present - excluded == {target}
        assert len(excluded) == max(1, len(present) - 1)
        found[len(present)] += 1
    assert set(found) == {1, 2, 3}


def test_goals_of_both_of_two_colors_exclude_none():
    for index in range(60):
        episode = get_episode("BinFill", "random", index)
        colors = {cube.color for cube in episode.scene.of_kind("cube")}
        if len(colors) == 2 == len(episode.goal.texts("colors")):
            names = [name for name, _ in reasoning.possible_patterns(request_of(episode))]
            assert names == ["number deduction"]


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


def test_amounts_keep_count_and_color_together():
    for episode in itertools.islice(split_episodes("BinFill"), 0, None, 3):
        amounts = episode.goal.amounts
        said = instruct(episode)
        values = [mention.value for mention in said.mentions]
        assert values == [value for color, count in amounts for value in (count, color)]
        for index, (color, count) in enumerate(amounts):
            # Of three colors, only the last one has the noun.
            has_noun = len(amounts) < 3 or index == 2
            noun = ("cube" if count == 1 else "cubes") if has_noun else ""
            assert re.search(rf"\b{CARDINALS[count]} {color} ?{noun}\b", said.text)


MOVING = {"VideoUnmaskSwap": "started", "ButtonUnmaskSwap": "now"}
"""What says that a place is that before things change places: in the video, and to come."""


@pytest.mark.parametrize("pool", POOLS)
def test_where_things_move_places_are_those_before(pool):
    for task, form, index in itertools.product(SPATIAL_TASKS, FORMS, range(8)):
        said = instruct(get_episode(task, "test", index), "spatial", form, wordings=pool)
        # "The former" is the thing that the introduction names.
        pointed = "former" in said.command
        for text in (said.turns[0], *(() if pointed else (said.command,))):
            found = {words for words in MOVING.values() if re.search(rf"\b{words}\b", text)}
            assert found == ({MOVING[task]} if task in MOVING else set()), text


def test_cubes_that_will_be_covered_are_pointed_at():
    """Where the containers come after the words, the words name the cubes that are there."""
    for task, pool in itertools.product(("ButtonUnmask", "ButtonUnmaskSwap"), POOLS):
        for index in range(12):
            said = instruct(get_episode(task, "test", index), "spatial", wordings=pool)
            assert "container" not in said.turns[0].lower()
            assert re.search("the container over (the|that) (cube|one|former)", said.command)


@pytest.mark.parametrize("task", TASKS)
def test_metadata_is_plain_and_complete(task):
    keys = None
    for episode in itertools.islice(split_episodes(task), 3):
        for options in expressible_options(episode):
            metadata = instruct_with(episode, options).metadata
            assert json.loads(json.dumps(metadata)) == dict(metadata)
            keys = keys or set(metadata)
            assert set(metadata) == keys
            assert metadata["language_version"] == LANGUAGE_VERSION
            assert (metadata["frame"] is not None) == (options.setting == "spatial")
            if options.setting == "contextual":
                assert tuple(metadata["stages"]) in STAGE_SETS
