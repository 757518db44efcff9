"""``python -m roboirg`` is the ``roboirg`` command."""

from roboirg.cli import main

if __name__ == "__main__":
    main()
