"""Parse a sentence into clauses, each a verb with its arguments.

*Put the red cube on the target twice* is one clause: the verb ``put`` with three arguments, of the
kinds ``thing``, ``goal`` and ``times``. Words that no rule reads are returned as *unread*.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from roboirg.reader.phrases import (
    PhraseKind,
    PhraseMatch,
    PhraseRule,
    PlaceholderText,
    Rewrites,
    Token,
    Value,
    compiled,
)
from roboirg.reader.series import TARGET_RULES, TIMES_RULES
from roboirg.reader.things import Description, read_things
from roboirg.reader.tokens import Sentence, word_set
from roboirg.reader.vocabulary import LOWERING, VERB_OF

_VERB = f"(?:{'|'.join(sorted(VERB_OF, key=len, reverse=True))})"
_PARTS = {
    "VERB": _VERB,
    "PRESS": r"(?:press(?:ed|ing)?|push(?:ed|ing)?|hit(?:ting)?|tap(?:ped|ping)?)",
    "TAKEN": r"(?:lift(?:ed|ing)?|uncover(?:ed|ing)?|remov(?:ed|ing)|rais(?:ed|ing)|reveal(?:ed"
    r"|ing)?"
    r"|pick(?:ed|ing)?(?: up)?|tak(?:en|ing))",
    "YOU": r"(?:you|robot)",
    "BUTTONS": r"(?:(?:both|all) (?:of )?)?(?:the |a |your "
    r")?(?:(?:two|first|second|left|right|other)"
    r"(?: hand)? )?buttons?",
    "SO": r"(?:so|now|and|then|but|well|alright|all right|excuse me|(?:hey|hi|hello)(?: "
    r"there)?|(?:my )?(?:dear )?(?:friend|robot)|first|firstly"
    r"|second(?= ,)|secondly|first of all|next(?! to)|finally|lastly|also|to start|to begin|to "
    r"start with|to begin with|good"
    r"|in this task|yes|right)",
    "ASK": r"(?:i (?:want|need|ask|would like|wish)(?: for| that)? you(?: to)?"
    r"|(?:can|could|would|will) you(?: be so kind (?:as to|and))?|you (?:should|must|will|can|have "
    r"to"
    r"|need to|are to|are going to|got to|have got to)|(?:your|the) "
    r"(?:task|job|goal|mission|objective)"
    r" is(?: to)?|go ahead and|give it a try and|make sure (?:to|you|that you)|be sure to"
    r"|remember to|try to|do not forget to|help me(?: to)?|let us|let's|we (?:need|want|have) to"
    r"|start by|begin by|finish by|end by|start with|continue by|proceed to|you are supposed to"
    r"|it is time to|you)",
    "SHOULD": r"(?:should|must|needs to|need to|has to|have to|is to|are to)",
    "DONE": r"(?:when|once|after|as soon as) (?:(?:you are|you have|that is|it is|all is|this is"
    r"|everything is)(?: all)? )?(?:done|finished|complete|completed)(?: (?:with "
    r")?(?:that|this|so))?",
    "AFTERWARDS": r"(?:after (?:that|this|which|doing so|doing that)|afterwards?|(?<!the )(?<!its "
    r")next(?! to)|finally|lastly"
    r"|subsequently|(?:in|at) the (?:very )?end|to finish(?: up)?|to end|to complete the task"
    r"|as a last step|followed by|thereafter|later)",
    "ACTION": r"(?:(?:the |this |that |these |your )?(?:same |whole |entire |exact "
    r")*(?:it|same|this|that|so|thing"
    r"|action|actions|process|steps?(?: "
    r"(?:NUMBER|and|to|,))*|motion|procedure|sequence|movement|cycle|operation|swing"
    r"|pick and place(?: action)?|pick up and place(?: action)?)(?: again)?)",
}
# In this order: each rule sees what those before it have left.
_TALK = Rewrites(
    r"^(?:(?:and|then|,|please) )*(?:(?:first )?(?:watch|look at)|(?:after|having|when you "
    r"have|once you "
    r"have) (?:watching|watched|seen|seeing)) (?:the|this) video(?: first)?(?: ,)?(?: and)?=>",
    r"rolls? of (?:adhesive )?(?=tape)=>",
    r"tape rolls?=>tape",
    r"SHOULD be (?:placed|put|dropped|set)=>put",
    r"SHOULD be (?:moved|carried|brought|transferred)=>move",
    r"SHOULD be (?:lifted|picked up|raised|removed|uncovered)=>take",
    r"SHOULD be (?:pressed|pushed)=>press",
    r"SHOULD (?=go)=>",
    r"fill (?:up )?the bin with (.*?)(?= ,|$| and press| then)=>put \1 in the bin",
    r"[;,] (?:and |then )*(?:second|secondly|third|thirdly) ,=>,",
    r"^(?:(?:SO|ASK) (?:, )*)+(?=\S)=>",
    r"(?:,|:) ?(?:if you (?:can|do not mind|please|would)|thank you(?: very much| so much)?|for me"
    r"|my friend|robot)=>",
    r"(?:for me|if you can|thank you(?: very much| so much)?|will you|would you|can you)$=>",
    r"for me=>",
    r"^show me (?:that you can|how you(?: can)?)=>",
    r"(?:up )?until (?:it|the cube|this|the COLOR cube) (?:has been|is|was|have been) \w+"
    r"(?: (?:there|up|on the target|to the target))? (?=NUMBER times|once|twice)=>",
    r"(?:show|find) (?:me|us)=>uncover",
    r"(?:,|and|then) after (?=(?:you )?VERB)=>, ",
    r"((?:,|and|then|;|afterwards|that) )+(?:ASK|also|now) (?=VERB)=>, ",
    r"(?<!that )(?<!which )(?<!cube )(?<!after )(?<!before )(?<!once )(?<!when )(?<!if )(?<!where )"
    r"you (?:(?:can|must|should|will|have to|need to) )?(?=VERB)=>",
    r"(?:,|and)* ?nothing else=>",
    r"in (?:that|this) order=>",
    r"(?:and |, )*(?:AFTERWARDS|DONE)=>then",
    r"((?:it|them|thing) )?(?:back )?(?:up and (?:back )?down)=>\1",
    r"back and forth=>",
    r"pick and place=>take and put",
    r"(?:VERB) ACTION (?=NUMBER|once|twice|again|another|a second|x)=>repeat it ",
    r"let (?:go of )?(it|them) (?:go|fall|drop)|let go of (?=it)=>put \1 down",
    r"again (?:and again)=>again , again",
    parts=_PARTS,
)
"""Polite and roundabout wordings become plain ones: *could you lift it* -> *lift it*."""
_PRESSING = Rewrites(
    r"(?:when|once|after|as soon as) (?:you )?(?:have |had )?PRESS (BUTTON)=>press \1 ,",
    r"(?:when|once|after|as soon as) (BUTTON) (?:has been|have been|is|are|was|were) PRESS"
    r"=>press \1 ,",
    r"before (?:you )?PRESS (BUTTON)=>, press \1",
    r"(?:with|by) (?:(?:a|the) press of|PRESS) (BUTTON)=>, press \1",
    r"(?<!time )(BUTTON) to (?:(?:make it )?stop|finish|end|complete)(?: (?:it|the cube|the moving "
    r"cube"
    r"|the task))?(?: (?:there|on target#\d+))?=>\1",
    r"(BUTTON) press=>press \1",
    r"(?:with|using) (BUTTON)=>, press \1",
    r"but (?:first )?press (BUTTON)(?: first)?=>, press \1",
    parts={**_PARTS, "BUTTON": r"button#\d+"},
)
"""Pressing the button becomes a clause: *after pressing button#1, …* -> *press button#1 , …*.

