"""What was heard and played, each once, in files that survive a kill at any moment.

A new entry is a line of ``open.jsonl``, on the disk before `Store.add` returns; a last line that is
unfinished is moved aside at the next start. When there are many, or a command ends, they become a
*pack*: a file compressed with xz and named after its content, which appears whole or not at all.
To join two stores, copy the packs of one to the other: what both have counts once, and what
contradicts is refused.
"""

from __future__ import annotations

import lzma
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple, Self

import msgspec

from roboirg.records.line_file import AppendFile, LineFile
from roboirg.records.record_codec import StoreError
from roboirg.util.atomic_write import write_atomically
from roboirg.util.short_hash import short_hash

OPEN = "open.jsonl"
PACKED_BYTES = 4 << 20
"""Open lines that are longer together become a pack."""

Key = Mapping[str, str]
"""All that an entry depends on, by name."""


class Entry(msgspec.Struct, frozen=True):
    """A line of a store.

    Attributes:
        key: what it depends on.
        verdict: in what all entries of the key must agree.
        record: more of it, as JSON; null if the verdict is all.
    """

    key: dict[str, str]
    verdict: str
    record: msgspec.Raw = msgspec.Raw(b"null")


class _Kept(NamedTuple):
    """An entry and the file that has it."""

    entry: Entry
    path: Path


class Store:
    """A folder of entries, open for this process only; a context, at whose end all is packed.

    Args:
        folder: made if it is missing.
        same_code: fingerprints of earlier code, whose entries count as those of a key's own.

    Raises:
        StoreError: another process has it open, a file is damaged, or two entries of a key
            contradict each other.
    """

    def __init__(self, folder: Path, same_code: Iterable[str] = ()) -> None:
        self._folder = folder
        self._same_code = same_code
        self._kept: dict[bytes, _Kept] = {}
        for path in sorted(folder.glob("*.xz")):
            try:
                content = lzma.decompress(path.read_bytes())
            except lzma.LZMAError as error:
                raise StoreError(f"{path} is damaged ({error}); copy it again.") from error
            self._keep(content.splitlines(), path)
        self._file = AppendFile(folder, OPEN, "torn.txt", self._read_open)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.pack()
        self._file.path.unlink()
        self._file.close()

    def __len__(self) -> int:
        return len(self._kept)

    def get(self, key: Key) -> Entry | None:
        """Return the entry of a key; None if there is none."""
        for code in (key["code"], *self._same_code):
            kept = self._kept.get(_text_of({**key, "code": code}))
            if kept is not None:
                return kept.entry
        return None

    def add(self, entry: Entry) -> None:
        """Store an entry; when this returns, it is on the disk.

        Raises:
            StoreError: it cannot be written, or it contradicts what is there.
        """
        line = msgspec.json.encode(entry)
        self._file.extend([line])
        self._keep([line], self._file.path)
        if self._file.path.stat().st_size > PACKED_BYTES:
            self.pack()

    def pack(self) -> None:
        """Make a pack of the open lines, if there are any.

        A kill before they are removed leaves them twice, which changes nothing.
        """
        content = self._file.path.read_bytes()
        if content:
            pack = self._folder / f"{short_hash(content)}.xz"
            write_atomically(pack, lzma.compress(content, preset=9))
            os.truncate(self._file.path, 0)

    def _read_open(self, lines: LineFile) -> None:
        """Keep the open lines but an unfinished one."""
        self._keep(lines.parse(lambda line, _path, _number: line), self._folder / OPEN)

    def _keep(self, lines: Iterable[bytes], path: Path) -> None:
        """Keep the entries of some lines, after a comparison with what has their keys already.

        Args:
            lines: entries as JSON.
            path: of the file that has them.
        """
        for line in lines:
            entry = msgspec.json.decode(line, type=Entry)
            key = _text_of(entry.key)
            earlier = self._kept.setdefault(key, _Kept(entry, path))
            if earlier.entry.verdict != entry.verdict:
                raise StoreError(
                    f"{key.decode()} is {earlier.entry.verdict!r} in {earlier.path}, but "
                    f"{entry.verdict!r} in {path}; find out which is right."
                )


def _text_of(key: Key) -> bytes:
    """Return a key as JSON, its names in order."""
    return msgspec.json.encode(key, order="sorted")
