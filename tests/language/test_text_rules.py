"""Each kind of words that was found to be wrong is named by the checker, for authors, too."""

import json
import re

import pytest
from wording_stand_ins import BIRTHDAY, WOBBLY, report_on

from roboirg.apps.language_lab.scenarios.text_rules import GRAMMAR
from roboirg.core.word_pools import POOLS
from roboirg.language.scenarios.scenario_file import general, pointer_table

MOVING_CONTAINERS = """
tasks = ["VideoUnmaskSwap"]
[[scenario]]
frame = "wobbly"
pool = "train"
setting = "spatial"
needs.colors = [1]
introduction = "The table wobbles {place:spot}."
say.colors.0 = ["the container <there place: there>"]
"""


def check_that_a_rule_is_broken(rule, text, task="PickXtimes", every=20):
    """Check that a rule is among those that the only scenario of a file breaks."""
    broken = list(report_on(text, task, every).broken)
    assert any(rule in sentence for sentence in broken), broken


@pytest.mark.parametrize(
    ("sentence", "rule"),
    [
        ("{he} keeps keeps talking.", "says 'keeps keeps'; a word is doubled"),
        ("{he} wants a orange.", "says 'a orange'; 'an' is right"),
        ("It's for the my aunt.", "says 'the my'; these are two articles"),
        ("{person.2} and {person} wants that.", "several take a plural"),
        ("{he} don't care.", "one takes a singular"),
        ("{he} has two kid.", "says 'two kid'; several take a plural"),
        ("{he} talks about <it color: it>", "the sentence does not end"),
        ("{he} keeps talking .", "says ' .'; a space or mark is too many"),
        ("Let's surprise {him} with the cube.", "the sentence stands twice"),
        ("{he} bought <it color: it>{color}.", "is joined to another word"),
    ],
)
def test_a_grammar_mistake_is_reported_with_the_wrong_words(sentence, rule):
    """Each sentence takes the place of *{he} keeps talking about <it color: it>.* in a scenario
    without a mistake, a birthday story. The checker must report the rule with the wrong words."""
    right = "{he} keeps talking about <it color: it>."
    assert right in BIRTHDAY
    check_that_a_rule_is_broken(rule, BIRTHDAY.replace(right, sentence))


@pytest.mark.parametrize(
    ("introduction", "rule"),
    [
        ("{person} has {repeats} candles.", "says '<None 1:one> candles'; one takes"),
        ("{person} has {repeats:try}.", "trys'; wrong plural"),
        ("{person} turns {repeats:times} times.", "it is a number already"),
        ("{person} sees the {color} cube and the {color} cube.", "it is named twice"),
        ("{person} sees the {color} cube and {list} is here.", "several take a plural"),
    ],
)
def test_a_grammar_mistake_with_a_value_of_the_goal_is_reported(introduction, rule):
    """The introduction of BIRTHDAY, a story without a mistake, is replaced. ``{repeats}`` may be
    one, which takes a singular; ``{repeats:try}`` makes a plural of *try*; ``{repeats:times}`` is
    *once* or *two times* already; ``{list}`` are two colors, for which the file gets a list."""
    text = re.sub('introduction = ".*"', f'introduction = "{introduction}"', BIRTHDAY)
    if "{list}" in introduction:
        text = text.replace("setting =", 'list = "color"\nneeds.list = [2]\nsetting =')
    check_that_a_rule_is_broken(rule, text)


@pytest.mark.parametrize(
    ("line", "rule"),
    [
        ('lead = "So"', "lead: must end with a space: 'So'"),
        ('lead = "On the target on "', "must not follow 'on the target'"),
        (
            'resolved.color = "the {color} cube, ' + "it's so very nice, " * 9 + '"',
            "tokens; only 64 are heard",
        ),
    ],
    ids=["no space", "on the target on", "too long"],
)
def test_a_mistake_in_the_command_is_reported(line, rule):
    """Each line is added to BIRTHDAY, a story without a mistake. `lead` stands before the command;
    `resolved.color` is what the form *resolved* says of the color."""
    check_that_a_rule_is_broken(rule, f"{BIRTHDAY}{line}\n")


def pattern_of(rule):
    """Return the regular expression that finds what breaks a rule."""
    (pattern,) = [pattern for pattern, named in GRAMMAR.items() if named == rule]
    return pattern


