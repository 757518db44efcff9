"""Paraphrases: what people say in other words, put into those that the other modules read.

Most replacements begin with words that texts of the benchmark do not have, so that they cost
nothing there. None knows the scene: what is unclear stays unclear.
"""

from __future__ import annotations

import functools

from roboirg.reader.negations import VERB
from roboirg.reader.phrases import Phrases, Rewrites
from roboirg.reader.tokens import (
    COLOR,
    NUMBER,
    ORDINAL,
    Sentence,
    word_set,
)
from roboirg.reader.vocabulary import PUTTING, TAKING

_CUBE = rf"(?:the )?{COLOR}s?(?: cube| one)?"
_ONE = r"(?:containers?|ones?)"
_HIDES = r"(?: (?:hiding|hidden))?"

_PARAPHRASES = Rewrites({
    # Talk around the command
    "Hello my friend, take it.":
        ("hello hi hey", r"^(?:hello|hi|hey)(?: there| my(?: dear)? \w+)*(?: ,)? (?=\w+ \w)", ""),
    "My dear robot, take it.": ("dear", r"^my dear \w+ ,? ?", ""),
    "Uh take it.": ("uh um er", r"\b(?:uh|um|er) ?,? ?", ""),
    "Excuse me, take it.": ("excuse", r"^excuse me ,? ?", ""),
    "Be careful, take it.": ("careful kind", r"\bbe (?:so )?(?:careful|kind)(?: and)?(?: as to)? ,? ?", ""),
    "Take it, thank you very much!":
        ("thank thanks", r"(?:, )?(?:thank you(?: (?:very|so) much)?|thanks(?: a lot)?)$", ""),
    "Take it, if you don't mind.": ("mind", r"(?:, )?if you do not mind$", ""),
    "Take it. That is all, nothing else.":
        ("else", r"(?:\bthat is (?:everything|all) ?,? )?(?:and |but )?\bnothing else\b", ""),
    "Having watched the video, take it.": ("having", r"^having (?:watched|seen) the video ,? ?", ""),
    # Who asks, and how
    "I would like that you take it.": (
        "like want need wish glad",
        rf"\bi (?:would (?:like|be glad)|want|need|wish)(?: to)?(?: see| have)?(?: that)? you (?:to )?(?={VERB})",
        "and "),
    "I would be happy if one red cube goes in the bin.": ("happy", r"\bi would be happy if (?:you )?", ""),
    "You will take it.": ("will got", rf"\byou (?:will|have got to) (?={VERB})", "and "),
    "Take it, and after that you press the button.":
        ("you", rf"(?:, |\b(?:and|then|so|that|finally|afterwards) )you (?={VERB})", ", "),
    "The next time you press the button.": ("you", r"\b(time|target) you (?=press|push|hit|stop)", r"\1 , "),
    "When you are done, press the button.": (
        "done finished",
        r"(?:, )?(?:\band )?\b(?:when|once|after|then) (?:(?:you are|it is) )?(?:done|finished)\b(?: so)? ?,?", " , "),
    "In the end press the button.": ("end", rf"(?:\band )?\b(?:at|in) the end ,? ?(?={VERB})", ", "),
    "And after show me the red one.": ("after", r"\band after (?=show|lift|uncover|take|put|press)", "and then "),
    "Just take it.": ("just", rf"\bjust (?={VERB})", ""),
    "So take it.": ("so", rf"\bso (?={VERB})", "and "),
    "Don't stop it until the fifth visit.": (
        "until till", r"\bdo not (stop it|press (?:it|the button)) (?:until|till) ", r"\1 "),
    "Do not lift the red one, lift the green one.": (
        "not", rf"\bdo not {VERB} (?:the one over )?(?:the )?(?P<not>{COLOR})(?: cube| one)?(?: [,;])?(?: but)? "
        r"(?=(?:lift|put|take|swing|pick) (?:the|up)\b)(?!.*\b(?P=not)\b)", ""),
    # Seeing
    "Show me one swing of the blue cube.":
        ("show", rf"\bshow me (?:that you can |how you )?(?={NUMBER} swing|{VERB})", ""),
    "Show me where the red cube is.": (
        "show", rf"\bshow (?:me|us) where (?:is )?({_CUBE})(?: is\b{_HIDES})?", r"uncover \1"),
    "Show me the blue cube.": ("show", rf"\bshow (?:me|us) (?=the\b|an?\b|{COLOR}|what\b)", "uncover "),
    "Lift it up and show me.": ("show", r"(?: ,)?(?: and| then)* show me$", ""),
    "Take it for me.": ("me", r" for me\b", ""),
    # Numbers
    "Take it 3 x.": ("x", rf"\b({NUMBER}) x\b(?! {COLOR})", r"\1 times"),
    "Take 5 x green.": ("x", rf"\b({NUMBER}) x (?={COLOR})", r"\1 "),
    "Take it x 3.": ("x", rf"\bx ({NUMBER})\b", r"\1 times"),
    "One swing of the blue cube":
        ("swing swings", rf"\b({NUMBER}) swings? (?:of|with) ({_CUBE})", r"swing \2 \1 times"),
    "four reps": ("reps rep repetitions swings", rf"\b({NUMBER}) (?:reps?|repetitions|swings)\b", r"\1 times"),
    "Do this three times.":
        ("do", rf"\bdo (?:it|this|that|so|the same(?: thing)?) (?=(?:{NUMBER}|a few) times?|once|twice)", "repeat it "),
    "No wait, do it twice.": ("wait", rf"\bno ,? ?wait ,? ?(?={VERB})", ", "),
    "one green cube and twice as many red ones": (
        "twice half double",
        rf"\b({NUMBER}) (\w+ (?:cube|one)s?\b.*?)\b(twice|half|double) as many ({COLOR}) (ones|cubes)(?! as)\b",
        r"\1 \2\3 as many \4 \5 as \1"),
    "Let it go three times over the target.":
        ("let allow", rf"\b({NUMBER} times) over the target\b", r"over the target \1"),
    "without doing anything": ("without", r"(?:, )?\bwithout doing anything\b", ""),
    "I want that the green cube goes there.": ("want", r"^i want that (?=the|an?\b)", ""),
    # Series
    "the third passing": ("passing crossing", rf"\b({ORDINAL}) (?:passing|crossing)\b", r"\1 pass"),
    "its last but one visit": ("last", r"\blast but one\b", "second to last"),
    "the last visit but one":
        ("last", r"\blast (visit|placement|time|pass|one|target) but one\b", r"second to last \1"),
    "its second last visit": ("last", r"\bsecond last\b", "second to last"),
    "the initial target": ("initial", r"\binitial\b(?= (?:target|disc|placement|visit))", "first"),
    "I liked the first placement but use the third one": (
        "liked like",
        rf"^i liked? the {ORDINAL} \w+ ,? ?but (?:use|take|choose) the ({ORDINAL}|last)(?: one)?", r"use the \1 placement"),
    # Things
    "the furthest away one": ("away", r"\b(furthest|farthest) away\b(?! from)", r"\1 from you"),
    "most on your left": ("most", r"\bmost (?:on|to) (?:your|the) (?=left|right)", "farthest to your "),
    "My favorite: put my favorite on it.":
        ("favorite", rf"\b({VERB}) my favorite(?: one| cube)?(?= on\b| in| over| and|$)", r"\1 it"),
    "lift its container": ("its", rf"\bits {_ONE}\b", "the container over it"),
    "the red cube's container": (
        "red's green's blue's one's cube's",
        rf"\b(?:the )?({COLOR})(?:'s| (?:cube|one)'s)(?: container)?(?! \w+ing)\b", r"the container over the \1 cube"),
    "the container of the red cube": ("of", rf"\b(container) of ({_CUBE})\b", r"\1 over \2"),
    "the remaining cube": ("remaining", r"\bthe remaining (?=cube|one)", "the other "),
    "the container with the blue cube under it": (
        "with has", rf"\b({_ONE}) (?:with|that has|which has) ({_CUBE})(?: (?:(?:under|beneath|in) it|inside|under))?\b",
        r"\1 over \2"),
    "the container where the red cube is": (
        "where find", rf"\b({_ONE}) (?:that |where )?(?:you (?:can )?find ({_CUBE})(?: in| under)?\b"
        rf"|(?<=where )({_CUBE}) is\b{_HIDES})", r"\1 over \2\3"),
    "the red cube that is under its container":
        ("under", rf"\b({_CUBE}) (?:that|which) is under \w+ container\b", r"\1"),
    "what is over it": ("what", r"\bwhat is (?:over|on top of)\b", "the container over"),
    "the container on top of the green cube": ("top", rf"\b{_ONE} on top of\b", "container over"),
    "Find the green cube, lift the container over it.": (
        "find", rf"\bfind ({_CUBE}) [,;] (?:and )?(\w+) the container over it\b", r"\2 the container over \1"),
    "Button press when it is there": ("button", r"^button press (?=when|on|at)", "press the button "),
    "Press both buttons first.": ("first", r"\b((?:press|push|hit) (?:the |both |two )*buttons?) first\b", r"\1"),
})  # fmt: skip
_TOPIC = Rewrites({
    "The red cube, you swing it twice.": (
        ", :", rf"^(?:now )?((?:(?:the|my) )?(?!\w+ing\b)(?:(?!is\b|was\b|are\b)[\w']+ |(?:that|which) is )+?)[,:] "
        rf"(?:you )?({'|'.join(sorted((TAKING | PUTTING) - {'find'}))})\b(?: it\b| this one\b| them\b)?(?! the\b)",
        r"\2 \1"),
})  # fmt: skip
_RUN_ON = Phrases({
    "press the button lift the container":
        rf"\b(?:cubes?|ones?|buttons?|target|bin|it|down|twice|once|times?|placement|{COLOR}) "
        r"(?P<verb>(?:lift|put|pick|take|swing|set|uncover|place|drop)(?= (?:the|it|a|up|both|what)\b)"
        r"|(?<!button )(?:press|push|hit|stop) (?:the|it|both)\b)",
})  # fmt: skip
_TOPICS = word_set("the my red green blue leftmost rightmost container now")


@functools.lru_cache(maxsize=4096)
def paraphrased(words: Sentence) -> Sentence:
    """Return a sentence in the words that the other modules read."""
    words = _PARAPHRASES.apply(words)
    if words and words[0] in _TOPICS:
        words = _TOPIC.apply(words)
    text = " ".join(words)
    found = _RUN_ON.search(text)
    while found is not None:
        text = f"{text[: found.start('verb')]}, {text[found.start('verb') :]}"
        found = _RUN_ON.search(text)
    return tuple(text.split())

