"""What the paper says of the benchmark holds in the program, item by item."""

import paper_audit
import pytest


@pytest.mark.parametrize("item", paper_audit.ITEMS, ids=lambda item: item.name)
def test_the_item_holds(item):
    """An item is a statement of the paper with a check of it in the program, which says whether it
    is so."""
    assert item.check()


def test_an_item_that_fails_is_named(monkeypatch, capsys):
    def differs():
        paper_audit.same(1, 2)

    monkeypatch.setattr(paper_audit, "ITEMS", [paper_audit.Item("it", "is so", differs)])

    assert paper_audit.main("it") == 1
    assert "FAILS  it: is so\n       1 instead of 2" in capsys.readouterr().out
