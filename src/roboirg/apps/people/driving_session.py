"""An episode that a person drives: what the page shows of it, and what the person wants next."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

from roboirg.core.observations import CAMERAS
from roboirg.core.subgoal_text import Point
from roboirg.evaluation.play.video_writer import PictureSource
from roboirg.evaluation.records.record import Record
from roboirg.util.media import encode_jpeg

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

WAIT_S = 5.0
"""How long a page's question about news stays open."""


class DrivingStoppedError(Exception):
    """The page was closed, or the server, while an episode was driven."""


@dataclass
class DrivingSession:
    """What a person sees and commands; for use by the page's threads and the world's.

    As a sink of frames it makes live pictures.

    Attributes:
        phase: at first; then idle, loading, driving (it waits for a command), moving, over or
            failed.
        every: control steps between two live pictures.
        caption: what was said so far; unused, as `say` gets it.
        longest_caption, point: unused.
        env: the environment, once it is there.
        video: an MP4 file; None without one.
    """

    phase: str = "loading"
    every: int = 3
    caption: str = ""
    longest_caption: str = ""
    point: Point | None = None
    env: RoboIRGEnv | None = None

    def __post_init__(self) -> None:
        self._news = threading.Condition()
        self._version = 0
        self._shown: dict[str, Any] = {
            "phase": self.phase, "heard": [], "video": False, "message": None, "verdict": None,
            "steps": 0, "gripper": "open", "height_cm": None, "pictures": 0,
        }  # fmt: skip
        self._pictures: dict[str, bytes] = {}
        self.video: bytes | None = None
        self._command: Mapping[str, Any] | None = None
        self._stopped = False

    def add_frame(self, source: PictureSource, is_demonstration: bool = False) -> None:
        """Make the current pictures those of the page; the video is shown apart."""
        # There is no other source of frames.
        self.env = cast("RoboIRGEnv", source)
        if is_demonstration:
            return
        self.show_pictures({one: source.picture(one) for one in CAMERAS})

    def show_pictures(self, pictures: Mapping[str, Any]) -> None:
        """Show pictures, uint8 (256, 256, 3), by camera."""
        encoded = {name: encode_jpeg(pixels) for name, pixels in pictures.items()}
        with self._news:
            self._pictures = encoded
            self.tell(pictures=self._shown["pictures"] + 1)

    def begin(self, words: str, video: bytes | None) -> None:
        """Show the first words, and the video that comes before the policy's turn."""
        with self._news:
            self.video = video
            self.tell(heard=[words], video=video is not None)

    def say(self, text: str) -> None:
        """Show what has just been said."""
        with self._news:
            self.tell(heard=[*self._shown["heard"], text])

    def tell(self, **shown: object) -> None:
        """Show something else: a message, the gripper, the height."""
        with self._news:
            self._shown.update(shown)
            self._version += 1
            self._news.notify_all()

    def finish(self, record: Record) -> None:
        """Show the verdict, why, and what was meant."""
        attribution = record.attribution
        verdict = {
            "outcome": record.outcome,
            "cause": record.cause,
            "why": None if attribution is None else attribution.sentence,
            "meant": record.command,
            "steps": record.steps,
        }
        self.tell(phase="over", verdict=verdict, message=None)

    def fail(self, message: str) -> None:
        """Show that the episode cannot be played."""
        self.tell(phase="failed", message=message)

    def stop(self) -> None:
        """End the episode without a verdict."""
        with self._news:
            self._stopped = True
            self._news.notify_all()

    def command(self, wanted: Mapping[str, Any]) -> bool:
        """Say what the robot does next; returns whether it was free to do so."""
        with self._news:
            if self._shown["phase"] != "driving":
                return False
            self._command = wanted
            self.tell(phase="moving", message=None)
            return True

    def wait_command(self) -> Mapping[str, Any]:
        """Return what the person wants next.

        Raises:
            DrivingStoppedError: nothing more, ever.
        """
        with self._news:
            self.tell(phase="driving")
            self._news.wait_for(lambda: self._command is not None or self._stopped)
            if self._stopped or self._command is None:
                raise DrivingStoppedError
            wanted, self._command = self._command, None
            return wanted

    def news(self, version: int) -> dict[str, Any]:
        """Return what the page shows, as soon as it is newer than a version, or after a while."""
        with self._news:
            self._news.wait_for(lambda: self._version > version or self._stopped, WAIT_S)
            return {**self._shown, "version": self._version}

    def picture(self, camera: str) -> bytes | None:
        """Return the newest picture of a camera, a JPEG file."""
        with self._news:
            return self._pictures.get(camera)
