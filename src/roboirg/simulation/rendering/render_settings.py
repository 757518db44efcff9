"""Render settings: faithful, with light meshes, or the stock path for comparison."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RenderSettings:
    """Meshes, shader and optimizations used for drawing.

    Attributes:
        culling: each camera draws only the bodies that reach into its view, of the robot's base
            only what reaches a pixel, and only if one of them has moved; changes no pixel.
        slim_shader: skip parts of SAPIEN's shader that contribute nothing; some pixels change by
            one level.
        meshes: ``stock`` as installed; ``faithful`` without triangles that are never visible;
            ``light`` with fewer triangles, which changes pictures slightly.
        quick_start: keep SAPIEN's render engine as long as the process lives, and skip computing a
            table that no picture needs.
    """

    culling: bool = True
    slim_shader: bool = True
    meshes: str = "faithful"
    quick_start: bool = True


FAITHFUL = RenderSettings()
LIGHT = RenderSettings(meshes="light")
STOCK = RenderSettings(culling=False, slim_shader=False, meshes="stock", quick_start=False)
