"""Rendering: cameras, culling, shaders and meshes."""
