"""Ways of the installed robots between seeded goals, in four parts.

    python -m studies.routes --goals 100 --seed 1
    python -m studies.routes --part walled --goals 10 --seed 1
    python -m studies.routes --part same --goals 10 --seed 1
    python -m studies.routes --part resampled --goals 12 --seed 1

Each part's module says what it asks; the exit status is 1 if any answer is wrong.
"""

import argparse
import sys

from studies.routes import found, resampled, same, walled

PARTS = {"found": found, "walled": walled, "same": same, "resampled": resampled}


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--part", choices=PARTS, default="found")
    parser.add_argument("--goals", type=int, default=None, help="of each robot")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    part = PARTS[options.part]
    goals = part.GOALS if options.goals is None else options.goals
    return 1 if part.run(goals, options.seed) else 0


if __name__ == "__main__":
    sys.exit(main())
