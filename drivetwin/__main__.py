"""`python -m drivetwin`: the command line, where the command itself is not on the path."""

from drivetwin.cli import main

if __name__ == "__main__":
    main()
