"""The file formats of trainers, one file each."""
