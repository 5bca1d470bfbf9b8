"""`python -m drivetwin`: the command line for environments in which `drivetwin` is not on the path."""

from drivetwin.cli import main

if __name__ == "__main__":
    main()
