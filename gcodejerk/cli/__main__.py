"""`python -m gcodejerk.cli`: the command line where no script is installed."""

from gcodejerk.cli import main

if __name__ == "__main__":
    main()
