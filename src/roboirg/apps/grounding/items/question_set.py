"""The questions of a set of episodes, with their pictures; made in worker processes."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from pydantic import PositiveInt

from roboirg.apps.grounding.items.grounding_item import GroundingItem
from roboirg.apps.grounding.items.item_builder import make_items, wanted_options
from roboirg.apps.grounding.items.media_store import store_media
from roboirg.core.episode import Split
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language.scenarios.wording_store import open_wordings
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.parallel_map import parallel_map

FRAMES = 16
"""As many frames of the video as the language-model listener sends."""
FRAMES_EVERY = 8

Progress = Callable[[int, int], None]


class EpisodeName(NamedTuple):
    """Which episode: of a task and a split, by its number."""

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


def collect_items(
    request: ExportRequest, folder: Path, workers: int, progress: Progress | None = None
) -> list[GroundingItem]:
    """Make the grounding questions of some episodes, and store their pictures and videos.

    Returns the items, each with its questions, in the order of the request's episodes.

    Args:
        request: the episodes, settings and options.
        folder: created if missing, else empty.
        workers: worker processes; 0 uses this process only.
        progress: called with the number of episodes that are done, and of all.

    Raises:
        InvalidValueError: the folder is not empty or cannot be written, or there is nothing to
            ask.
        RoboIRGError: a thing that is meant cannot be seen, or a video cannot be played.
    """
    _check_empty(folder)
    # By episode, because worker processes end in any order.
    items_of = {}
    work = functools.partial(_make_episode, folder, request)
    total = len(request.episodes)
    for name, items in parallel_map(work, request.episodes, min(workers, total)):
        items_of[name] = items
        if progress is not None:
            progress(len(items_of), total)

    found = []
    for name in request.episodes:
        found += items_of[name]
    if not found:
        raise InvalidValueError(
            f"None of these episodes has the setting {', '.join(request.settings)}."
        )
    return found


def _check_empty(folder: Path) -> None:
    """Raise if there is something at the path but an empty folder."""
    is_empty = folder.is_dir() and not any(folder.iterdir())
    if folder.exists() and not is_empty:
        raise InvalidValueError(f"{str(folder)!r} is not an empty folder; choose another --out.")


def _make_episode(folder: Path, request: ExportRequest, name: EpisodeName) -> list[GroundingItem]:
    """Return the questions of an episode, and store its pictures; runs in a worker process.

    Args:
        folder: of the dataset.
        request: settings and options of the questions.
        name: task, split and number of the episode.
    """
    # A process of its own has not read the file with words yet.
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
    media = store_media(folder, episode, request.frames_every, request.frames)
    return make_items(episode, media, wanted)
