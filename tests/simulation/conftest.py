"""Fixtures for tests of the simulator."""

import pytest

from roboirg.simulation.rendering.culling import CullableBodies


@pytest.fixture
def takes(monkeypatch):
    """All pictures taken: the camera's name and a list of the bodies it draws."""
    taken = []
    take_picture = CullableBodies.take_picture

    def noted(self, camera, visible):
        drawn = [body for body, seen in zip(self._bodies, visible, strict=True) if seen]
        taken.append((camera.name, drawn))
        take_picture(self, camera, visible)

    monkeypatch.setattr(CullableBodies, "take_picture", noted)
    return taken
