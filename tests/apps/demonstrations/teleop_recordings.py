"""Datasets in the layout that LeRobot 0.6 writes when it records an arm, small and synthetic."""

import csv
import json

import numpy as np

from roboirg.apps.demonstrations.parquet_tables import (
    number_column,
    picture_column,
    write_frames,
    write_rows,
)
from roboirg.apps.demonstrations.picture_coding import VideoEncoder, encode_png
from roboirg.apps.real.study.study_csv import demonstrations_csv
from roboirg.apps.real.study.study_plan import make_study
from roboirg.util.atomic_write import write_atomically

NAMES = [*(f"joint_{number}.pos" for number in range(1, 8)), "gripper.pos"]
FRAMES = 5
HEIGHT, WIDTH = 48, 64


def write_plan(folder, count=4):
    """Write what roboirg real plan writes of the demonstrations; returns the rows."""
    tasks = ("PutInBox", "PickByCount")
    study = make_study(("listener",), tasks=tasks, trials=1, demonstrations=count)
    folder.mkdir(parents=True, exist_ok=True)
    write_atomically(folder / "demonstrations.csv", demonstrations_csv(study))
    return list(csv.DictReader((folder / "demonstrations.csv").open()))


def vectors(kind, episode):
    """Return joints (rad) and gripper (0 to 1) of each frame, (FRAMES, 8)."""
    rng = np.random.default_rng(("state", "action").index(kind) + 10 * episode)
    found = rng.uniform(-1, 1, (FRAMES, 8))
    found[:, 7] = rng.uniform(0, 1, FRAMES)
    return found.astype(np.float32)


def picture(camera, episode, frame):
    """Return a picture whose central square has one color, and whose sides are white."""
    found = np.full((HEIGHT, WIDTH, 3), 255, np.uint8)
    side = (WIDTH - HEIGHT) // 2
    base = 20 if camera == "front" else 120
    found[:, side:-side] = (base + frame, base + 4 * episode, base)
    return found


def write_recording(root, texts, *, cameras=("front", "wrist"), fps=20, videos=False, unit=None):
    """Write one episode for each text, all frames in one file, as LeRobot does."""
    features = {
        name: {"dtype": "float32", "shape": [8], "names": NAMES}
        for name in ("observation.state", "action")
    }
    for camera in cameras:
        dtype = "video" if videos else "image"
        names = ["height", "width", "channels"]
        key = f"observation.images.{camera}"
        features[key] = {"dtype": dtype, "shape": [HEIGHT, WIDTH, 3], "names": names}
    change = unit or (lambda values: values)
    states, actions = (
        np.concatenate([change(vectors(kind, episode)) for episode in range(len(texts))])
        for kind in ("state", "action")
    )
    columns = {
        "observation.state": number_column(states),
        "action": number_column(actions),
        "episode_index": number_column(np.repeat(np.arange(len(texts)), FRAMES)[:, None]),
    }
    for camera in cameras:
        shown = [picture(camera, at, frame) for at in range(len(texts)) for frame in range(FRAMES)]
        key = f"observation.images.{camera}"
        if videos:
            encoder = VideoEncoder("lossless-video")
            for one in shown:
                encoder.add(one)
            path = root / f"videos/{key}/chunk-000/file-000.mp4"
            path.parent.mkdir(parents=True)
            write_atomically(path, encoder.finish())
        else:
            columns[key] = picture_column([encode_png(one) for one in shown])
    pictures = [name for name in columns if "images" in name]
    write_frames(root / "data/chunk-000/file-000.parquet", list(columns), {}, [columns], pictures)
    write_rows(root / "meta/episodes/chunk-000/file-000.parquet", list(_rows(texts, cameras, fps)))
    info = {
        "codebase_version": "v3.0",
        "fps": fps,
        "features": features,
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "video_path": "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4",
    }
    write_atomically(root / "meta/info.json", json.dumps(info))


def _rows(texts, cameras, fps):
    for index, text in enumerate(texts):
        row = {"episode_index": index, "tasks": [text], "length": FRAMES}
        row |= {"data/chunk_index": 0, "data/file_index": 0, "stats/action/mean": [0.0] * 8}
        for camera in cameras:
            key = f"videos/observation.images.{camera}"
            row |= {f"{key}/chunk_index": 0, f"{key}/file_index": 0}
            row[f"{key}/from_timestamp"] = index * FRAMES / fps
        yield row
