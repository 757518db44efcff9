"""RoboIRGBench: does a robot policy understand people who do not spell everything out?"""

from roboirg.core.version import __version__
from roboirg.envs.factory import make, make_vec
from roboirg.evaluation.api.evaluate import evaluate

__all__ = ["__version__", "evaluate", "make", "make_vec"]
