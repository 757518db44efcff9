"""What a result depends on and a later one may not share, and in what two results differ."""

from __future__ import annotations

from typing import NamedTuple

NO_VERSION = "none"
"""Of a server that reported none, and without a server."""

_POLICY = "policy"
_DEFAULT = "at its default"


class Makeup(NamedTuple):
    """What a policy is besides its version, wherever it is.

    Attributes:
        maker: a built-in name, class, scheme, kind or file; None if it is not known.
        options: that change what the policy sees or does, by name; not those with their defaults.
    """

    maker: str | None = None
    options: tuple[tuple[str, str], ...] = ()

    @property
    def text(self) -> str | None:
        """The maker with the options; None if it is not known."""
        words = [f"{name}={value}" for name, value in self.options]
        return self.maker and " ".join([self.maker, *words])


UNKNOWN_MAKEUP = Makeup()


class Mismatch(NamedTuple):
    """A version, an option, or the policy itself, that two do not share, with the value of each."""

    what: str
    first: object
    second: object

    @property
    def label(self) -> str:
        """The first value for a table, with the name of what it is."""
        if self.what == _POLICY:
            return str(self.first)
        return f"{self.what.removeprefix('option ').removesuffix(' version')} {self.first}"


class Versions(NamedTuple):
    """What a result depends on; None for what is not known or not to be compared.

    Attributes:
        makeup: what the policy is.
        environment_version: of scenes, rules and physics.
        language_version: of the words.
        policy_version: distinguishes it from an earlier policy of the same name.
        server_version: that the policy's server reported, or `NO_VERSION`.
        seed: of the scene.
    """

    makeup: Makeup = UNKNOWN_MAKEUP
    environment_version: int | None = None
    language_version: str | None = None
    policy_version: str | None = None
    server_version: str | None = None
    seed: int | None = None

    def differences(self, other: Versions) -> list[Mismatch]:
        """Return all in which two differ, in the order of the fields."""
        if self == other:
            return []
        mine, theirs = self.makeup, other.makeup
        found = [Mismatch(_POLICY, mine.maker, theirs.maker)]
        if mine.maker == theirs.maker:
            first, second = dict(mine.options), dict(theirs.options)
            for name in sorted(first | second):
                here, there = first.get(name, _DEFAULT), second.get(name, _DEFAULT)
                found.append(Mismatch(f"option {name}", here, there))
        for field in self._fields[1:]:
            what = field.replace("_", " ")
            found.append(Mismatch(what, getattr(self, field), getattr(other, field)))
        return [pair for pair in found if pair.first != pair.second and None not in pair]
