"""How pictures are made: faithfully, with lighter meshes, or by the stock path to compare with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from roboirg.core.errors import UnknownNameError

Meshes = Literal["stock", "faithful", "light"]


@dataclass(frozen=True, slots=True)
class Rendering:
    """What is drawn, and by which shader.

    Attributes:
        culling: each camera draws only the bodies that reach into its view, of the robot's base
            only what it can see, and only when one of them has moved; changes no pixel.
        slim_shader: what adds nothing to a picture is left out of SAPIEN's shader; some pixels
            change by one level.
        meshes: ``stock`` as installed; ``faithful`` without what nobody ever sees; ``light`` with
            fewer triangles, which changes pictures a little.
        quick_start: SAPIEN's render engine lives as long as the process, and a table that no
            picture needs is not computed.
    """

    culling: bool = True
    slim_shader: bool = True
    meshes: Meshes = "faithful"
    quick_start: bool = True


FAITHFUL = Rendering()
LIGHT = Rendering(meshes="light")
STOCK = Rendering(culling=False, slim_shader=False, meshes="stock", quick_start=False)

OFFERED: Mapping[str, Rendering] = {"faithful": FAITHFUL, "light": LIGHT}
"""What an environment can be asked for, by its meshes."""


def find_rendering(meshes: str) -> Rendering:
    """The rendering with such meshes.

    Raises:
        UnknownNameError: it is not offered.
    """
    try:
        return OFFERED[meshes]
    except KeyError:
        raise UnknownNameError("kind of meshes", meshes, OFFERED) from None
