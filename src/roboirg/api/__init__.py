"""`roboirg.evaluate`: a run and its results in Python."""
