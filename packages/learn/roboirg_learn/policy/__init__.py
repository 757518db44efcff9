"""Policies that learn to act in waypoints from pictures, words and proprioception."""
