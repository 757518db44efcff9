"""What the paper says of the benchmark holds in the program, item by item."""

import re
from pathlib import Path

import paper_audit
import pytest

LIMITS = Path(__file__).parents[2] / "docs" / "comparability.md"


@pytest.mark.parametrize("item", paper_audit.ITEMS, ids=lambda item: item.name)
def test_the_item_holds(item):
    """An item is a statement of the paper with a check of it in the program, which says whether it
    is so."""
    assert item.check()


def test_names_are_unique_and_limits_have_reasons():
    """What no item can check is a section of the page: its name, and the reason."""
    limits = re.findall(r"^### (\S+)\n\n(.+?)(?=\n#|\Z)", LIMITS.read_text(), re.M | re.S)
    names = [item.name for item in paper_audit.ITEMS] + [name for name, _ in limits]

    assert len(names) == len(set(names))
    assert limits
    assert all(len(" ".join(reason.split())) > 40 for _, reason in limits)


def test_an_item_that_fails_is_named(monkeypatch, capsys):
    def differs():
        paper_audit.same(1, 2)

    monkeypatch.setattr(paper_audit, "ITEMS", [paper_audit.Item("it", "is so", differs)])

    assert paper_audit.main("it") == 1
    assert "FAILS  it: is so\n       1 instead of 2" in capsys.readouterr().out
