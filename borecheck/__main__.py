"""`python -m borecheck`: the command line."""

import sys

from borecheck.cli import main

if __name__ == "__main__":
    sys.exit(main())
