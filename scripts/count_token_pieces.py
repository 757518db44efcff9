"""Write how many pieces each word of the language needs (src/roboirg/language/token_pieces.json).

Run it after a change of wording: ``python scripts/count_token_pieces.py``. It needs
`mistral-common`, whose first tokenizer is a SentencePiece vocabulary of 32,000 pieces. A test
compares the counts of whole instructions with that tokenizer's, another one looks for words of the
scenarios that the table lacks.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

from sentencepiece import SentencePieceProcessor

from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import POOLS
from roboirg.language.instruction import FORMS as ALL_FORMS
from roboirg.language.number_words import CARDINALS, ORDINALS, plural
from roboirg.language.scenarios.markup import Agreement, Pointer, Slot, Text
from roboirg.language.scenarios.scenario import PERSON, Scenario
from roboirg.language.scenarios.scenario_file import general, task_scenarios
from roboirg.language.settings import all_settings
from roboirg.language.token_counts import split_words
from roboirg.language.variants import instructions
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.atomic_write import write_atomically

TABLE = Path(__file__).parent.parent / "src/roboirg/language/token_pieces.json"
EPISODES = 400
"""Random scenes for each task; their words repeat long before the last one."""
FORMS = ("ordinal", "cardinal", "times", "or", "nor", "spot")
"""What a slot may have after its colon that is no noun to be counted."""
_BEGINNING = re.compile(r"(?:^|[.!?:] )([a-z])")


def tokenizer() -> SentencePieceProcessor:
    """Return the tokenizer with 32,000 pieces."""
    model = files("mistral_common").joinpath("data/tokenizer.model.v1")
    return SentencePieceProcessor(model_file=str(model))


def texts() -> Iterator[str]:
    """Yield instructions of random scenes in both pools, with all settings, forms and options."""
    for task in every_task():
        for index in range(EPISODES):
            episode = get_episode(task, "random", index)
            pool = POOLS[index % len(POOLS)]
            for setting in all_settings().values():
                for changes in setting.variants:
                    options = InstructionOptions(wordings=pool, **changes)
                    for _, said in instructions([episode], [setting.name], ALL_FORMS, options):
                        yield said.text


def scenario_words() -> frozenset[str]:
    """Return all words and marks that scenarios can say, but those for colors and places."""
    numbers = [*CARDINALS[1:], *ORDINALS[1:]]
    words = {*numbers, *map(str.capitalize, numbers), "once", "twice", "times"}
    for pool in POOLS:
        for remark in general().distractors[pool]:
            words |= split_words(remark)
    for task in every_task():
        written = task_scenarios(task)
        for scenario in written.scenarios if written else ():
            words |= _words_of(scenario)
    return frozenset(words)


def _words_of(scenario: Scenario) -> set[str]:
    """Return the words of a scenario, each person of his or her own in all of its sentences."""
    words: set[str] = set()
    for person in scenario.people or ((),):
        for sentences in scenario.texts.values():
            for sentence in sentences:
                for is_many in (False, True):
                    said = _spelling(sentence, person, is_many=is_many)
                    # A sentence begins with a capital, unless a lead goes before it.
                    words |= split_words(said)
                    words |= split_words(_BEGINNING.sub(lambda found: found[0].upper(), said))
    return words


def _spelling(text: Text, person: tuple[str, ...], *, is_many: bool) -> str:
    """Return what a sentence says of one thing, or of several."""
    said = ""
    for part in text:
        if isinstance(part, Slot):
            name = part.name.partition(".")[0]
            if name in PERSON:
                said += person[PERSON.index(name)]
            elif part.form and part.form not in FORMS:
                said += plural(part.form) if is_many else part.form
        elif isinstance(part, Agreement):
            said += part.many if is_many else part.one
        elif isinstance(part, Pointer):
            said += _spelling(part.parts, person, is_many=is_many)
        else:
            said += part.text
    return said


def main() -> None:
    """Write the table: the words by their number of pieces."""
    encode = tokenizer().encode
    words = scenario_words().union(*map(split_words, texts()))
    by_count: dict[str, list[str]] = {}
    for word in sorted(words):
        # A mark is written without a space before it.
        count = 1
        if word[0].isalnum():
            count = len(encode(word))
        by_count.setdefault(str(count), []).append(word)
    write_atomically(TABLE, json.dumps(dict(sorted(by_count.items())), indent=0) + "\n")
    print(f"{len(words)} words: {TABLE}")


if __name__ == "__main__":
    main()
