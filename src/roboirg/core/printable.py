"""Text of others on a terminal."""

from __future__ import annotations


def printable(text: str) -> str:
    r"""Return a text whose characters cannot control a terminal.

    Others than line ends and tabs are written as escapes: ``\x1b`` begins commands that clear the
    screen, change the window's title or type for the user, and marks of direction reorder what is
    read.
    """
    if text.isprintable():
        return text
    return "".join(
        one if one.isprintable() or one in "\n\t" else one.encode("unicode_escape").decode()
        for one in text
    )
