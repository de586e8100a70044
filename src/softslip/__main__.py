"""Run the command line as ``python -m softslip``."""

from softslip.cli import main

if __name__ == "__main__":
    main()
