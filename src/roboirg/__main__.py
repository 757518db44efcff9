"""``python -m roboirg`` is the ``roboirg`` command."""

from roboirg.main import main

if __name__ == "__main__":
    main()
