"""Videos of the page: embedded in it, or linked to."""

from __future__ import annotations

import base64
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple
from urllib.parse import quote

from roboirg.evaluation.analysis.page.entries import EpisodeEntry
from roboirg.evaluation.records.film import poster_name
from roboirg.evaluation.records.run_files import run_file

MAX_EMBEDDED_BYTES = 60_000_000
"""Larger videos, taken together, are linked to."""


class EpisodeVideo(NamedTuple):
    """A video and its last frame, as data URIs or as paths from the page."""

    source: str
    poster: str | None


@dataclass(frozen=True, slots=True)
class EpisodeVideos:
    """The videos of a page.

    Attributes:
        embeds: whether they are part of the page.
        count: number of videos.
    """

    embeds: bool
    count: int

    @classmethod
    def of(cls, entries: Iterable[EpisodeEntry], *, embed: bool = True) -> EpisodeVideos:
        """Embed the videos if wanted and not too large."""
        files = [
            (path, run_file(one.run.folder, poster_name(one.record.video)))
            for one in entries
            if one.run.folder is not None and one.record.video is not None
            if (path := run_file(one.run.folder, one.record.video)).is_file()
        ]
        paths = (path for pair in files for path in pair)
        size = sum(path.stat().st_size for path in paths if path.is_file())
        return cls(embed and size <= MAX_EMBEDDED_BYTES, len(files))

    def video(self, entry: EpisodeEntry) -> EpisodeVideo | None:
        """Return the video of an episode, or None."""
        name = entry.record.video
        source = None if name is None else self._link(entry, name, "video/mp4")
        if name is None or source is None:
            return None
        return EpisodeVideo(source, self._link(entry, poster_name(name), "image/jpeg"))

    def _link(self, entry: EpisodeEntry, name: str, kind: str) -> str | None:
        if entry.run.folder is None or not (path := run_file(entry.run.folder, name)).is_file():
            return None
        if not self.embeds:
            return quote(f"{entry.run.link}{name}")
        return f"data:{kind};base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"
