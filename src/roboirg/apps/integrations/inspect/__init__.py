"""RoboIRGBench in Inspect: ``inspect eval roboirg/listener --model openai/gpt-4o``."""
