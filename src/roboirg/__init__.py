"""RoboIRGBench: does a robot policy understand people who do not spell everything out?"""