@pytest.mark.parametrize(
    ("sentence", "is_wrong"),
    [
        ("Stop it on the target on the next one.", True),
        ("Put it on the target on the left.", False),
    ],
)
def test_on_the_left_may_follow_on_the_target_but_on_the_next_one_may_not(sentence, is_wrong):
    """*Put it on the target on the next one* leaves open what stands on what; *on the left* only
    says which target. `pattern_of` returns the pattern by which the checker finds what is wrong."""
    pattern = pattern_of("what points back must not follow 'on the target'")
    assert bool(re.search(pattern, sentence)) == is_wrong


@pytest.mark.parametrize(
    ("text", "is_wrong"), [("Lift it.\nthen stop.", True), ("Lift it. Then stop.", False)]
)
def test_a_sentence_that_begins_in_lower_case_is_found(text, is_wrong):
    pattern = pattern_of("a sentence begins with a capital letter")
    assert bool(re.search(pattern, text)) == is_wrong


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("The pink one is nearest to you", "a place is a slot"),
        ("As I said, it's new", "depends on how the words are delivered"),
        ("Nobody has lifted it", "nothing was done yet"),
        ("{person} already has the {color} one", "the thing is on the table"),
        ("It's that many times minus some", "people subtract in words"),
        ("Neither of those is nice", "one is left"),
        ("{person} leaves on its {repeats} visit", "a visit is no time of day"),
        ("I got so many mails", "wrong English"),
    ],
)
def test_sentences_that_could_be_false_in_some_scene_are_reported_with_the_reason(words, reason):
    """Each sentence is added to the introduction of a good scenario, a birthday story. With fixed
    words for a color or a place, or *as I said*, it is not true of all episodes, and the checker
    must say why."""
    text = BIRTHDAY.replace("the {color} cube.", f"the {{color}} cube. {words}.")
    broken = list(report_on(text, every=150).broken)
    assert any(
        sentence.startswith("introduction: has the words") and reason in sentence
        for sentence in broken
    ), broken


@pytest.mark.parametrize(
    ("before", "after", "rule"),
    [
        (
            "[[scenario]]",
            '[commands]\nall = ["Put {color} {repeats}."]\n[[scenario]]',
            "the verb is 'pick up' or 'move'",
        ),
        ("cube <there", "one <there", "name the thing, 'the cube there'"),
        ("wobbles {place:spot}", "wobbles at the cap {place}", "follows 'cube' or 'one'"),
        ("<there place: there>", "over <there place: there>", "people say 'there' alone"),
    ],
)
def test_a_misused_place_is_reported(before, after, rule):
    """Each case replaces `before` by `after` in WOBBLY, a good scenario: *The table wobbles on the
    left. Lift the cube there.*"""
    assert before in WOBBLY
    check_that_a_rule_is_broken(rule, WOBBLY.replace(before, after), every=3)


@pytest.mark.parametrize(
    ("introduction", "rule"),
    [
        ("The table wobbles {place:spot}.", "things change places; say when they are there"),
        ("Watch the {colors.0} cube. It wobbles {place:spot}.", "is under a container"),
    ],
)
def test_a_place_or_color_that_no_longer_tells_which_container_it_is_is_reported(
    introduction, rule
):
    """MOVING_CONTAINERS is a scenario of VideoUnmaskSwap, whose introduction is replaced here. In
    this task containers cover the cubes and then change places: where something was, or a color
    that was seen, does not tell which container is meant."""
    text = MOVING_CONTAINERS.replace("The table wobbles {place:spot}.", introduction)
    check_that_a_rule_is_broken(rule, text, "VideoUnmaskSwap", every=3)


def test_a_place_of_containers_that_move_is_right_with_at_the_start():
    """MOVING_CONTAINERS is a scenario of VideoUnmaskSwap, where containers change places; its
    introduction begins *The table wobbles* and a place. *At the start, a fly sat on the left. Lift
    the container there* is right, as it says when."""
    text = MOVING_CONTAINERS.replace("The table wobbles", "At the start, a fly sat")
    broken = report_on(text, "VideoUnmaskSwap", every=3).broken
    assert not [rule for rule in broken if "says" in rule]


