"""Commands: a sentence as acts, each with its things, places to go and repetitions.

*Put the red cube on the target twice* is one act: the verb ``put`` and three parts, of the kinds
``thing``, ``goal`` and ``times``. What is left when all rules have been applied is *unread*.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from roboirg.reader.phrases import Chunks, FoundPhrase, PhraseRule, Rewrites, Token, Value, compiled
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
"""When the button is pressed says nothing about the goal."""
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
"""Of two picks, the one that comes first goes first."""
_COVERS = compiled("containers?|uncover(?:ing)?")
_BUTTON = compiled("BUTTONS", _PARTS)
_GOAL = compiled(
    r"(?:(?:right |directly |back )?(?:on top of|to the top of|on to|on|to|over|in|in "
    r"to|at|above|atop|toward"
    r"|towards|all the way to|back on|back to) )(?P<goal>target#\d+|way#\d+|thing#\d+|(?:the "
    r")?(?:same )?"
    r"(?:bin|table|box|targets|other target))"
)
_DOWN = compiled(
    r"(?:back |down |again )*(?:on|to) (?:the )?(?:table|its place|where it was)"
    r"|(?:down|back)(?: again)?"
)
_AGAIN = compiled(r"(?:repeat it )?again")
_IT = compiled(
    r"(?:both of )?(?:it|them|this one|that one|those|these|the same (?:one|thing)|this|that)"
)
_JOINTS = word_set(", ; : . and then")
_OPENERS = word_set("first then next finally")
"""Words before the verb of a step."""
_PARTICLES = word_set("up away out off down also now too")
"""Words that change nothing once everything else is read."""


class ActPart(NamedTuple):
    """What is said of an act.

    Attributes:
        kind: ``thing``, ``goal``, ``times`` …, as chunks have it.
        value: what the words mean.
    """

    kind: str
    value: Value


@dataclass
class Act:
    """One act of a command.

    Attributes:
        verb: the act, a value of `vocabulary.VERB_OF`; empty without a verb.
        parts: what is said of it, in order.
    """

    verb: str
    parts: list[ActPart] = field(default_factory=list)

    @property
    def takes_no_more(self) -> bool:
        """Whether another thing is a new act: *put it down, then the red one*."""
        if self.verb == "press":
            return True
        return self.verb == "put" and self.has("it", "thing") and self.has("down")

    def values(self, kind: str) -> list[Value]:
        """Return the values of all parts of a kind."""
        return [part.value for part in self.parts if part.kind == kind]

    def has(self, *kinds: str) -> bool:
        """Return whether a part is of one of some kinds."""
        return any(part.kind in kinds for part in self.parts)


@dataclass
class Reading:
    """A sentence as acts.

    Attributes:
        acts: in the order of speaking.
        unread: words that no rule reads.
        asks: whether it begins with a verb, or a step of it: *Watch out, first lift it*.
    """

    acts: list[Act]
    unread: tuple[str, ...]
    asks: bool

    @property
    def is_command(self) -> bool:
        """Whether it is a command that is read to the end, or part of one.

        It has to press the button, or say more of an act than *it* and *first*.
        """
        if self.unread:
            return False
        for act in self.acts:
            if act.verb == "press":
                return True
            if any(part.kind not in ("it", "first") for part in act.parts):
                return True
        return False

    @property
    def is_like_command(self) -> bool:
        """Whether a clause asks to handle a thing, read to the end or not."""
        if not self.acts or not self.asks:
            return False
        first = self.acts[0]
        return first.verb in ("take", "move", "put", "press") and first.has("thing", "button")


@functools.lru_cache(maxsize=4096)
def read_command(words: Sentence) -> Reading:
    """Return a sentence as acts, and the words in it that no rule reads.

    *would you lift the red cube twice* becomes one act: the verb ``take``, a thing and a number of
    times. First polite and winding words are rewritten, to *lift the red cube twice*; then each
    phrase becomes a chunk, ``lift thing#1 times#0``; then the chunks after a verb become parts of
    its act.
    """
    text = _TALK.apply(" ".join(words))
    if _COVERS.search(text) is not None:
        text = _ORDER.apply(text)
    chunks = Chunks(text)
    # Each step takes its words away from those after it, and some are made of earlier chunks.
    chunks.apply(TARGET_RULES)  # may hold a button: "the target used after pressing the button"
    chunks.apply(_BUTTON_RULES)
    chunks.text = _PRESSING.apply(chunks.text)  # is about buttons
    chunks.apply(TIMES_RULES)  # before things: of "one time", "one" could be a thing
    read_things(chunks)
    chunks.apply(_REST_RULES)  # goals are targets and things
    return _acts(chunks)


def _words(found: FoundPhrase) -> str:
    """Return the words themselves, where the kind of the chunk says enough."""
    return found.text


def _goal(found: FoundPhrase) -> Value:
    """Return where a phrase says to put something: *on target#1*, *into the bin*.

    In the text, a phrase that has been read stands as its kind and number, ``target#1``. Such a
    phrase gives what it means, a noun gives itself, ``"bin"``. None if the words are a thing that
    is no box.
    """
    words = found["goal"]  # after "on" or "to": "target#1", "the same bin"
    if "#" not in words:
        return words.rpartition(" ")[2]  # of "the same bin", the noun
    value = found.value("goal")
    if isinstance(value, Description) and (value.noun not in ("box", "one") or value.is_open):
        return None
    return value


_BUTTON_RULES = (PhraseRule("button", _BUTTON, _words),)
_REST_RULES = (
    # Before what begins one: "back on target#1".
    PhraseRule("goal", _GOAL, _goal),
    # Before what ends one: "down again".
    PhraseRule("down", _DOWN, _words),
    # Before what it may begin with: "repeat it again".
    PhraseRule("again", _AGAIN, _words),
    PhraseRule("it", _IT, _words),
)


def _acts(chunks: Chunks) -> Reading:
    """Return the acts that a sentence asks for, and its words that no rule reads.

    Its phrases have been replaced by chunks: ``lift thing#1 then press button#0`` is two acts,
    ``take`` with a thing, and ``press`` with a button.
    """
    builder = _ActBuilder()
    tokens = list(chunks.tokens())
    for token in tokens:
        if token.value is None:  # a word outside of all chunks
            builder.add_word(token.kind)
        else:
            builder.add_chunk(token)
    return Reading(builder.acts, tuple(builder.unread), _has_imperative(tokens))


def _has_imperative(tokens: Sequence[Token]) -> bool:
    """Return whether a sentence begins with a verb, or has one right after *first* or *then*.

    A comma is not enough: *okay, get ready* asks nothing of the robot's things.
    """
    may_be_verb = True
    for token in tokens:
        if may_be_verb and token.kind in VERB_OF:
            return True
        may_be_verb = token.kind in _OPENERS
    return False


class _ActBuilder:
    """Makes acts of verbs and of what is said after each."""

    def __init__(self) -> None:
        self.acts: list[Act] = []
        self.unread: list[str] = []
        self._is_joined = False  # whether a comma, *and* or *then* stands just before

    def add_word(self, word: str) -> None:
        """Add a word of a sentence: a verb begins an act, *lift*; other words count as not read.

        Joining words (*and*, commas) and words that change nothing (*also*) are skipped. *First*
        after a verb is kept with its act, and *release* also says that the thing is put down.
        """
        if word in VERB_OF:
            act = Act(VERB_OF[word])
            if word in LOWERING:  # "release it" says where, too
                act.parts.append(ActPart("down", word))
            self.acts.append(act)
        elif word == "first" and self.acts:
            self.acts[-1].parts.append(ActPart(word, word))
        elif word not in _JOINTS and word not in _PARTICLES:
            self.unread.append(word)
        self._is_joined = word in _JOINTS

    def add_chunk(self, chunk: Token) -> None:
        """Add a phrase that has been read, such as a thing, to the act that it is about."""
        act = self._act_for(chunk.kind)
        part = self._part_of(act, chunk)
        if part is None:
            self.unread += chunk.text.split()
        else:
            act.parts.append(part)
        self._is_joined = False

    def _part_of(self, act: Act, chunk: Token) -> ActPart | None:
        """Return what a phrase that has been read says of an act; None if it does not fit there.

        A place alone is a thing only right after a verb: *take on the left*, what is there. *Twice
        more* after a comma or *and* adds to the number; elsewhere it is unclear, ``extra``.
        """
        if chunk.kind == "place":
            if not act.verb or act.parts:
                return None
            # "Take on the left": what is there.
            return ActPart("thing", Description("one", is_definite=True, place=chunk.value))
        if chunk.kind == "more" and not self._is_joined and act.verb != "repeat":
            # "Lift it twice more" may mean twice in all, or twice after once.
            return ActPart("extra", chunk.value)
        return ActPart(chunk.kind, chunk.value)

    def _act_for(self, kind: str) -> Act:
        """Return the act that the next phrase is about: the last one, or a new one without a verb.

        *Put it down, then the red one*: the red one is to be taken. `kind` is that of the phrase,
        ``thing``.
        """
        if not self.acts:
            self.acts.append(Act(""))
        last = self.acts[-1]
        if kind == "thing" and last.takes_no_more:
            self.acts.append(Act("take" if last.verb == "put" else ""))
        return self.acts[-1]
