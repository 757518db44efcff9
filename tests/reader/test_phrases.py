"""Each pattern of the interpreter has an example, which shows what it is for."""

import importlib
import pkgutil
import re

import pytest

from roboirg import reader
from roboirg.reader.phrases import Phrases
from roboirg.reader.tokens import split_sentences

MODULES = [
    importlib.import_module(f"roboirg.reader.{one.name}")
    for one in pkgutil.iter_modules(reader.__path__)
]
TABLES = {
    f"{module.__name__.rpartition('.')[2]}.{name}": value
    for module in MODULES
    for name, value in vars(module).items()
    if isinstance(value, Phrases)
}


@pytest.mark.parametrize(
    ("table", "example"),
    [(name, example) for name, table in TABLES.items() for example in table.by_example],
)
def test_an_example_is_read_by_its_own_pattern(table, example):
    text = " ".join(word for sentence in split_sentences(example) for word in sentence)
    ways = TABLES[table].by_example
    assert next(one for one, pattern in ways.items() if pattern.search(text)) == example
    assert TABLES[table].search(text)


def test_only_the_patterns_that_split_text_have_no_examples():
    bare = {
        module.__name__ for module in MODULES for one in vars(module).values()
        if isinstance(one, re.Pattern)
    }  # fmt: skip
    assert bare == {"roboirg.reader.tokens"}


def test_sentences_end_with_stops_of_english():
    assert split_sentences("Take it. Now! Why?\nYes") == (
        ("take", "it"),
        ("now",),
        ("why",),
        ("yes",),
    )
    assert split_sentences("拿起方块。放下") == (("拿起方块", "放下"),)
