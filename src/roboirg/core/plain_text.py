"""Text for people: counts with their nouns, and text of others that is fit to print or write."""

from __future__ import annotations

from roboirg.core.handed_keys import without_keys


def printable(text: str) -> str:
    r"""Return a text without keys, whose characters cannot control a terminal.

    Others than line ends and tabs are written as escapes: ``\x1b`` begins commands that clear the
    screen, change the window's title or type for the user, and marks of direction reorder what is
    read.
    """
    text = without_keys(text)
    if text.isprintable():
        return text
    return "".join(_shown(character) for character in text)


def _shown(character: str) -> str:
    """Return a character, as an escape if it would control a terminal."""
    if character.isprintable() or character in "\n\t":
        return character
    return character.encode("unicode_escape").decode()


def clip_text(text: str, limit: int) -> str:
    """Return at most `limit` characters of a text; lone surrogates become question marks."""
    return text[:limit].encode("utf-8", "replace").decode()


def is_encodable(text: str) -> bool:
    """Return whether a text can be written to a file: it has no lone surrogates."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


def counted(count: int, noun: str, plural: str | None = None) -> str:
    """Return a count with its noun: ``(1, "episode")`` -> ``"1 episode"``.

    ``(2550, "episode")`` -> ``"2,550 episodes"``. `plural` is for nouns that take no *s*: ``(0,
    "try", "tries")`` -> ``"0 tries"``.
    """
    if count == 1:
        return f"{count} {noun}"
    return f"{count:,} {plural or f'{noun}s'}"


_SINGULAR_VERBS = {"are": "is", "were": "was", "have": "has", "do": "does"}


def verb_for(count: int, plural: str) -> str:
    """Return a verb that agrees with a count: ``(1, "are")`` -> ``"is"``; for others `plural`."""
    return _SINGULAR_VERBS[plural] if count == 1 else plural
