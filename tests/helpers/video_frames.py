"""The frames of a video."""

import av


def frames_of(video):
    """Return the frames of a path or an open file, each an array (height, width, 3)."""
    with av.open(video) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
