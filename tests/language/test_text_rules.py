"""Each kind of words that was found to be wrong is named by the checker, for authors, too."""

import json
import re

import pytest
from test_scenarios import DIRECT, read
from wording_stand_ins import WOBBLY

from roboirg.apps.language_lab.scenarios.scenario_check import check_scenarios, scenes_of
from roboirg.apps.language_lab.scenarios.text_rules import GRAMMAR
from roboirg.core.word_pools import POOLS
from roboirg.language.scenarios.scenario_file import general, pointer_table

MORE = "{he} keeps talking about <it color: it>."
TURNS = "turns {repeats} today"
LIKES = "wants to see the {color} cube"
PUT = '[commands]\nall = ["Put {color} {repeats}."]\n'
CONTAINER = (
    WOBBLY.replace("PickXtimes", "VideoUnmaskSwap")
    .replace("introduction", "needs.colors = [1]\nintroduction")
    .replace('say.color = ["the cube', 'say.colors.0 = ["the container')
)


LISTED = DIRECT.replace("{color} cube", "{list} cubes").replace(
    'say.color = ["<it color: it>"]',
    'list = "color"\nneeds.list = [2, 3]\nsay.color = ["<rank color: {rank}>"]',
)


def broken(text, task="PickXtimes", step=20):
    """Return the rules that the only scenario of a file breaks."""
    (report,) = check_scenarios(read(text, task), None, scenes_of(task, 0)[::step])
    return list(report.broken)


@pytest.mark.parametrize(
    ("before", "after", "rule"),
    [
        (MORE, "{he} keeps keeps talking.", "says 'keeps keeps'; a word is doubled"),
        (MORE, "{he} wants a orange.", "says 'a orange'; 'an' is right"),
        (MORE, "{he} waited an year.", "says 'an year'; 'a' is right"),
        (MORE, "It's for the my aunt.", "says 'the my'; these are two articles"),
        (MORE, "{person.2} and {person} wants that.", "several take a plural"),
        (MORE, "They is happy.", "says 'They is'; several take a plural"),
        (MORE, "{he} don't care.", "one takes a singular"),
        (MORE, "{he} has two kid.", "says 'two kid'; several take a plural"),
        (MORE, "{he} talks about <it color: it>", "the sentence does not end"),
        (MORE, "{he} keeps talking .", "says ' .'; a space or mark is too many"),
        (MORE, "{he} talks,all day.", "says 's,a'; a space lacks"),
        (MORE, "Let's surprise {him} with the cube.", "the sentence stands twice"),
        (MORE, "{he} bought <it color: it>{color}.", "is joined to another word"),
        (TURNS, "has {repeats} candles today", "says '<None 1:one> candles'; one takes"),
        (TURNS, "has {repeats:try} today", "trys'; wrong plural"),
        (TURNS, "turns {repeats:times} times today", "it is a number already"),
        (LIKES, "sees the {color} cube and the {color} cube", "it is named twice"),
        (LIKES, "sees the {color} cube and {list} is here", "several take a plural"),
        ('say.color', 'lead = "So"\nsay.color', "lead: must end with a space: 'So'"),
        ('say.color', 'lead = "On the target on "\nsay.color', "must not follow 'on the target'"),
        ('say.color', 'resolved.color = "the {color} cube, ' + "it's so very nice, " * 9
         + '"\nsay.color', "tokens; only 64 are heard"),
    ],
)  # fmt: skip
def test_wrong_grammar_is_named_with_its_words(before, after, rule):
    text = DIRECT
    if "{list}" in after:
        text = text.replace("setting =", 'list = "color"\nneeds.list = [2]\nsetting =')
    assert before in text

    found = broken(text.replace(before, after))
    assert any(rule in sentence for sentence in found), found


def test_a_side_may_follow_a_target():
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
def test_words_that_are_false_or_depend_on_the_delivery_are_named(words, reason):
    found = broken(DIRECT.replace(LIKES, f"{LIKES}. {words}"), step=150)
    assert any(
        sentence.startswith("introduction: has the words") and reason in sentence
        for sentence in found
    )


@pytest.mark.parametrize(
    ("text", "before", "after", "rule"),
    [
        (WOBBLY, "[[scenario]]", PUT + "[[scenario]]", "the verb is 'pick up' or 'move'"),
        (WOBBLY, "cube <there", "one <there", "name the thing, 'the cube there'"),
        (WOBBLY, "wobbles {place:spot}", "wobbles at the cap {place}", "follows 'cube' or 'one'"),
        (WOBBLY, "<there place: there>", "over <there place: there>", "people say 'there' alone"),
        (CONTAINER, "table", "table", "things change places; say when they are there"),
        (CONTAINER, "The table", "Watch the {colors.0} cube. It", "is under a container"),
        (LISTED, "needs.list = [2, 3]", "needs.list = [1]", "the list has one value"),
        (LISTED, "<rank color: {rank}>", "<former color: the former>", "the list has three values"),
    ],
)
def test_places_and_lists_that_are_not_there_are_named(text, before, after, rule):
    task = "VideoUnmaskSwap" if text is CONTAINER else "PickXtimes"
    assert before in text

    found = broken(text.replace(before, after), task, 3)
    assert any(rule in sentence for sentence in found), found


def test_what_is_right_about_places_breaks_no_rule():
    assert not broken(WOBBLY)
    begun = CONTAINER.replace("The table wobbles", "At the start, a fly sat")
    assert not [sentence for sentence in broken(begun, "VideoUnmaskSwap", 3) if "says" in sentence]


def test_a_file_of_ones_own_shares_no_frame_or_sentence_with_any_task_of_the_other_pool():
    own = DIRECT.replace('"birthday"', '"doubter"')  # StopCube's, in the pool test
    own = own.replace("I forgot the candles.", "This happens to me every time.")

    assert sorted(broken(own)) == [
        "the other pool has 'frame doubter', too",
        "the other pool has 'this happens to me every time.', too",
    ]
    assert not broken(own.replace('pool = "train"', 'pool = "test"'))


@pytest.mark.parametrize("pool", POOLS)
def test_remarks_about_anything_keep_the_rules_of_distractors(pool):
    head, _, rest = DIRECT.replace('"train"', f'"{pool}"').partition("distractors = ")
    _, _, rest = rest.partition("\n")
    remarks = json.dumps(general().distractors[pool], ensure_ascii=False)

    found = broken(f"{head}distractors = {remarks}\n{rest}", step=5)

    assert not [rule for rule in found if not rule.startswith("needs ")]


def test_pools_share_no_remark_about_anything():
    train, test = (set(general().distractors[pool]) for pool in POOLS)
    assert not train & test


def test_no_pointer_says_several_times_of_one():
    """Sums and doubles are never one; of two numbers, listed or possible, singular would choose."""
    several = [row for row in pointer_table() if re.search(r"\b(?:many|often|each)\b", row.words)]
    may_be_one = [row for row in several if row.operation in ("same", "minus", "half")]
    assert len(may_be_one) > 4

    of_two = {"once for each *", "that many times", "as many times as {he} * for"}
    of_two |= {f"as many times as {who} *" for who in ("{he}", "it", "they")}
    assert of_two <= {row.words for row in may_be_one}

    agreeing = [row for row in may_be_one if row.words not in of_two]
    assert all(row.words.startswith("[repeats: ") for row in agreeing)
