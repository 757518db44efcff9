"""Stages and events give a verdict, without a simulator."""