@pytest.mark.parametrize(
    ("sizes", "pointer", "rule"),
    [
        ("[1]", "<rank color: {rank}>", "the list has one value"),
        ("[2, 3]", "<former color: the former>", "the list has three values"),
    ],
)
def test_a_word_that_chooses_from_a_list_of_another_length_is_reported(sizes, pointer, rule):
    """The birthday story gets a list of colors; `sizes` are the lengths that it allows. *The first
    one* needs two values or more, and *the former* exactly two."""
    text = BIRTHDAY.replace("{color} cube", "{list} cubes")
    text = text.replace('["<it color: it>"]', f'["{pointer}"]')
    check_that_a_rule_is_broken(rule, f'{text}list = "color"\nneeds.list = {sizes}\n', every=3)


def test_a_correct_scenario_about_a_place_breaks_no_rule():
    """WOBBLY is *The table wobbles on the left. Lift the cube there.* Other tests put a mistake
    into it."""
    assert not report_on(WOBBLY).broken


IN_BOTH_POOLS = BIRTHDAY.replace('"birthday"', '"doubter"').replace(
    "I forgot the candles.", "This happens to me every time."
)
"""A scenario for training, with the name and a sentence of one of StopCube's in the pool test."""


def test_a_name_or_sentence_of_the_other_pool_in_a_user_s_file_is_reported():
    """IN_BOTH_POOLS is a scenario for training with the name "doubter" and a sentence of one of
    ours that is for tests. What is in both pools would leak from tests into training."""
    assert sorted(report_on(IN_BOTH_POOLS).broken) == [
        "the other pool has 'frame doubter', too",
        "the other pool has 'this happens to me every time.', too",
    ]


def test_a_name_or_sentence_of_the_same_pool_is_no_leak():
    """IN_BOTH_POOLS has the name "doubter" and a sentence of one of our scenarios, which is for
    tests. Here it is for tests, too."""
    assert not report_on(IN_BOTH_POOLS.replace('pool = "train"', 'pool = "test"')).broken


@pytest.mark.parametrize("pool", POOLS)
def test_our_general_remarks_break_no_rule_for_distracting_remarks(pool):
    """General remarks are inserted into any story: *Sorry, I was daydreaming.* Here all of a pool
    are those of a story that breaks no rule by itself, so what is reported is about a remark. JSON
    writes the list as TOML does."""
    remarks = json.dumps(general().distractors[pool], ensure_ascii=False)
    story = f"""
tasks = ["PickXtimes"]
[[scenario]]
frame = "birthday"
pool = "{pool}"
setting = "direct"
introduction = "{{person}} turns {{repeats}} today and wants to see the {{color}} cube."
reinforcement = "{{he}} keeps talking about <it color: it>."
distractors = {remarks}
competing = ["{{person.2}} has a {{rival color}} one."]
cue = "Let's surprise {{him}} with the cube."
say.color = ["<it color: it>"]
"""

    assert not report_on(story, every=5).broken


def test_no_general_remark_is_used_both_in_training_and_in_tests():
    """General remarks are said in any story: *Sorry, I was daydreaming.*"""
    remarks = general().distractors
    assert set(remarks["train"]).isdisjoint(remarks["test"])


def plural_pointers(*operations):
    """Return the pointers to numbers in plural words, such as *once for each photo*: those that
    stand for the number itself (the operation "same"), or for what is calculated from it."""
    found = set()
    for row in pointer_table():
        if row.operation in operations and re.search(r"\b(?:many|often|each)\b", row.words):
            found.add(row.words)
    return found


def test_a_plural_pointer_is_never_used_where_the_number_may_be_one():
    """The number itself, a difference and a half may be one. Words for them agree with the number:
    *[repeats: once for that photo|once for each photo]* says the first for one and the second for
    more. Excepted are words that stand for one of two numbers, where singular and plural would tell
    which; ``*`` stands for any words."""
    of_two_numbers = {
        "once for each *",
        "that many times",
        "as many times as {he} * for",
        "as many times as {he} *",
        "as many times as it *",
        "as many times as they *",
    }

    may_be_one = plural_pointers("same", "minus", "half")

    assert of_two_numbers < may_be_one
    assert all(words.startswith("[repeats: ") for words in may_be_one - of_two_numbers)
