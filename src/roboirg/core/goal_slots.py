"""The slots of a goal, and what kind of value each one holds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

SlotTypeName = Literal["number", "visit", "placement", "relation", "color", "amount"]
SLOT_TYPE_NAMES: Mapping[str, SlotTypeName] = {
    "color": "color",
    "colors": "color",
    "counts": "amount",
    "repeats": "number",
    "visit": "visit",
    "placement": "placement",
    "relation": "relation",
}
"""The type of each goal slot; counted colors are amounts, together with their counts."""
COLOR_SLOTS = ("color", "colors")
MOMENTS = ("before", "after")
"""The values of a relation, in the order of time: right before and right after a button press."""