When it is pressed says nothing about the goal.
"""
_ORDER = Rewrites(
    r"(?:do )?(?:exactly )?the same (?:thing )?(?:for|with|to)=>take",
    r"(^|[,;] |then )(?:, )?before (?:you )?TAKEN ([^,;]*) , (?:VERB (?:up )?)?(.*)"
    r"=>\1 take \3 , take \2",
    r"(^|[,;] |then )(?:, )?after (?:you have |you )?TAKEN ([^,;]*) , (.*)=>\1 take \2 , \3",
    r"^(.*?)(?: ,)? but (?:only )?after (?:you have |you )?TAKEN (.*)=>take \2 , \1",
    r"^(.*?)(?: ,)? but (?:first VERB (?:up )?(the .*?)|(?:VERB (?:up )?)?(the .*?) first)$"
    r"=>take \2\3 , \1",
    r"VERB (?:up )?(the [^,;]*?) (?:only )?after (?:you have |you )?(?:TAKEN )?(the .*)"
    r"=>take \2 , take \1",
    r"VERB (?:up )?(the [^,;]*?) before (?:you have |you )?(?:TAKEN )?(the .*)=>take \1 , take \2",
    parts=_PARTS,
)
"""Of two picks, the one that is to be done first comes first: *before lifting the red one, lift the
blue one* -> *take the blue one , take the red one*.
"""
# The order of two picks is part of the goal only where containers are lifted.
_COVERS = compiled("containers?|uncover(?:ing)?")
_BUTTON = compiled("BUTTONS", _PARTS)
# "on target#1", "into the bin", "back to the table"
_GOAL = compiled(
    r"(?:(?:right |directly |back )?(?:on top of|to the top of|on to|on|to|over|in|in "
    r"to|at|above|atop|toward"
    r"|towards|all the way to|back on|back to) )(?P<goal>target#\d+|way#\d+|thing#\d+|(?:the "
    r")?(?:same )?"
    r"(?:bin|table|box|targets|other target))"
)
# "down", "back on the table"
_DOWN = compiled(
    r"(?:back |down |again )*(?:on|to) (?:the )?(?:table|its place|where it was)"
    r"|(?:down|back)(?: again)?"
)
_AGAIN = compiled(r"(?:repeat it )?again")
_IT = compiled(
    r"(?:both of )?(?:it|them|this one|that one|those|these|the same (?:one|thing)|this|that)"
)
_CONJUNCTIONS = word_set(", ; : . and then")
_OPENERS = word_set("first then next finally")
"""Words that may stand before the first verb of a sentence."""
_PARTICLES = word_set("up away out off down also now too")
"""Words that change nothing once everything else is read."""


class Argument(NamedTuple):
    """What a clause says about its verb, such as a thing to handle.

    Attributes:
        kind: one of those that `roboirg.reader.phrases` lists, such as ``thing`` or ``times``.
        value: the meaning of the words, whose type depends on the kind.
    """

    kind: PhraseKind
    value: Value


@dataclass
class Clause:
    """A verb with its arguments.

    *lift the red cube twice* is ``Clause("take", [Argument("thing", ...), Argument("times", 2)])``.

    Attributes:
        verb: one of the values of `vocabulary.VERB_OF`; empty without a verb.
        arguments: in the order of speaking.
    """

    verb: str
    arguments: list[Argument] = field(default_factory=list)

    @property
    def takes_no_more(self) -> bool:
        """Whether another thing begins a new clause: *put it down, then the red one*."""
        if self.verb == "press":
            return True
        return self.verb == "put" and self.has("it", "thing") and self.has("down")

    def values(self, kind: PhraseKind) -> list[Value]:
        """Return the meanings of all arguments of a kind: ``[2]`` for the kind ``times``."""
        return [argument.value for argument in self.arguments if argument.kind == kind]

    def has(self, *kinds: PhraseKind) -> bool:
        """Return whether any argument is of one of these kinds."""
        return any(argument.kind in kinds for argument in self.arguments)


@dataclass
class ParsedSentence:
    """A sentence as clauses.

    Attributes:
        clauses: in the order of speaking.
        unread: words that no rule reads.
        is_imperative: whether it begins with a verb, or has one right after a word like *first* or
            *then*: *Watch out, first lift it*.
    """

    clauses: list[Clause]
    unread: tuple[str, ...]
    is_imperative: bool

    @property
    def is_command(self) -> bool:
        """Whether every word is read and it asks for something.

        It has to press the button, or say more than *it* and *first* about a verb: *lift it twice*
        is a command, *lift it* alone is not.
        """
        if self.unread:
            return False
        for clause in self.clauses:
            if clause.verb == "press":
                return True
            if any(argument.kind not in ("it", "first") for argument in clause.arguments):
                return True
        return False

    @property
    def is_like_command(self) -> bool:
        """Whether it asks to handle a thing, even if words are left unread: *lift the big cube*."""
        if not self.clauses or not self.is_imperative:
            return False
        first = self.clauses[0]
        return first.verb in ("take", "move", "put", "press") and first.has("thing", "button")


@functools.lru_cache(maxsize=4096)
def parse_sentence(words: Sentence) -> ParsedSentence:
    """Return a sentence as clauses, and the words in it that no rule reads.

    *would you lift the red cube twice* becomes one clause: the verb ``take`` with a thing and a
    number of times. First, polite and roundabout words are rewritten, to *lift the red cube twice*;
    then a placeholder replaces each phrase, ``lift thing#1 times#0``; then the phrases after a verb
    become its arguments. The result is cached: do not change it.
    """
    text = _TALK.apply(" ".join(words))
    if _COVERS.search(text) is not None:
        text = _ORDER.apply(text)
    sentence = PlaceholderText(text)
    # Each step takes its words away from those after it, and some build on earlier placeholders.
    sentence.apply(TARGET_RULES)  # may hold a button: "the target used after pressing the button"
    sentence.apply(_BUTTON_RULES)
    sentence.text = _PRESSING.apply(sentence.text)  # is about buttons
    sentence.apply(TIMES_RULES)  # before things: of "one time", "one" could be a thing
    read_things(sentence)
    sentence.apply(_REST_RULES)  # goals are targets and things
    return _parse_tokens(list(sentence.tokens()))


def _read_words(match: PhraseMatch) -> str:
    """Return the words of a phrase, where its kind says enough: ``"the button"``."""
    return match.text


def _read_goal(match: PhraseMatch) -> Value:
    """Return where a phrase says to put something: *on target#1*, *into the bin*.

    *on target#1* gives the `Target` that the placeholder stands for, *into the bin* the noun
    ``"bin"``. A thing must be a box, described by its color or place: *in the red box*. For any
    other, *on the red cube*, it is None, so that the phrase stays unread.
    """
    words = match["goal"]  # after "on" or "to": "target#1", "the same bin"
    if "#" not in words:
        return words.rpartition(" ")[2]  # of "the same bin", the noun
    value = match.value("goal")
    if isinstance(value, Description) and (
        value.noun not in ("box", "one") or value.leaves_color_open
    ):
        return None
    return value


_BUTTON_RULES = (PhraseRule("button", _BUTTON, _read_words),)
_REST_RULES = (
    # Before what begins one: "back on target#1".
    PhraseRule("goal", _GOAL, _read_goal),
    # Before what ends one: "down again".
    PhraseRule("down", _DOWN, _read_words),
    # Before what it may begin with: "repeat it again".
    PhraseRule("again", _AGAIN, _read_words),
    PhraseRule("it", _IT, _read_words),
)


def _parse_tokens(tokens: Sequence[Token]) -> ParsedSentence:
    """Return a sentence as clauses, given its words and read phrases in order.

    ``lift thing#1 then press button#0`` has two clauses: ``take`` with a thing, and ``press`` with
    a button.
    """
    builder = _ClauseBuilder()
    for token in tokens:
        if token.kind is None:
            builder.add_word(token.text)
        else:
            builder.add_phrase(token.kind, token)
    return ParsedSentence(builder.clauses, tuple(builder.unread), _is_imperative(tokens))


def _is_imperative(tokens: Sequence[Token]) -> bool:
    """Return whether a sentence begins with a verb, or has one right after *first* or *then*.

    A comma is not enough: *okay, get ready* asks to handle nothing.
    """
    may_be_verb = True
    for token in tokens:
        if may_be_verb and token.text in VERB_OF:
            return True
        may_be_verb = token.text in _OPENERS
    return False


class _ClauseBuilder:
    """Makes clauses of the words and phrases of a sentence, which are added in order.

    Attributes:
        clauses: so far.
        unread: the words so far that belong to no clause.
    """

    def __init__(self) -> None:
        self.clauses: list[Clause] = []
        self.unread: list[str] = []
        self._follows_conjunction = False  # whether a comma, *and* or *then* stands just before

    def add_word(self, word: str) -> None:
        """Add a word of a sentence: a verb begins a clause, *lift*; other words count as unread.

        Conjunctions (*and*, commas) and words that change nothing (*also*) are skipped. *First*
        after a verb becomes an argument, and *release* also says that the thing is put down.
        """
        if word in VERB_OF:
            clause = Clause(VERB_OF[word])
            if word in LOWERING:
                clause.arguments.append(Argument("down", word))
            self.clauses.append(clause)
        elif word == "first" and self.clauses:
            self.clauses[-1].arguments.append(Argument("first", word))
        elif word not in _CONJUNCTIONS and word not in _PARTICLES:
            self.unread.append(word)
        self._follows_conjunction = word in _CONJUNCTIONS

    def add_phrase(self, kind: PhraseKind, phrase: Token) -> None:
        """Add a phrase, such as *the red cube*, as an argument of the clause that it belongs to.

        If it does not fit that clause, its words count as unread.
        """
        clause = self._clause_for(kind)
        argument = self._argument_of(clause, kind, phrase.value)
        if argument is None:
            self.unread += phrase.text.split()
        else:
            clause.arguments.append(argument)
        self._follows_conjunction = False

    def _argument_of(self, clause: Clause, kind: PhraseKind, value: Value) -> Argument | None:
        """Return a phrase as an argument of a clause; None if it does not fit there.

        Two kinds depend on what stands before:

        - A place alone is a thing only right after a verb: *take on the left*, what is there.
        - *Twice more* adds to a number after a conjunction: *lift the cube once and twice more*. In
          *lift the cube twice more* it may be the total, so it is ``extra``.
        """
        if kind == "place":
            if not clause.verb or clause.arguments:
                return None
            return Argument("thing", Description("one", is_definite=True, place=value))
        if kind == "more" and not self._follows_conjunction and clause.verb != "repeat":
            return Argument("extra", value)
        return Argument(kind, value)

    def _clause_for(self, kind: PhraseKind) -> Clause:
        """Return the clause that a phrase of a kind belongs to: the last one, or a new one.

        A new one has the verb that is left out: *put it down, then the red one* asks to take the
        red one. Before any verb it has none.
        """
        if not self.clauses:
            self.clauses.append(Clause(""))
        last = self.clauses[-1]
        if kind == "thing" and last.takes_no_more:
            self.clauses.append(Clause("take" if last.verb == "put" else ""))
        return self.clauses[-1]
