"""`borecheck view`: the robot in its scanner, live in the browser."""

import argparse
from collections.abc import Callable
from typing import TYPE_CHECKING

from borecheck.commands import common
from borecheck.commands.options.allowed import add_allowed
from borecheck.commands.options.needle import add_needle
from borecheck.commands.options.patient_place import add_patient_place, place_of
from borecheck.core.units import parse_length

if TYPE_CHECKING:
    from borecheck.view.bridge import Bridge
    from borecheck.view.server import LiveView
    from borecheck.view.session import Session

DEFAULT_PORT = 8123
IGTL_PORT = 18944  # registered for OpenIGTLink


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command."""
    common.add_robot(parser)
    common.add_scene(parser)
    for action in parser._actions:
        if action.dest == "scene":
            action.nargs = "*"
    parser.add_argument(
        "--margin", default="0", help="required clearance to begin with, e.g. 20mm"
    )
    add_needle(parser)
    add_patient_place(parser)
    add_allowed(parser)
    parser.add_argument(
        "--igtl",
        nargs="?",
        const=str(IGTL_PORT),
        metavar="[HOST:]PORT",
        help="also speak OpenIGTLink there: needle and table in, links and verdict out "
        f"(default: 127.0.0.1:{IGTL_PORT})",
    )
    parser.add_argument(
        "--port",
        type=int,
        default=DEFAULT_PORT,
        help=f"port on 127.0.0.1 (default: {DEFAULT_PORT}; 0: any)",
    )


def run(args: argparse.Namespace) -> int:
    """Serves the view until Ctrl-C."""
    from borecheck.commands.compiling import tell_of_compiling
    from borecheck.commands.progress import say
    from borecheck.errors import UsageError
    from borecheck.report.case_words import case_lines
    from borecheck.view.first_plan import first_plan
    from borecheck.view.server import check_port, serve
    from borecheck.view.session import Session

    for line in case_lines({"case": args.case and args.case.to_json()}):
        say(f"borecheck: {line}")
    if not 0 <= args.port < 65536:
        raise UsageError(f"--port {args.port} is no port")
    check_port(args.port)
    margin = parse_length(args.margin)
    robot = common.load(args)
    if not args.scene:
        args.scene = [_own_scanner(robot)]
    scene = common.load_surroundings(args)
    tell_of_compiling()
    session = Session(robot, scene, first_plan(robot, scene), margin)
    serve(session, args.port, say, _bridged(args, session, say))
    return 0


def _bridged(
    args: argparse.Namespace, session: "Session", say: Callable[[str], None]
) -> "Callable[[LiveView], Bridge] | None":
    """What starts the bridge to trackers, if it is asked for."""
    if args.igtl is None:
        return None
    from borecheck.view.bridge import Bridge, address
    from borecheck.view.tracked import Tracked

    host, port = address(args.igtl)
    tracked = Tracked(session, place_of(args))

    def start(view: "LiveView") -> Bridge:
        bridge = Bridge(
            tracked, port, host, lambda t: say(f"borecheck: {t}"), view.stand
        )
        say(f"borecheck: OpenIGTLink at {host}:{bridge.port}")
        return bridge

    return start


def _own_scanner(robot: object) -> str:
    from borecheck.errors import UsageError

    description = getattr(robot, "description", None)
    scanner = getattr(description, "scanner", None)
    if not scanner:
        raise UsageError("this robot has no scanner of its own: give SCENE")
    return str(scanner)
