"""Read a data set of LeRobot 3.0 that was recorded on an arm, under the names that it has there."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.demonstrations.parquet_tables import read_rows
from roboirg.apps.demonstrations.picture_coding import Picture
from roboirg.core.errors import InvalidValueError
from roboirg.policies.contract.option_checking import check_options
from roboirg.policies.contract.policy_urls import parse_query
from roboirg.policies.lerobot_features import LeRobotFeatures
from roboirg.util.parquet_support import check_parquet_support

STATE, ACTION, PICTURES = "observation.state", "action", "observation.images."
_VERSION = "v3.0"


class TeleopEpisode(NamedTuple):
    """One episode of the data set.

    Attributes:
        number: its index.
        text: the task that it was recorded with.
        length: number of frames.
        places: its row in the table of episodes.
    """

    number: int
    text: str
    length: int
    places: Mapping[str, Any]


@dataclass(frozen=True)
class TeleopDataset:
    """A recorded data set; pictures are read when they are asked for.

    Attributes:
        root: its folder.
        names: of joints, gripper and cameras, and their units.
        info: its metadata.
        episodes: in order.
    """

    root: Path
    names: LeRobotFeatures
    info: Mapping[str, Any]
    episodes: tuple[TeleopEpisode, ...]

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names of its cameras."""
        return tuple(
            name.removeprefix(PICTURES)
            for name in self.info["features"]
            if name.startswith(PICTURES)
        )

    def columns(self, feature: str) -> list[str]:
        """Return the names of a vector's entries; empty if the data set has no such vector."""
        return list(self.info["features"].get(feature, {}).get("names") or [])

    def vectors(self, episode: TeleopEpisode, feature: str) -> NDArray[np.float64]:
        """Return joints and gripper of each frame in the robot's units, (frames, 8)."""
        has = self.columns(feature)
        order = [has.index(one) for one in (*self.names.joints, self.names.gripper)]
        return np.array(self._column(episode, feature), dtype=np.float64)[:, order]

    def pictures(self, episode: TeleopEpisode, camera: str) -> Iterator[Picture]:
        """Yield the pictures of an episode, RGB.

        Raises:
            InvalidValueError: a picture is missing or cannot be read.
        """
        feature = PICTURES + camera
        if self.info["features"][feature]["dtype"] == "video":
            yield from self._video(episode, feature)
            return
        import cv2

        for entry in self._column(episode, feature):
            content = entry["bytes"] or (self.root / entry["path"]).read_bytes()
            found = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)
            if found is None:
                raise InvalidValueError(f"A {camera} picture of {self._where(episode)} is damaged.")
            yield np.asarray(cv2.cvtColor(found, cv2.COLOR_BGR2RGB), dtype=np.uint8)

    def _column(self, episode: TeleopEpisode, name: str) -> list[Any]:
        from pyarrow import parquet

        place = {key: episode.places[f"data/{key}"] for key in ("chunk_index", "file_index")}
        path = self.root / self.info["data_path"].format(**place)
        table = parquet.read_table(
            path, columns=[name], filters=[("episode_index", "=", episode.number)]
        )
        found: list[Any] = table[name].to_pylist()
        if len(found) != episode.length:
            raise InvalidValueError(
                f"{self._where(episode)} has {len(found)} frames in {path.name} instead of "
                f"{episode.length}."
            )
        return found

    def _video(self, episode: TeleopEpisode, feature: str) -> Iterator[Picture]:
        import av

        key = f"videos/{feature}"
        place = {one: episode.places[f"{key}/{one}"] for one in ("chunk_index", "file_index")}
        path = self.root / self.info["video_path"].format(video_key=feature, **place)
        start, count = float(episode.places[f"{key}/from_timestamp"]), 0
        try:
            with av.open(str(path)) as container:
                stream: Any = container.streams.video[0]
                container.seek(int(start / stream.time_base), stream=stream)
                for frame in container.decode(stream):
                    if frame.time < start - 0.5 / self.info["fps"]:
                        continue
                    if count == episode.length:
                        return
                    count += 1
                    yield frame.to_ndarray(format="rgb24")
        except (OSError, av.FFmpegError) as error:
            raise InvalidValueError(f"The video {path} cannot be read: {error}.") from error
        if count < episode.length:
            raise InvalidValueError(
                f"The video {path} ends after {count} of {episode.length} frames of "
                f"{self._where(episode)}."
            )

    def _where(self, episode: TeleopEpisode) -> str:
        return f"episode {episode.number} of {self.root}"


def open_teleop(spec: str) -> TeleopDataset:
    """Open a data set.

    Args:
        spec: its folder, with names that differ from the usual: ``DIR?front=top&degrees=true``.

    Raises:
        InvalidValueError: the folder holds no data set of LeRobot 3.0, or an option is wrong.
        MissingDependencyError: pyarrow is not installed.
    """
    check_parquet_support()
    folder, _, query = spec.partition("?")
    names = check_options(LeRobotFeatures, parse_query(spec, query), f"data set {spec!r}")
    root = Path(folder)
    try:
        info = json.loads((root / "meta/info.json").read_text(encoding="utf-8"))
        version = info["codebase_version"]
        if version == _VERSION:
            tables = sorted((root / "meta/episodes").glob("*/*.parquet"))
            rows = [row for path in tables for row in read_rows(path)]
            return TeleopDataset(root, names, info, tuple(map(_episode, rows)))
    except (OSError, ValueError, KeyError) as error:
        raise InvalidValueError(f"{folder!r} is no data set of LeRobot: {error}.") from error
    raise InvalidValueError(
        f"{folder!r} has LeRobot's format {version}; convert it to {_VERSION} with LeRobot first."
    )


def _episode(row: Mapping[str, Any]) -> TeleopEpisode:
    places = {key: value for key, value in row.items() if not key.startswith("stats/")}
    return TeleopEpisode(row["episode_index"], " / ".join(row["tasks"]), row["length"], places)
