"""Simulation of any scene, built on SAPIEN and independent of tasks."""
