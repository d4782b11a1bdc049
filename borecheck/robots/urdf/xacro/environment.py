"""`$(env NAME)` and `$(optenv NAME other)`: settings, but no secrets.

Robots are set up by environment variables (HUSKY_LASER_ENABLED ...), and machines keep
tokens and passwords in others. What sounds like one is not read into a robot's names.
"""

import os
import re
from collections.abc import Callable

from borecheck.robots.urdf.xacro.run import OutsideError, Run

_SECRET = re.compile(
    r"TOKEN|SECRET|PASS|CREDENTIAL|PRIVATE|COOKIE|AUTH|SESSION|(^|_)(API)?KEYS?(_|$)",
    re.IGNORECASE,
)


def environment_names(
    run: Run,
) -> tuple[Callable[[str], str], Callable[..., str]]:
    """The replacements of `_eval_env` and `_eval_optenv`.

    A variable that sounds like a secret is refused, unless the user allows everything.
    """

    def env(name: str) -> str:
        _refuse_secret(name, run)
        if name not in os.environ:
            raise LookupError(f"environment variable {name!r} is not set")
        return os.environ[name]

    def optenv(name: str, default: str = "") -> str:
        _refuse_secret(name, run)
        return os.environ.get(name, default)

    return env, optenv


def _refuse_secret(name: str, run: Run) -> None:
    if _SECRET.search(name) and not run.roots.allow_outside:
        problem = f"the environment variable {name!r} sounds like a secret: not read; "
        raise OutsideError.at(run, problem + "--allow-outside allows it")
