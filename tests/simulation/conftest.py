"""What tests of the simulator share."""

import pytest

from roboirg.simulation.rendering.culling import CullableBodies


@pytest.fixture
def takes(monkeypatch):
    """All pictures that are taken: the camera's name and the bodies that it draws, as a list."""
    taken, take_picture = [], CullableBodies.take_picture

    def noted(self, camera, visible):
        drawn = [body for body, seen in zip(self._bodies, visible, strict=True) if seen]
        taken.append((camera.name, drawn))
        take_picture(self, camera, visible)

    monkeypatch.setattr(CullableBodies, "take_picture", noted)
    return taken
