"""RoboIRGBench in vla-eval: ``benchmark: roboirg.apps.integrations.vla_eval:RoboIRGBenchmark``.

vla-eval resolves the class before it chooses how to render, so nothing here may import the
simulator.
"""

from roboirg.apps.integrations.vla_eval.step_benchmark import RoboIRGBenchmark

__all__ = ["RoboIRGBenchmark"]
