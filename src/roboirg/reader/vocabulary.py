"""Vocabulary: every word that a command may use. A word outside these tables is unknown.

Numbers, ordinals and colors are in `tokens`. A new verb goes into `TAKING`, `PUTTING` or
`PRESSING`; a new adverb that changes nothing goes into `tokens.FILLERS`. Another package teaches
words with `register_words`.
"""

from __future__ import annotations

from collections.abc import Mapping

from roboirg.core.errors import InvalidValueError
from roboirg.reader.tokens import SYNONYMS, color_of, number_of, ordinal_of, word_set

TAKING = word_set(
    "take pick grab grasp lift raise carry move bring fetch get uncover reveal remove hold swing "
    "transfer find locate"
)
PUTTING = word_set("put place set lower return drop lay throw toss deposit insert fill")
PRESSING = word_set("press push hit tap stop halt make let repeat wait")
VERBS = TAKING | PUTTING | PRESSING

GERUNDS = word_set(
    "taking picking grabbing grasping lifting raising carrying moving bringing fetching getting "
    "uncovering removing holding swinging putting placing setting lowering returning dropping "
    "laying throwing tossing pressing pushing hitting tapping stopping halting touching using "
    "repeating waiting watching seeing swapping hiding covering containing passing reaching "
    "arriving doing performing finishing completing"
)
THING_NOUNS = word_set(
    "cube cubes box boxes tape tapes container containers target targets disc discs button buttons "
    "bin bins one ones thing things"
)
STEP_NOUNS = word_set(
    "visit visits placement placements pass passes passage stay occasion occasions placing moment "
    "moments number"
)
SERIES_NOUNS = STEP_NOUNS | word_set("time times point instant part rounds round turns turn")
DETERMINERS = word_set(
    "the a an that this those these its your my his her their our both each every any all some "
    "another other same such which whose"
)
PLACE_WORDS = word_set(
    "near nearest close closest far farthest furthest leftmost rightmost corner front behind "
    "beside below under beneath underneath adjacent ahead opposite between among"
)
"""Words that mean something only inside a place or a step that the interpreter reads."""
STEP_WORDS = word_set("behind beside below under adjacent ahead next")
"""Words that describe a step if the sentence has one of `STEP_NOUNS`: visit behind the third."""
PREPOSITIONS = word_set(
    "in inside into on onto at by to from of over above next top side left right"
)

_NOUNS = word_set(
    "table robot video camera picture beginning start outset end pair couple color colors amount "
    "place places spot position location press presses swaps swap order way hand mind "
    "neighbor neighbors action actions motion motions movement task process steps sequence "
    "demonstration side total whole object objects cycle cycles exact "
    "desired agreed"
)
_PRONOUNS = word_set(
    "he she it them they you yourself i me us we what when where which who whichever there here "
    "then everything anything something"
)
_VERB_FORMS = word_set(
    "trade asked decided settled selected opted favor favorite own special prefers skip give gave "
    "choice left pick "
    "remaining named mentioned spoke others new distinct alternative separate "
    "is are was were be been am do does did done has had have stops stopped hides hid hidden "
    "covers covered picked lifted raised placed moved moves pressed presses swapped changed "
    "exchanged shuffled started began stands stood happened showed shown saw seen went goes go "
    "going think thinks remember find choose chose chosen prefer preferred like liked want need "
    "sure use used keep kept see look differs took given say said meant mean forget worry hesitate "
    "painted being held work preceded followed ready colored watch watched repeated reaches "
    "reach reached arrives "
    "arrived passed shown demonstrated contains contained visited finished finish done completed "
    "comes came gets got cross crosses crossed visiting pushed made shows complete remembering"
    "  recalling returns returned according based initial original correct"
)
_COMPARISONS = word_set(
    "further away "
    "many often much more less fewer larger greater higher bigger smaller lower than as half "
    "double triple thrice twice once plus minus different unlike differs other except apart "
    "outside neither either former latter last final next very previous following preceding "
    "penultimate direct directly immediately later earlier prior single"
)
_CONNECTIVES = word_set(
    "and but so then now finally afterwards again also too with for before after during until up "
    "down back just only not no never together respectively "
    "initially originally begin long while exactly precisely repeatedly forth altogether "
    "previously already each equally"
)
_MODALS = word_set("can could will would must should may")
_NEGATIONS = word_set("avoid refrain nothing none nor without instead rather dont")
_PUNCTUATION = word_set(", ; :")
_KNOWN = (
    VERBS
    | GERUNDS
    | THING_NOUNS
    | SERIES_NOUNS
    | DETERMINERS
    | PLACE_WORDS
    | PREPOSITIONS
    | _NOUNS
    | _PRONOUNS
    | _VERB_FORMS
    | _COMPARISONS
    | _CONNECTIVES
    | _MODALS
    | _NEGATIONS
    | _PUNCTUATION
)

_OPENERS = word_set(
    "if or while off out away look see watch ignore imagine consider note notice mind listen hear "
    "know say call keep love enjoy admire suppose because since when whenever unless although "
    "though until till as than where about against around despite except like outside through "
    "toward towards unlike via within across along maybe perhaps yesterday today tomorrow tonight "
    "sometimes often anyway still even almost nearly quite very soon meanwhile otherwise however "
    "therefore besides who why how might shall yes yeah oh hey hi hello sorry thanks thank only "
    "half lots"
)
"""Words that begin a remark, not a command, even before a noun."""
_NO_VERB_ENDINGS = ("ly", "ing", "ed")
UNSEEN_COLORS = word_set(
    "orange pink white black brown cyan magenta violet turquoise silver gold golden beige maroon "
    "teal navy crimson scarlet lime olive"
)
"""Words that name a color that nothing on the table has; they are unknown, but called a color."""


def is_known(word: str) -> bool:
    """Return whether a word of a command is in any table."""
    if number_of(word) is not None or ordinal_of(word) is not None or color_of(word) is not None:
        return True
    return word.removesuffix("'s") in _KNOWN


def may_be_verb(word: str) -> bool:
    """Return whether an unknown word may be the verb of a command."""
    return not (is_known(word) or word in _OPENERS or word.endswith(_NO_VERB_ENDINGS))


def register_words(synonyms: Mapping[str, str]) -> None:
    """Teach the interpreter words of another package. Teaching the same again changes nothing.

    Call it in the module of the task or setting that uses the words:

        register_words({"crate": "box", "hoist": "lift"})

    Args:
        synonyms: new words in lower case, each with the known word as which it is read.

    Raises:
        InvalidValueError: a word is known already, or is to be read as an unknown one.
    """
    for word, meaning in synonyms.items():
        if SYNONYMS.get(word) == meaning:
            continue
        if word in SYNONYMS or is_known(word):
            raise InvalidValueError(
                f"The interpreter already knows the word {word!r}; teach it another one."
            )
        if not is_known(meaning):
            raise InvalidValueError(
                f"{word!r} is to be read as {meaning!r}, a word that the interpreter does not know."
            )
        SYNONYMS[word] = meaning
