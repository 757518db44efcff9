"""The colors of the page of a run and of figures, which `palette.toml` has."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from importlib import resources

import msgspec

Colors = Mapping[str, str]
"""Colors as ``"#rrggbb"`` by name, such as ``ink``."""


class Palette(msgspec.Struct):
    """Colors of pages and figures.

    Attributes:
        light: for light pages.
        dark: for dark pages, by the same names.
        failures: shades by kind of failure, from dark to bright.
        below_white: shades on which numbers are white.
    """

    light: Colors
    dark: Colors
    failures: Mapping[str, Sequence[str]]
    below_white: Sequence[str]


@functools.cache
def palette() -> Palette:
    """Return the colors of pages and figures."""
    file = resources.files("roboirg.analysis").joinpath("palette.toml")
    return msgspec.toml.decode(file.read_bytes(), type=Palette)
