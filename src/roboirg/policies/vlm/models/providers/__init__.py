"""The services of models, one file each; a file that defines ``PROVIDER`` is one."""
