"""The world that plays any scene, built on SAPIEN; no file here knows a task's name."""
