"""The prompts of models: data in ``prompts/``, versioned by their hash."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any

from roboirg.core.errors import InvalidValueError
from roboirg.util.regular_file import read_regular
from roboirg.util.short_hash import short_hash

SHARED = "subgoals"
"""The file with the forms of subgoals, for the prompts of all planners."""


@dataclass(frozen=True)
class Prompts:
    """The prompts of one planner or listener.

    Attributes:
        texts: by name, nested as in the file.
        fingerprint: of the file, to distinguish records of other prompts.
        origin: the file, for error messages.
    """

    texts: dict[str, Any]
    fingerprint: str
    origin: str

    def __getitem__(self, name: str) -> Template:
        """Return the text of a name as a template; a dot descends into a table: ``"values.one"``.

        Raises:
            InvalidValueError: the file has no such text.
        """
        found: Any = self.texts
        for part in name.split("."):
            found = found.get(part) if isinstance(found, dict) else None
        if not isinstance(found, str):
            raise InvalidValueError(f"Prompts {self.origin}: there is no text {name!r}.")
        return Template(found.strip())

    def fill(self, name: str, /, **fields: str) -> str:
        """Return the text of a name with its fields filled.

        Raises:
            InvalidValueError: the file has no such text, or the text has an unknown field.
        """
        try:
            return self[name].substitute(fields)
        except (KeyError, ValueError) as error:
            allowed = ", ".join(f"${field}" for field in fields) or "none"
            raise InvalidValueError(
                f"Prompts {self.origin}: text {name!r} has a field that cannot be filled "
                f"({error}); it may have {allowed}."
            ) from error

    def lines(self, name: str) -> tuple[str, ...]:
        """Return the list of texts of a name.

        Raises:
            InvalidValueError: the file has no such list.
        """
        found = self.texts.get(name)
        if not isinstance(found, list) or not all(isinstance(line, str) for line in found):
            raise InvalidValueError(f"Prompts {self.origin}: {name!r} is not a list of texts.")
        return tuple(found)


def load_prompts(name: str, file: str | None = None) -> Prompts:
    """Load our own prompts of a name, or those of a user's `file` that has the same entries.

    Raises:
        InvalidValueError: the file cannot be read or is not TOML.
    """
    origin = file or f"{name}.toml"
    try:
        if file is not None:
            content = read_regular(Path(file))
        else:
            content = (resources.files(__package__) / "prompts" / origin).read_bytes()
        texts = tomllib.loads(content.decode())
    except (OSError, InvalidValueError) as error:
        words = str(error).rstrip(".")
        raise InvalidValueError(f"Prompts {origin!r} cannot be read ({words}).") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InvalidValueError(f"Prompts {origin!r} are not TOML ({error}).") from error
    return Prompts(texts, short_hash(content), origin)
