"""What a result depends on and a later one may not share, and in what two results differ."""

from __future__ import annotations

from typing import NamedTuple

NO_VERSION = "none"
"""Of a server that reported none, and without a server."""

Makeup = tuple[tuple[str, str], ...]
"""What a policy is besides its version, wherever it is, as names and values: what makes it, under
the name `POLICY`, then the options that change what it sees or does, but not those with their
defaults. Empty if unknown."""

POLICY = "policy"
"""Names what makes a policy, among the names of its options."""
WORDS = "words version"  # differs if the words of a task and pool do
_DEFAULT = "at its default"


class Mismatch(NamedTuple):
    """A version, an option, or the policy itself, that two do not share, with the value of each."""

    what: str
    first: object
    second: object

    @property
    def label(self) -> str:
        """The first value for a table, with the name of what it is, such as ``environment 1``."""
        if self.what == POLICY:
            return str(self.first)
        name = self.what.removeprefix("option ").removesuffix(" version")
        return f"{name} {self.first}"


class Versions(NamedTuple):
    """What a result depends on; None for what is not known or not to be compared.

    Attributes:
        makeup: what the policy is.
        package_version: of roboirg.
        environment_version: of scenes, rules and physics.
        language_version: of the words.
        policy_version: distinguishes it from an earlier policy of the same name.
        server_version: that the policy's server reported, or `NO_VERSION`.
        seed: of the scene.
        words_version: which words of a task and pool were said, in a language of data files.
    """

    makeup: Makeup = ()
    package_version: str | None = None
    environment_version: int | None = None
    language_version: str | None = None
    policy_version: str | None = None
    server_version: str | None = None
    seed: int | None = None
    words_version: str | None = None

    def differences(self, other: Versions) -> list[Mismatch]:
        """Return all in which two differ, in the order of the fields.

        Environment versions 1 and 2 -> ``[Mismatch("environment version", 1, 2)]``. What one of the
        two does not know (None) is no difference.
        """
        if self == other:
            return []
        pairs = _makeup_pairs(dict(self.makeup), dict(other.makeup))
        for field in self._fields:
            if field != "makeup":
                what = field.replace("_", " ")
                pairs.append(Mismatch(what, getattr(self, field), getattr(other, field)))
        # None stands for what one of the two does not know.
        return [pair for pair in pairs if pair.first != pair.second and None not in pair]


def _makeup_pairs(first: dict[str, str], second: dict[str, str]) -> list[Mismatch]:
    """Return what makes each of two policies, then each option with both values, equal or not.

    ``{"policy": "oracle", "noise": "2"}`` and ``{"policy": "oracle"}`` -> ``policy`` with *oracle*
    twice, ``option noise`` with *2* and *at its default*. If different things make them, their
    options are not compared. Both dictionaries lose their entry `POLICY`.
    """
    maker = Mismatch(POLICY, first.pop(POLICY, None), second.pop(POLICY, None))
    if maker.first != maker.second:
        return [maker]  # the options of another policy are others, too
    pairs = [maker]
    for name in sorted(first | second):
        first_value = first.get(name, _DEFAULT)
        second_value = second.get(name, _DEFAULT)
        pairs.append(Mismatch(f"option {name}", first_value, second_value))
    return pairs


def makeup_text(makeup: Makeup) -> str | None:
    """Return what makes a policy, with its options; None if it is not known.

    ``(("policy", "oracle"), ("noise", "2"))`` -> ``oracle noise=2``.
    """
    if not makeup:
        return None
    words = [value if name == POLICY else f"{name}={value}" for name, value in makeup]
    return " ".join(words)
