"""Cameras, culling, shaders and meshes: how pictures are drawn."""
