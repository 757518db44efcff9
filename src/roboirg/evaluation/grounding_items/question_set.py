"""The questions of a set of episodes, with their pictures; made in worker processes.

The pictures of an episode are noted when they are stored, so that an interrupted command goes on
where it stopped, and another choice of instructions in the same folder needs no new pictures.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
from pydantic import PositiveInt

from roboirg.core.episode import ENVIRONMENT_VERSION, Split
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.grounding_items.grounding_item import GroundingItem
from roboirg.evaluation.grounding_items.item_builder import EpisodeMedia, make_items, wanted_options
from roboirg.evaluation.grounding_items.media_store import store_media
from roboirg.language.wordings.wording_store import open_wordings
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.atomic_write import write_atomically
from roboirg.util.parallel_map import parallel_map

REQUEST_FILE = "request.json"
PARTS = "parts"
FRAMES = 16
"""As many frames of the video as the language-model listener sends."""
FRAMES_EVERY = 8

Progress = Callable[[int, int], None]


class EpisodeName(NamedTuple):
    """Which episode."""

    task: str
    split: Split
    number: int


class ExportRequest(NamedTuple):
    """What a dataset holds.

    Attributes:
        episodes: in the order of the items.
        settings: names of settings.
        forms: implicit, resolved or both.
        options: all other options of the instructions.
        every_variant: whether to add every combination of options.
        frames: maximum of frames of a video that are stored as pictures.
        frames_every: control steps between two frames of the video.
        wordings_file: path of a wording file or name of a pool, for worker processes.
    """

    episodes: tuple[EpisodeName, ...]
    settings: tuple[str, ...]
    forms: tuple[str, ...]
    options: InstructionOptions = InstructionOptions()
    every_variant: bool = False
    frames: PositiveInt = FRAMES
    frames_every: PositiveInt = FRAMES_EVERY
    wordings_file: str | None = None

    def pictures(self) -> dict[str, Any]:
        """Return everything that the pictures depend on, as JSON values."""
        return {
            "frames": self.frames,
            "frames_every": self.frames_every,
            "environment_version": ENVIRONMENT_VERSION,
        }


def collect_items(
    request: ExportRequest, folder: Path, workers: int, progress: Progress | None = None
) -> list[GroundingItem]:
    """Make the items of a request, and store their pictures and videos; return the items.

    Args:
        request: what is asked.
        folder: created if missing; one with pictures of the same request is continued.
        workers: worker processes; 0 uses this process only.
        progress: called with the number of episodes that are done, and of all.

    Raises:
        InvalidValueError: the folder holds something else or cannot be written, or there is
            nothing to ask.
        RoboIRGError: a thing that is meant cannot be seen, or a video cannot be played.
    """
    _claim(folder, request)
    made: dict[EpisodeName, list[GroundingItem]] = {}
    work = functools.partial(_make_episode, folder, request)
    for name, items in parallel_map(work, request.episodes, min(workers, len(request.episodes))):
        made[name] = items
        if progress is not None:
            progress(len(made), len(request.episodes))
    found = [item for name in request.episodes for item in made[name]]
    if not found:
        raise InvalidValueError(
            f"None of these episodes has the setting {', '.join(request.settings)}."
        )
    return found


def _claim(folder: Path, request: ExportRequest) -> None:
    """Note how the pictures are made, or check that those in the folder are made so."""
    path, wanted = folder / PARTS / REQUEST_FILE, request.pictures()
    if path.exists():
        held = json.loads(path.read_bytes())
        changed = [name for name, value in wanted.items() if held.get(name) != value]
        if changed:
            raise InvalidValueError(
                f"{str(folder)!r} has pictures with another {' and '.join(changed)}; choose "
                "another --out."
            )
        return
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InvalidValueError(f"{str(folder)!r} is not an empty folder; choose another --out.")
    write_atomically(path, json.dumps(wanted))


def _make_episode(folder: Path, request: ExportRequest, name: EpisodeName) -> list[GroundingItem]:
    """Return the items of an episode, and store its pictures; runs in worker processes."""
    open_wordings(request.wordings_file)
    episode = get_episode(*name)
    wanted = list(
        wanted_options(
            episode,
            request.settings,
            request.forms,
            request.options,
            every_variant=request.every_variant,
        )
    )
    if not wanted:
        return []
    media = read_media(folder, name)
    if media is None:
        media = store_media(folder, episode, request.frames_every, request.frames)
        write_atomically(_part(folder, name), msgspec.json.encode(media))
    return make_items(episode, media, wanted)


def read_media(folder: Path, name: EpisodeName) -> EpisodeMedia | None:
    """Return what a dataset has stored of an episode; None if there is nothing yet."""
    part = _part(folder, name)
    if not part.exists():
        return None
    return msgspec.json.decode(part.read_bytes(), type=EpisodeMedia)


def _part(folder: Path, name: EpisodeName) -> Path:
    return folder / PARTS / f"{name.task}-{name.split}-{name.number}.json"
