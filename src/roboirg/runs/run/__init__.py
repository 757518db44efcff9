"""Where jobs run: in this process, in local workers, or on a Ray cluster."""
