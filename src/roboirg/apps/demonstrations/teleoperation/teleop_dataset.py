"""Read a dataset of LeRobot 3.0 that was recorded on an arm, under the names that it has there."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.demonstrations.parquet_tables import read_rows
from roboirg.core.errors import InvalidValueError
from roboirg.policies.contract.option_checking import check_options
from roboirg.policies.contract.policy_urls import parse_query
from roboirg.policies.lerobot_features import LeRobotFeatures
from roboirg.util.media import Pixels, decode_png
from roboirg.util.parquet_support import check_parquet_support

STATE, ACTION, PICTURES = "observation.state", "action", "observation.images."
_VERSION = "v3.0"


@dataclass(frozen=True)
class TeleopDataset:
    """A recorded dataset; frames and pictures are read when they are asked for.

    Attributes:
        root: its folder.
        names: of joints, gripper and cameras, and their units.
        info: its metadata.
        episodes: rows of its table of episodes, in order.
    """

    root: Path
    names: LeRobotFeatures
    info: Mapping[str, Any]
    episodes: tuple[Mapping[str, Any], ...]

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names of its cameras."""
        features = self.info["features"]
        return tuple(one.removeprefix(PICTURES) for one in features if one.startswith(PICTURES))

    @property
    def texts(self) -> tuple[str, ...]:
        """What each episode was recorded with."""
        return tuple(" / ".join(episode["tasks"]) for episode in self.episodes)

    def columns(self, feature: str) -> list[str]:
        """Return the names of a vector's entries; empty if the dataset has no such vector."""
        return list(self.info["features"].get(feature, {}).get("names") or [])

    def vectors(self, index: int, feature: str) -> NDArray[np.float64]:
        """Return joints and gripper of each frame in the robot's units, (frames, 8)."""
        has = self.columns(feature)
        order = [has.index(one) for one in self.names.vector]
        return np.array(self._column(index, feature), dtype=np.float64)[:, order]

    def pictures(self, index: int, camera: str) -> Iterator[Pixels]:
        """Yield the pictures of an episode, RGB.

        Raises:
            InvalidValueError: a picture is missing or cannot be read.
        """
        feature = PICTURES + camera
        if self.info["features"][feature]["dtype"] == "video":
            yield from self._video(index, feature)
        else:
            yield from (decode_png(one["bytes"]) for one in self._column(index, feature))

    def _path(self, index: int, kind: str, pattern: str, **names: str) -> Path:
        indices = ("chunk_index", "file_index")
        place = {one: self.episodes[index][f"{kind}/{one}"] for one in indices}
        return self.root / str(self.info[pattern]).format(**names, **place)

    def _column(self, index: int, name: str) -> list[Any]:
        from pyarrow import parquet

        path = self._path(index, "data", "data_path")
        own = [("episode_index", "=", self.episodes[index]["episode_index"])]
        found: list[Any] = parquet.read_table(path, columns=[name], filters=own)[name].to_pylist()
        return self._whole(found, index, path)

    def _video(self, index: int, feature: str) -> list[Pixels]:
        import av

        kind = f"videos/{feature}"
        path = self._path(index, kind, "video_path", video_key=feature)
        start = self.episodes[index][f"{kind}/from_timestamp"]
        found: list[Pixels] = []
        try:
            with av.open(str(path)) as container:
                stream: Any = container.streams.video[0]
                container.seek(int(start / stream.time_base), stream=stream)
                for frame in container.decode(stream):
                    if frame.time > start - 0.5 / self.info["fps"]:
                        found.append(frame.to_ndarray(format="rgb24"))
                    if len(found) == self.episodes[index]["length"]:
                        break
        except (OSError, av.FFmpegError) as error:
            raise InvalidValueError(f"The video {path} cannot be read: {error}.") from error
        return self._whole(found, index, path)

    def _whole(self, found: list[Any], index: int, path: Path) -> list[Any]:
        if len(found) != (length := self.episodes[index]["length"]):
            raise InvalidValueError(
                f"{path} has {len(found)} of {length} frames of episode {index}."
            )
        return found


def open_teleop(spec: str) -> TeleopDataset:
    """Open a dataset.

    Args:
        spec: its folder, with names that differ from the usual: ``DIR?front=top&degrees=true``.

    Raises:
        InvalidValueError: the folder holds no dataset of LeRobot 3.0, or an option is wrong.
        MissingDependencyError: pyarrow is not installed.
    """
    check_parquet_support()
    folder, _, query = spec.partition("?")
    names = check_options(LeRobotFeatures, parse_query(spec, query), f"dataset {spec!r}")
    root = Path(folder)
    try:
        info = json.loads((root / "meta/info.json").read_text(encoding="utf-8"))
        if info["codebase_version"] != _VERSION:
            raise ValueError(f"its format is {info['codebase_version']}; convert it with LeRobot")
        tables = sorted((root / "meta/episodes").glob("*/*.parquet"))
        rows = (row for path in tables for row in read_rows(path))
        episodes = ({k: v for k, v in row.items() if not k.startswith("stats/")} for row in rows)
        return TeleopDataset(root, names, info, tuple(episodes))
    except (OSError, ValueError, KeyError) as error:
        raise InvalidValueError(
            f"{folder!r} is no dataset of LeRobot's format {_VERSION}: {error}."
        ) from error
