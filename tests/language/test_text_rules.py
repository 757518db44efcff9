"""Each kind of words that was found to be wrong is named by the checker, for authors, too."""

import json
import re

import pytest
from test_scenarios import BIRTHDAY, read_scenario_file
from wording_stand_ins import WOBBLY

from roboirg.apps.language_lab.scenarios.scenario_check import check_scenarios, scenes_of
from roboirg.apps.language_lab.scenarios.text_rules import GRAMMAR
from roboirg.core.word_pools import POOLS
from roboirg.language.scenarios.scenario_file import general, pointer_table

LAST_SENTENCE = "{he} keeps talking about <it color: it>."
WITH_NUMBER = "turns {repeats} today"
WITH_COLOR = "wants to see the {color} cube"
COMMAND_PUT = '[commands]\nall = ["Put {color} {repeats}."]\n'
CONTAINER_FILE = (
    WOBBLY.replace("PickXtimes", "VideoUnmaskSwap")
    .replace("introduction", "needs.colors = [1]\nintroduction")
    .replace('say.color = ["the cube', 'say.colors.0 = ["the container')
)


FILE_WITH_A_LIST = BIRTHDAY.replace("{color} cube", "{list} cubes").replace(
    'say.color = ["<it color: it>"]',
    'list = "color"\nneeds.list = [2, 3]\nsay.color = ["<rank color: {rank}>"]',
)


def broken_rules(text, task="PickXtimes", step=20):
    """Return the rules that the only scenario of a file breaks."""
    (report,) = check_scenarios(read_scenario_file(text, task), None, scenes_of(task, 0)[::step])
    return list(report.broken)


@pytest.mark.parametrize(
    ("before", "after", "rule"),
    [
        (LAST_SENTENCE, "{he} keeps keeps talking.", "says 'keeps keeps'; a word is doubled"),
        (LAST_SENTENCE, "{he} wants a orange.", "says 'a orange'; 'an' is right"),
        (LAST_SENTENCE, "{he} waited an year.", "says 'an year'; 'a' is right"),
        (LAST_SENTENCE, "It's for the my aunt.", "says 'the my'; these are two articles"),
        (LAST_SENTENCE, "{person.2} and {person} wants that.", "several take a plural"),
        (LAST_SENTENCE, "They is happy.", "says 'They is'; several take a plural"),
        (LAST_SENTENCE, "{he} don't care.", "one takes a singular"),
        (LAST_SENTENCE, "{he} has two kid.", "says 'two kid'; several take a plural"),
        (LAST_SENTENCE, "{he} talks about <it color: it>", "the sentence does not end"),
        (LAST_SENTENCE, "{he} keeps talking .", "says ' .'; a space or mark is too many"),
        (LAST_SENTENCE, "{he} talks,all day.", "says 's,a'; a space lacks"),
        (LAST_SENTENCE, "Let's surprise {him} with the cube.", "the sentence stands twice"),
        (LAST_SENTENCE, "{he} bought <it color: it>{color}.", "is joined to another word"),
        (WITH_NUMBER, "has {repeats} candles today", "says '<None 1:one> candles'; one takes"),
        (WITH_NUMBER, "has {repeats:try} today", "trys'; wrong plural"),
        (WITH_NUMBER, "turns {repeats:times} times today", "it is a number already"),
        (WITH_COLOR, "sees the {color} cube and the {color} cube", "it is named twice"),
        (WITH_COLOR, "sees the {color} cube and {list} is here", "several take a plural"),
        ('say.color', 'lead = "So"\nsay.color', "lead: must end with a space: 'So'"),
        ('say.color', 'lead = "On the target on "\nsay.color', "must not follow 'on the target'"),
        ('say.color', 'resolved.color = "the {color} cube, ' + "it's so very nice, " * 9
         + '"\nsay.color', "tokens; only 64 are heard"),
    ],
)  # fmt: skip
def test_a_grammar_mistake_is_reported_with_the_wrong_words(before, after, rule):
    """Each case puts a mistake into a scenario that has none, a birthday story."""
    text = BIRTHDAY
    if "{list}" in after:
        text = text.replace("setting =", 'list = "color"\nneeds.list = [2]\nsetting =')
    assert before in text

    found = broken_rules(text.replace(before, after))
    assert any(rule in sentence for sentence in found), found


def test_on_the_left_may_follow_on_the_target_but_on_the_next_one_may_not():
    """*Put it on the target on the next one* leaves open what stands on what."""
    reason = "what points back must not follow 'on the target'"
    (pattern,) = (pattern for pattern, found in GRAMMAR.items() if found == reason)

    assert re.search(pattern, "Stop it on the target on the next one.")
    assert not re.search(pattern, "Put it on the target on the left.")


