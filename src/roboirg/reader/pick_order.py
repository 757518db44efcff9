"""Pick order: *A after B*, *before lifting A, lift B*, *A first*, as the picks in their order."""

from __future__ import annotations

import functools

from roboirg.reader.phrases import Phrases, Rewrites
from roboirg.reader.tokens import COLOR, Sentence, colors_in, word_set

_PARTS = {
    "HUE": rf"(?:the )?({COLOR})s?(?: cube| one| container)*",
    "OVER": r"(?:the |that |it's )?(?:(?:containers?|box|one)(?: that is)? over )?",
    "ACT": r"(?:(?:you )?(?:have |had )?(?:lift(?:ed|ing)?|uncover(?:ed|ing)?|remov(?:ed?|ing)"
    r"|rais(?:ed?|ing)|reveal(?:ed|ing)?|(?:pick(?:ed|ing)?|tak(?:e|en|ing))(?: up)?) )",
    "DONE": r"(?:(?:you (?:have |had )?(?:lift|uncover|remove?|raise?|reveal|pick|take)(?:ed|n)?"
    r"|(?:lift|uncover|remov|rais|reveal|pick|tak)ing)(?: up)? )",
    "DOWN": r"(?: ?,?(?: and)? (?:put|set|lay|lower|place) (?:it|them)(?: back| down)*)?",
    "JOIN": r"(?: ?,| and| but| then| only)* ",
    "PAIR": ", then the container over",
}
_IN_ORDER = Rewrites(
    r"first:: \b((?:press|push|hit) (?:the |both |two )*buttons?(?: on the table)?) first\b=>\1",
    r"first:: ^first (?=\w)=>",
    r"after:: HUEDOWNJOINafter DONE?OVERHUEDOWN=>\2 PAIR \1",
    r"before:: HUEDOWNJOINbefore DONE?OVERHUEDOWN=>\1 PAIR \2",
    r"after:: \bafter DONEOVERHUEDOWNJOINACTOVERHUE=>lift the container over \1 PAIR \2",
    r"before:: \bbefore DONEOVERHUEDOWNJOINACTOVERHUE=>lift the container over \2 PAIR \1",
    r"second last:: HUE(?: is| goes)? (?:second|last)JOINOVERHUE(?: is| goes)? first\b=>\2 PAIR \1",
    r"first:: HUE(?: is| goes)? firstJOIN(?:ACT?OVER)HUE(?: (?:is |goes )?(?:second|last)\b)?"
    r"=>\1 PAIR \2",
    r"first:: \bfirst (OVER)HUE(?=(?:JOIN)(?:ACT)?OVERHUE)=>\1\2",
    r"first:: HUEDOWN(?: ,)? but ACT?OVERHUE first\b=>\2 PAIR \1",
    r"first:: HUEDOWN(?: ,)? but first ACTOVERHUE=>\2 PAIR \1",
    r"after that:: \band after that (?=the (?:former|latter)\b)=>and then lift",
    r"same:: \bdo (?:exactly )?the same (?:with|for|to|on) OVERHUE(?!s)"
    r"=>lift the container over \1",
    r"then finally also:: \b(it (?:(?:back|down|aside) )*(?:[,;] )?(?:and )?(?:then|also|finally) )"
    r"(?=the (?:one|container)\b)=>\1lift",
    parts=_PARTS,
)  # fmt: skip
_UNREAD = Phrases({
    "before lifting the container at the left":
        rf"\b(?:before|after) (?={_PARTS['DONE']}|{_PARTS['ACT']}"
        rf"|(?:the |that )?(?:container|box|one|{COLOR})\b)\w+ \w+",
    "the red one first": r"(?<!^)(?<!\bthe )(?<!\bat )\bfirst\b(?! of\b)",
    "the red one second":
        r"(?<!\bthe )\b(?:second|last)\b(?! (?:of|from|to|closest|nearest|farthest|furthest)\b)",
})  # fmt: skip
_THINGS = word_set("container containers box one")
_WORDS = word_set("before after first second last same then finally also")


@functools.lru_cache(maxsize=4096)
def in_order(words: Sentence) -> tuple[Sentence, str]:
    """Return a command with the pick first that comes first, and unread words for an order."""
    if _WORDS.isdisjoint(words):
        return words, ""
    text = _IN_ORDER.apply(" ".join(words), words)
    ordered = tuple(text.split())
    several = sum(word in _THINGS for word in ordered) > 1 or len(colors_in(ordered)) > 1
    unread = _UNREAD.search(text) if several else None
    return ordered, unread[0] if unread else ""
