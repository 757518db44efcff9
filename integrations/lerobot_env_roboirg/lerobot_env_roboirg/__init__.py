"""Registers RoboIRGBench with LeRobot, which imports this module by the distribution's name."""

from roboirg.apps.integrations.lerobot import register

register()
