"""Paraphrases: what people say in other words, put into those that the other modules read.

No rule knows the scene: what is unclear stays unclear. Texts of the benchmark have few of the words
that make a rule apply, so that the rules cost little there.
"""

from __future__ import annotations

from roboirg.reader.negations import VERB
from roboirg.reader.phrases import Phrases, Rewrites
from roboirg.reader.tokens import COLOR, NUMBER, ORDINAL, Sentence, word_set
from roboirg.reader.vocabulary import PUTTING, TAKING

_PARTS = {
    "VERB": VERB,
    "MOVE": rf"(?:{'|'.join(sorted((TAKING | PUTTING) - {'find'}))})\b",
    "COLOR": COLOR,
    "NUMBER": NUMBER,
    "RANK": rf"(?:{ORDINAL}|last)",
    "CUBE": rf"(?:the )?{COLOR}s?(?: cubes?| ones?)?",
    "HUE": rf"(?:the )?({COLOR})s?(?: cubes?| ones?)?",
    "HOLDER": r"(?:containers?|ones?)",
    "NOUN": r"(?:a|the|one|same|leftmost|rightmost|closest|furthest|farthest|cubes?|ones?|of|over"
    rf"|and|,|containers?|from|you|{NUMBER}|{COLOR}s?)",
    "START": r"(?:^|(?<= \. ))(?:okay |so |now |then |and )*",
    "VALUE": rf"(?:{COLOR}|{NUMBER}|{ORDINAL})",
    "TIMES": rf"(?:{NUMBER} times?|once|twice|thrice|{NUMBER})",
    "REPAIR": r"(?: [,;])? (?:no wait|wait no|oh no|no sorry|no|i mean|sorry|actually|wait)"
    r"(?: [,;])? (?:(?:do it|the|a|an|at|on|to|over|in) )*",
    "STOP": r"(?= [.]|$)",
    "AND": r"(?: ?[.,:;]| and| then)* ",
    "MAY": r"(?: first| second| is| goes)*",
}
_RULES = Rewrites(
    # Talk around the command
    r"hello hi hey:: START(?:hello|hi|hey)(?: there| my(?: dear)? \w+)*(?: ,)? (?=\w+ \w)=>",
    r"dear:: \bmy dear \w+ ,? ?(?=VERB)=>",
    r"uh um er:: \b(?:uh|um|er) ?,? ?=>",
    r"excuse careful kind:: \b(?:excuse me|be (?:so )?(?:careful|kind)(?: and)?) ?,? ?=>",
    r"thank thanks:: (?:, )?(?:thank you(?: (?:very|so) much)?|thanks(?: a lot)?)STOP=>",
    r"if:: (?:, )?if you do not mindSTOP=>",
    r"else:: (?:\bthat is (?:everything|all) ?,? )?(?:and |but )?\bnothing else\b=>",
    r"having:: STARThaving (?:watched|seen) the video ,? ?=>",
    r"starting:: (?:, )?\bstarting (?:at|from|with|on|over) (?:the|your) right(?: target| one)?=>",
    r"without:: (?:, )?\bwithout doing anything\b=>",
    r"show:: (?: ,)?(?: and| then)* show meSTOP=>",
    # Who asks, and when
    r": you:: START((?:(?:the|my) )?(?!(?:\w+ing|with)\b)(?:(?!is\b|was\b|are\b|VERB)[\w']+ "
    r"|(?:that|which) is )+?)[,:] (?:you )?(MOVE)(?: (?:it|this one|them)\b)?(?! the\b)=>\2 \1",
    r"you:: \bi (?:would like|want|need|wish) (?:that )?you (?:to )?(?=VERB)=>and",
    r"glad if:: \bi would be (?:glad to (?:see|have)|happy if) (?:you )?=>and",
    r"comes goes:: \bi want that (?=the\b|an?\b|NUMBER)=>",
    r"will got:: \byou (?:will|have got to) (?=VERB)=>and",
    r"you:: (?:, |\b(?:and|then|so|that|finally|afterwards) )you (?=VERB)=>,",
    r"you:: \b(time|target) you (?=press|push|hit|stop)=>\1 ,",
    r"done finished:: (?:, )?(?:\band )?\b(?:when|once|after|then) (?:you are |it is )?"
    r"(?:done|finished)\b(?: so)? ?,?=>,",
    r"end:: (?:\band )?\b(?:at|in) the end ,? ?(?=VERB)=>,",
    r"show:: \band after (?=show|lift|uncover|take|put|press)=>and then",
    r"just so:: \b(?:just|so) (?=VERB)=>and",
    r"until:: \bdo not (stop it|press (?:it|the button)) until=>\1",
    r"do:: \bdo not VERB (?:the one over )?HUE(?: [,;])?(?: but)? (?=(?:lift|put|take|swing|pick) "
    r"(?:the|up)\b)(?!.*\b\1\b)=>",
    r"when:: STARTbutton press (?=when)=>press the button",
    r"buttons:: \b(both(?: the)?|the(?: two)?) buttons (?=MOVE)=>\1 buttons ,",
    r";:: ; (?=VERB|container)=>.",
    # Values taken back
    r"make:: \bmake (?:it|that) (?=the (?:former|latter|(?:first|second|other) one)\b)=>i want",
    r"wait:: START(?:no ,? )?wait ,? (?:no ,? )?(?=i (?:want|mean|would)\b|the (?:former|latter"
    r"|(?:first|second|other) (?:one|number))\b)=>no ,",
    r"or:: \b(VALUE) or (VALUE)((?: \w+){0,3}?)(?: ,)?(?: but)? not (?:the )?\1\b=>\2\3",
    r"or:: \b(VALUE) or (VALUE)((?: \w+){0,3}?)(?: ,)?(?: but)? not (?:the )?\2\b=>\1\3",
    r"no mean sorry actually wait:: (?<!not mean the )\bCOLOR(?: cubes?| ones?| container)*REPAIR"
    r"(COLOR)\b=>\1",
    r"no mean sorry actually wait:: \bTIMESREPAIR(TIMES)\b=>\1",
    r"no mean sorry actually wait:: (?<!not mean the )\bRANK(?: \w+)??REPAIR(RANK)\b=>\1",
    r"no mean sorry actually wait:: \b(?:before|after)REPAIR(before|after)\b=>\1",
    r"but:: \bnot (?:on |at )?(?:the )?RANK(?: \w+)? ,? ?but (?:on |at )?(?:the )?(RANK)\b=>\1",
    # Sights
    r"show:: \bshow (?:me|us) where (?:is )?(CUBE)(?: is\b(?: hiding| hidden)?)?=>uncover \1",
    r"show:: \bshow (?:me|us) (?=the\b|an?\b|COLOR|what\b)=>uncover",
    r"show:: \bshow me (?:that you can |how you )?(?=NUMBER swing|VERB)=>",
    r"has under inside:: \b(HOLDER) (?:with|that has|which has) (CUBE)"
    r"(?: (?:(?:under|beneath|in) it|inside|under))?\b=>\1 over \2",
    r"where:: \b(HOLDER) where (CUBE) is\b(?: hiding| hidden)?=>\1 over \2",
    r"find:: \b(HOLDER) (?:that |where )?you (?:can )?find (CUBE)(?: in| under)?\b=>\1 over \2",
    r"under:: \b(CUBE) (?:that|which) is under \w+ container\b=>\1",
    r"what:: \bwhat is (?:over|on top of)\b=>the container over",
    r"top:: \bHOLDER on top of\b=>container over",
    r"its:: \bits HOLDER\b=>the container over it",
    r"find:: \bfind (CUBE) [,;] (?:and )?(\w+) the container over it\b=>\2 the container over \1",
    r"red's green's blue's one's cube's:: \b(?:the )?(COLOR)(?:'s| (?:cube|one)'s)(?: container)?"
    r"(?! \w+ing)\b=>the container over the \1 cube",
    # Numbers and series
    r"x:: \b(NUMBER) x\b(?! COLOR)=>\1 times",
    r"x:: \b(NUMBER) x (?=COLOR)=>\1",
    r"x:: \bx (NUMBER)\b=>\1 times",
    r"swing swings:: \b(NUMBER) swings? (?:of|with) (CUBE)=>swing \2 \1 times",
    r"reps rep repetitions swings:: \b(NUMBER) (?:reps?|repetitions|swings)\b=>\1 times",
    r"do:: \bdo (?:it|this|that|so|the same(?: thing)?) (?=NUMBER times?|once|twice)=>repeat it",
    r"wait:: \bno ,? ?wait ,? ?(?=VERB)=>,",
    r"many:: \b(NUMBER) (\w+ (?:cube|one)s?\b.*?)\b(twice|half|double) as many (COLOR)"
    r" (ones|cubes)(?! as)\b=>\1 \2\3 as many \4 \5 as \1",
    r"let allow:: \b(NUMBER times) over the target\b=>over the target \1",
    r"passing crossing:: \b(RANK) (?:passing|crossing)\b=>\1 pass",
    r"last:: \b(?:last but one|second last)\b=>second to last",
    r"last:: \blast (visit|placement|time|pass|one|target) but one\b=>second to last \1",
    r"initial:: \binitial\b(?= (?:target|disc|placement|visit))=>first",
    r"use choose:: \bi liked? the RANK \w+ ,? ?but (?:use|take|choose) the (RANK)(?: one)?"
    r"=>use the \1 placement",
    # Things
    r"away:: \b(furthest|farthest) away\b(?! from)=>\1 from you",
    r"most:: \bmost (?:on|to) (?:your|the) (?=left|right)=>farthest to your",
    r"favorite:: \b(VERB) my favorite(?: one| cube)?(?= on\b| in\b| over\b| and\b| [.]|$)=>\1 it",
    r"remaining:: \bthe remaining (?=cube|one|box|tape)=>the other",
    r"containers them:: START((?:first )?CUBEMAYAND(?:first )?CUBEMAY)AND"
    r"(?:you )?(?:lift|pick up) (?:the )?containers?(?: over them)?(?: in that order)?STOP"
    r"=>lift the container over \1",
    r"wanted needed interest:: STARTHUE (?:and|or) HUE (?:are|is) (?:not|of no) \w+ [.] (.*)"
    r"\bthe other (?:cube|one)\b=>\3the cube that is neither \1 nor \2",
    r"neither:: START(?:not|neither) HUE(?: ,)?(?: and)? (?:not|nor) HUE(?: [.:,])?(.*) the "
    r"(?:other|last|one with the last) (?:cube|one|color)\b=>\3 the cube that is neither \1 nor \2",
    r"either:: \bit is not the (cube|container) ([a-z ]+?) ?[.,] (?:and )?it is not the "
    r"(?:cube|container|one) ([a-z ]+?) ,? ?eitherSTOP=>it is the \1 that is neither \2 nor \3",
    parts=_PARTS,
)  # fmt: skip
_WITHOUT_VERB = Rewrites(
    r"container:: START((?:the )?container (?:over|at|on)\b)=>lift \1",
    r"red green blue reds greens blues cube cubes:: START((?:NOUN )*?(?:COLORs?|cubes?)(?: NOUN)*?)"
    r"(?: goes| go| comes| :)?(?= (?:to|into|in|on|onto|target|used|where|same|RANK|,)\b)=>put \1",
    parts=_PARTS,
)
_WITHOUT_PRESS = Rewrites(
    r"button buttons:: (START|[,;] |\b(?:then|and) )((?:the |both |two )*buttons?)(?: press)?"
    r"(?= [,;.]|$)=>\1press \2",
    parts=_PARTS,
)
_RUN_ON = Phrases({
    "press the button lift the container":
        rf"\b(?:cubes?|ones?|buttons?|target|bin|it|down|twice|once|times?|placement|{COLOR}) "
        r"(?P<verb>(?:lift|put|pick|take|swing|set|uncover|place|drop)"
        r"(?= (?:the|it|a|up|both|what)\b)"
        r"|(?<!button )(?:press|push|hit|stop) (?:the|it|both)\b)",
})  # fmt: skip
_MOVING = TAKING | PUTTING
_PRESSES = word_set("press push hit tap stop")
_CLAUSES = _PRESSES | word_set("lift put pick take swing set uncover place drop")
_BEFORE_RUN_ON = word_set("when use")


def paraphrased(sentences: tuple[Sentence, ...]) -> tuple[Sentence, ...]:
    """Return a text in the words that the other modules read, with all its verbs."""
    present = frozenset().union(*sentences)
    verbs = _CLAUSES & present
    run_on = ("," not in present and len(verbs) > 1) or not _BEFORE_RUN_ON.isdisjoint(present)
    without_press = _PRESSES.isdisjoint(verbs)
    if (
        _RULES.leaves(present)
        and not run_on
        and verbs - _PRESSES
        and not (without_press and _WITHOUT_PRESS.leaves(present))
    ):
        return sentences
    text = _RULES.apply(" . ".join(map(" ".join, sentences)), present)
    if _MOVING.isdisjoint(text.split()):
        text = _WITHOUT_VERB.apply(text, present)
    if without_press:
        text = _WITHOUT_PRESS.apply(text, present)
    while run_on and (found := _RUN_ON.search(text)) is not None:
        text = f"{text[: found.start('verb')]}, {text[found.start('verb') :]}"
    return tuple(tuple(part.split()) for part in f" {text} ".split(" . ") if part.strip(" ,"))
