"""Paraphrases: what people say in other words, put into those that the other modules read.

Only words that texts of the benchmark do not have start a replacement, so that reading them costs
nothing more. A replacement changes one sentence and knows no scene.
"""

from __future__ import annotations

import functools

from roboirg.reader.negations import VERB
from roboirg.reader.phrases import Rewrites
from roboirg.reader.tokens import COLOR, NUMBER, ORDINAL, Sentence

_YOU_DONE = r"(?:(?:you are|it is|this is|that is|all is) )?(?:done|finished|ready)"
_HOLDER = r"(?:containers?|ones?)"
_CUBE = rf"(?:the )?{COLOR}s?(?: cube| one)?"
_DOES = r"(?:it|this|that|so|the same(?: thing)?)"

_PARAPHRASES = Rewrites({
    # Talk around the command.
    "Hello my friend, take it.": (
        "hello hi hey",
        r"^(?:hello|hi|hey)(?: there| robot| my(?: dear)? (?:friend|robot))*(?: ,)? (?=\w+ \w)", ""),
    "My dear robot, take it.": ("dear", r"^my dear (?:robot|friend) ,? ?", ""),
    "Uh just take it.": ("uh um uhm er", r"\b(?:uh|um|uhm|er) ?,? ?", ""),
    "Excuse me, take it.": ("excuse", r"^excuse me ,? ?", ""),
    "Take it, thank you very much!": (
        "thank thanks", r"(?:, )?(?:thank you(?: (?:very|so) much)?|thanks(?: a lot)?)$", ""),
    "Take it, if you don't mind.": ("mind", r"(?:, )?if you do not mind$", ""),
    "Could you be so kind and take it?": ("kind", r"\bbe so kind (?:and|as to) ", ""),
    "Take it, okay, nothing else.": (
        "else", r"(?:\bthat is (?:everything|all) ?,? ?)?(?:(?:and|but) )?\bnothing else\b", ""),
    # Who asks, and how.
    "I would like that you take it.": (
        "like want need wish glad",
        rf"\bi (?:would (?:like|be glad)|want|need|wish)(?: to)?(?: see| have)?"
        rf"(?: that)? you (?:to )?(?={VERB})", "and "),
    "I would be happy if you take it.": ("happy", r"\bi would be happy if you (?:would )?", "and "),
    "You have got to take it.": ("got", rf"\byou have got to (?={VERB})", "and "),
    "You will take it.": ("will", rf"\byou will (?={VERB})", "and "),
    "Take it, and after that you press the button.": (
        "you", rf"(?:, |\b(?:and|then|so|that|finally|afterwards) )you (?={VERB})", ", "),
    "So, can you take it.": (
        "can could", rf"\b(?:and|so) (?:,)?(?:can|could) you (?={VERB})", ", "),
    "Take it, and when you are done press the button.": (
        "done finished ready", rf"(?:, )?\b(?:(?:and|so) )?(?:when|once|after) {_YOU_DONE}\b ?,?",
        " , "),
    "Take it, and then you're done so press the button.": (
        "done finished", r"(?:, )?\band then you are (?:done|finished)(?: so)?", " ,"),
    "Take it, and in the end press the button.": (
        "end", r"\b(?:and )?(?:at|in) the end ,? ?(?=press|push|hit|lift|put|lower)", ", "),
    # Sights.
    "Show me one swing of the blue cube.": (
        "show", rf"\bshow me (?:that you can |how you )?(?={NUMBER} swing|{VERB})", ""),
    "Show me where the red cube is.": (
        "show", rf"\bshow (?:me|us) where (?:is )?({_CUBE})(?: is(?: hiding| hidden)?)?\b",
        r"uncover \1"),
    "Where is the green cube? Show me the blue cube.": (
        "show", r"\bshow (?:me|us) (?=the\b|an?\b|red\b|green\b|blue\b|what\b)", "uncover "),
    "Please lift it for me.": ("me", r" for me\b", ""),
    # Numbers.
    "3 x": ("x", rf"\b({NUMBER}) x\b(?! {COLOR}| green)", r"\1 times"),
    "5 x green": ("x", rf"\b({NUMBER}) x (?={COLOR})", r"\1 "),
    "x 3": ("x", rf"\bx ({NUMBER})\b", r"\1 times"),
    "One swing of the blue cube": (
        "swing swings",
        rf"\b({NUMBER}) swings? (?:of|with) ((?:the )?(?:{COLOR} )?(?:cube|one))",
        r"swing \2 \1 times"),
    "four reps": ("reps rep repetitions swings", rf"\b({NUMBER}) (?:reps?|repetitions|swings)\b",
                  r"\1 times"),
    "the third passing": ("passing crossing", rf"\b({ORDINAL}) (?:passing|crossing)\b", r"\1 pass"),
    # Series.
    "its last but one visit": ("last", r"\blast but one\b", "second to last"),
    "the last visit but one": ("last", r"\blast (visit|placement|time|pass|one) but one\b",
                               r"second to last \1"),
    "its second last visit": ("last", r"\bsecond last\b", "second to last"),
    "the initial target": ("initial", r"\binitial\b(?= (?:target|disc|placement|visit|place))",
                           "first"),
    # Things.
    "the furthest away cube": ("away", r"\b(furthest|farthest) away\b(?! from)", r"\1 from you"),
    "the red cube's container": (
        "red's green's blue's one's cube's",
        rf"\b(?:the )?({COLOR})(?:'s| (?:cube|one)'s) (?:container|box|lid)\b",
        r"the container over the \1 cube"),
    "green's": ("red's green's blue's", rf"\b({COLOR})'s\b", r"the container over the \1 cube"),
    "the container of the red cube": ("of", rf"\b(container) of ({_CUBE})\b", r"\1 over \2"),
    "the remaining cube": ("remaining", r"\bthe remaining (?=cube|one)", "the other "),
    "the container with the blue cube under it": (
        "under inside beneath in",
        rf"\b({_HOLDER}) (?:with|that has|which has|has) ({_CUBE})"
        r" (?:(?:hidden )?(?:under|beneath|in) it|inside(?: it)?|under)\b", r"\1 over \2"),
    "the one that has the red cube": (
        "has", rf"\b({_HOLDER}) (?:that|which) has ({_CUBE})", r"\1 over \2"),
    "the container that you can find the red cube in": (
        "find", rf"\b({_HOLDER}) (?:that |where )?you (?:can )?find ({_CUBE})(?: in| under)?\b",
        r"\1 over \2"),
    "the container where the red cube is": (
        "where", rf"\b({_HOLDER}) where ({_CUBE}) is\b(?: hiding| hidden)?", r"\1 over \2"),
    "what is over it": ("what", r"\bwhat is (?:over|on top of)\b", "the container over"),
    "the container on top of the green cube": (
        "top", rf"\b({_HOLDER}|thing) on top of\b", "container over"),
    # The same again.
    "do this three times": ("do", rf"\bdo {_DOES} (?={NUMBER}|once|twice)", "repeat it "),
})  # fmt: skip


@functools.lru_cache(maxsize=4096)
def paraphrased(words: Sentence) -> Sentence:
    """Return a sentence in the words that the other modules read."""
    return _PARAPHRASES.apply(words)