def test_a_sentence_that_begins_in_lower_case_is_found():
    reason = "a sentence begins with a capital letter"
    (pattern,) = (pattern for pattern, found in GRAMMAR.items() if found == reason)

    assert re.search(pattern, "Lift it.\nthen stop.")
    assert not re.search(pattern, "Lift it. Then stop.")


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("The pink one is nearest to you", "a place is a slot"),
        ("There's a red line", "a color is a slot"),
        ("As I said, it's new", "depends on how the words are delivered"),
        ("Read the text above, see below", "depends on how the words are delivered"),
        ("Nobody has lifted it", "nothing was done yet"),
        ("We only have time for one more", "nothing was done yet"),
        ("{person} already has the {color} one", "the thing is on the table"),
        ("They found nothing", "the thing is on the table"),
        ("It's that many times minus some", "people subtract in words"),
        ("Neither of those is nice", "one is left"),
        ("{person} leaves on its {repeats} visit", "a visit is no time of day"),
        ("I got so many mails", "wrong English"),
    ],
)
def test_sentences_that_could_be_false_in_some_scene_are_reported_with_the_reason(words, reason):
    """Fixed words for a color or a place, or *as I said*, are not true of all episodes."""
    found = broken_rules(BIRTHDAY.replace(WITH_COLOR, f"{WITH_COLOR}. {words}"), step=150)
    assert any(
        sentence.startswith("introduction: has the words") and reason in sentence
        for sentence in found
    )


@pytest.mark.parametrize(
    ("text", "before", "after", "rule"),
    [
        (WOBBLY, "[[scenario]]", COMMAND_PUT + "[[scenario]]", "the verb is 'pick up' or 'move'"),
        (WOBBLY, "cube <there", "one <there", "name the thing, 'the cube there'"),
        (WOBBLY, "wobbles {place:spot}", "wobbles at the cap {place}", "follows 'cube' or 'one'"),
        (WOBBLY, "<there place: there>", "over <there place: there>", "people say 'there' alone"),
        (CONTAINER_FILE, "table", "table", "things change places; say when they are there"),
        (CONTAINER_FILE, "The table", "Watch the {colors.0} cube. It", "is under a container"),
        (FILE_WITH_A_LIST, "needs.list = [2, 3]", "needs.list = [1]", "the list has one value"),
        (
            FILE_WITH_A_LIST,
            "<rank color: {rank}>",
            "<former color: the former>",
            "the list has three values",
        ),
    ],
)
def test_a_misused_place_or_list_of_values_is_reported(text, before, after, rule):
    """Each case replaces a part of a scenario that breaks no rule."""
    task = "VideoUnmaskSwap" if text is CONTAINER_FILE else "PickXtimes"
    assert before in text

    found = broken_rules(text.replace(before, after), task, 3)
    assert any(rule in sentence for sentence in found), found


def test_a_correct_scenario_about_a_place_breaks_no_rule():
    """Where containers change places, saying *at the start* makes a place correct."""
    assert not broken_rules(WOBBLY)
    begun = CONTAINER_FILE.replace("The table wobbles", "At the start, a fly sat")
    assert not [
        sentence for sentence in broken_rules(begun, "VideoUnmaskSwap", 3) if "says" in sentence
    ]


def test_a_name_or_sentence_of_the_other_pool_in_a_user_s_file_is_reported():
    """Pools are the words of training and of tests; what is in both would leak into training."""
    own = BIRTHDAY.replace('"birthday"', '"doubter"')  # StopCube's, in the pool test
    own = own.replace("I forgot the candles.", "This happens to me every time.")

    assert sorted(broken_rules(own)) == [
        "the other pool has 'frame doubter', too",
        "the other pool has 'this happens to me every time.', too",
    ]
    assert not broken_rules(own.replace('pool = "train"', 'pool = "test"'))


@pytest.mark.parametrize("pool", POOLS)
def test_our_general_remarks_break_no_rule_for_distracting_remarks(pool):
    """They are inserted into a scenario that breaks no rule by itself."""
    head, _, rest = BIRTHDAY.replace('"train"', f'"{pool}"').partition("distractors = ")
    _, _, rest = rest.partition("\n")
    remarks = json.dumps(general().distractors[pool], ensure_ascii=False)

    found = broken_rules(f"{head}distractors = {remarks}\n{rest}", step=5)

    assert not [rule for rule in found if not rule.startswith("needs ")]


def test_no_general_remark_is_used_both_in_training_and_in_tests():
    train, test = (set(general().distractors[pool]) for pool in POOLS)
    assert not train & test


def test_a_plural_pointer_is_never_used_where_the_number_may_be_one():
    """Sums and doubles are never one; of two numbers, listed or possible, singular would choose."""
    several = [row for row in pointer_table() if re.search(r"\b(?:many|often|each)\b", row.words)]
    may_be_one = [row for row in several if row.operation in ("same", "minus", "half")]
    assert len(may_be_one) > 4

    of_two = {"once for each *", "that many times", "as many times as {he} * for"}
    of_two |= {f"as many times as {who} *" for who in ("{he}", "it", "they")}
    assert of_two <= {row.words for row in may_be_one}

    agreeing = [row for row in may_be_one if row.words not in of_two]
    assert all(row.words.startswith("[repeats: ") for row in agreeing)
