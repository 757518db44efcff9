"""With ``python -O`` nothing is missing: no assert does work, and none guards what users give."""

import ast
from pathlib import Path

import pytest
from python_process import print_of_python

HOUSE = Path(__file__).parents[1]


def test_no_source_file_has_an_assert():
    """`python -O` leaves them out, and with them whatever they check."""
    files = []
    for folder in ("src", "packages", "integrations"):
        files += (HOUSE / folder).rglob("*.py")
    assert len(files) > 500

    for path in files:
        if "tests" not in path.parts:
            tree = ast.parse(path.read_text(encoding="utf-8"))
            lines = [node.lineno for node in ast.walk(tree) if isinstance(node, ast.Assert)]
            assert lines == [], f"{path} has an assert, which -O leaves out"


@pytest.mark.sim
def test_an_episode_is_drawn_and_played_without_asserts():
    """A picture has pixels that are not black."""
    program = (
        "import roboirg\n"
        "env = roboirg.make('PickXtimes', max_steps=1)\n"
        "env.reset()\n"
        "observation, *_ = env.step(env.action_space.low)\n"
        "print(__debug__, observation['front_rgb'].any())\n"
    )
    assert print_of_python("-c", program, PYTHONOPTIMIZE="1") == "False True\n"
