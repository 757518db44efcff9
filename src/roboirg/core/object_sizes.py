"""Sizes of the objects, meters: RoboMME's, except for boxes and tapes."""

from __future__ import annotations

CUBE_HALF = 0.02
"""Half side of a cube (ManiSkill's pick-cube configuration for the Panda)."""

HIDDEN_CUBE_HALF = CUBE_HALF / 1.2
"""Half side of a cube that fits under a container."""

TARGET_THICKNESS = 0.005
"""Default thickness of a target disc."""

TARGET_HEIGHT = TARGET_THICKNESS
"""Height of a target disc's center above the table: it floats by half its thickness."""

MARKER_HALF_THICKNESS = 0.014
MARKER_DEPTH = 0.01
"""Distance of a marker's center below the center of the target that it lights up."""
MARKER_RADIUS_SHARE = 1.003
"""Radius of a marker, in radii of its target."""

BIN_HALF = 0.05
"""Half the outer side of the bin."""
BIN_HOLE_HALF = 0.04
BIN_WALL = BIN_HALF - BIN_HOLE_HALF
BIN_HEIGHT = 0.05
BIN_FLOOR_HEIGHT = 0.025
"""Height at which the black floor is drawn; objects fall through it to the table."""

BUTTON_SCALE = 1.5
BUTTON_BASE_HALF = (0.025 * BUTTON_SCALE, 0.025 * BUTTON_SCALE, 0.005 * BUTTON_SCALE)
BUTTON_CAP_RADIUS = 0.015 * BUTTON_SCALE
BUTTON_CAP_HALF_LENGTH = 0.006 * BUTTON_SCALE
BUTTON_TRAVEL = 0.1 * BUTTON_SCALE
BUTTON_HEIGHT = BUTTON_BASE_HALF[2]
"""Height of the button's origin, the center of its base."""
BUTTON_KEEP_OUT_HALF = 1.5 * BUTTON_BASE_HALF[0]
"""Half side of the square around a button that stays free of other objects."""

CONTAINER_INNER = 2.5 * CUBE_HALF
CONTAINER_WALL = 0.005
CONTAINER_ROOF = 0.004
CONTAINER_WALL_HEIGHT = 2.5 * CUBE_HALF
CONTAINER_HALF = CONTAINER_INNER / 2 + CONTAINER_WALL / 2
"""Distance from a container's axis to the middle of its walls."""
CONTAINER_FOOTPRINT_HALF = CONTAINER_INNER / 2 + CONTAINER_WALL
CONTAINER_HEIGHT = CONTAINER_WALL_HEIGHT + CONTAINER_ROOF / 2
"""Height of the origin of a container that stands on the table."""

BOX_HALF = 0.065
"""Half the outer side of an open box."""
BOX_WALL = 0.005
BOX_HEIGHT = 0.04
"""Low enough for the hand, 0.2 wide, to pick a tape right next to it."""
BOX_FLOOR = 0.002

TAPE_RADIUS = 0.0275
"""Outer radius of a roll of tape: open fingers are 0.08 apart."""
TAPE_HOLE_RADIUS = 0.015
TAPE_HALF = 0.0175
"""Half the width of the tape, and the height of the middle of a roll that lies flat. A roll that
leans on the walls of a box has its middle below 0.035."""
TAPE_SIDES = 12
"""Sides of the ring that is a roll: an even number, since the fingers are parallel."""

HALF_WIDTHS = {
    "cube": CUBE_HALF,
    "tape": TAPE_RADIUS,
    "container": CONTAINER_FOOTPRINT_HALF,
    "button": BUTTON_BASE_HALF[0],
    "bin": BIN_HALF,
    "box": BOX_HALF,
}
"""Half the width of an object by its kind; targets and sites have a radius instead."""

BESIDE = 0.05
"""How far from the outline of an object, in the plane, a hand is next to it."""
UNCLEAR = 0.015
"""Closing fingers mean two objects if the distances to their outlines differ by less."""
HAND_HIGH = 0.25
"""Height of the tool center above which it is at no object."""
HAND_RAISED = 0.1
"""Closed fingers that were above this height and come below it let go."""
HAND_LOWERED = 0.08
"""What is held below this height is being put down."""
HAND_LOW = 0.06
"""Closed fingers press below this height."""
HAND_AT_SIDE = 0.04
"""How far from the outline of an object, in the plane, fingers can be that touch it."""
HAND_AT_TOP = 0.02
"""How far above the origin of an object fingers can be that touch it."""
PUSHED = 0.025
"""How far a hand that does not hold an object moves it, in the plane, to have pushed it. Closing
fingers move what they grasp by less."""
FINGERS_SHUT = 0.004
"""Largest position of a finger that has closed on nothing."""
FINGERS_OPEN = 0.03
"""Smallest position of a finger that is open."""
LINGER_STEPS = 60
"""Control steps for which a hand that stays where it is lingers."""
