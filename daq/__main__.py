"""``python -m daq``: the command line where the command ``armhil`` is not on the path."""

from daq.cli.start import main

if __name__ == "__main__":
    main()
