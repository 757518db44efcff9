"""Private splits: random episodes that only those who know a secret, the salt, can draw.

A private split is named after a hash of its salt, for example ``random@1a2b3c4d5e6f``. The seeds of
its scenes are keyed hashes, so neither they nor the salt follow from the name. The salt itself
stands in an environment variable, which this process's children inherit; policies' do not get it.
"""

from __future__ import annotations

import functools
import hashlib
import hmac
import os
import re

from roboirg.core.episode import Split
from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import counted

SALT_VARIABLE = "ROBOIRG_SALT"
MIN_SALT_LENGTH = 12
RANDOM: Split = "random"

_NAME = re.compile(rf"{RANDOM}@[0-9a-f]{{12}}")
_SEED_BYTES = 6
_FIRST_SEED = 1 << (8 * _SEED_BYTES)
"""No public split has a seed as large as this."""


class MissingSaltError(InvalidValueError):
    """The episodes of a private split cannot be drawn: the salt is missing, or is another one."""


def use_salt(salt: str) -> Split:
    """Give a salt, the secret of a private split, to this process and its children.

    Sets the environment variable `SALT_VARIABLE`. Returns the name of the split,
    ``"random@1a2b3c4d5e6f"``. Raises InvalidValueError if the salt is short.
    """
    name = _split_of(salt)
    os.environ[SALT_VARIABLE] = salt
    return name


def known_salt() -> str | None:
    """Return the salt that this process was given; None without any."""
    return os.environ.get(SALT_VARIABLE) or None


def drawn_split(split: str) -> str:
    """Return the split that is meant: if a salt is known, ``random`` is the private split of it.

    With a salt, ``"random"`` -> ``"random@1a2b3c4d5e6f"``; every other name stays as it is.
    """
    salt = known_salt()
    if salt is None or split != RANDOM:
        return split
    return _split_of(salt)


def is_private(split: str) -> bool:
    """Return whether a name is that of a private split, such as ``"random@1a2b3c4d5e6f"``."""
    return _NAME.fullmatch(split) is not None


def check_salt(split: str) -> None:
    """Raise MissingSaltError if this process cannot draw the episodes of a split.

    Those of a private split need its salt in the environment; public ones need nothing.
    """
    if not is_private(split):
        return
    salt = known_salt()
    if salt is None or _split_of(salt) != split:
        lack = "has another salt" if salt else "has no salt"
        raise MissingSaltError(
            f"The episodes of split {split!r} are private, and this process {lack}: set "
            f"{SALT_VARIABLE} to the salt that they were drawn with."
        )


def private_seed(task: str, split: Split, index: int, passed_over: int) -> int:
    """Return the seed to try for a private episode after `passed_over` seeds that give no scene.

    A hash keyed with the salt, 48 bits, above all public seeds: who lacks the salt cannot predict
    it.
    """
    check_salt(split)
    message = f"{task}/{index}/{passed_over}".encode()
    digest = hmac.digest(_key(os.environ[SALT_VARIABLE]), message, "sha256")
    return _FIRST_SEED + int.from_bytes(digest[:_SEED_BYTES])


def _split_of(salt: str) -> Split:
    """Return the name of a salt's private split: ``random@``, then 12 digits of a keyed hash."""
    name = hmac.digest(_key(salt), b"name", "sha256").hex()
    return f"{RANDOM}@{name[:12]}"


@functools.lru_cache(maxsize=8)
def _key(salt: str) -> bytes:
    """Return the key of a salt; slow, so that guessed ones are not quickly compared with names."""
    if len(salt) < MIN_SALT_LENGTH:
        raise InvalidValueError(
            f"The salt has {counted(len(salt), 'character')}; it must have at least "
            f"{MIN_SALT_LENGTH}."
        )
    return hashlib.scrypt(
        salt.encode(errors="surrogateescape"), salt=b"roboirg private split", n=1 << 14, r=8, p=1
    )
