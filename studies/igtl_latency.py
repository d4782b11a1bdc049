"""How soon the bridge to trackers answers a needle that moves, on this machine.

    python -m studies.igtl_latency --robot zerobot --seconds 20

A client sends the needle at 30 Hz, along a circle round where it is at home, and takes
the time until the verdict and all links that belong to it are there.
"""

import argparse
import socket
import time

import numpy as np

import borecheck as bc
from borecheck.exchange.igtl import Reader, transform
from borecheck.view.bridge import Bridge
from borecheck.view.first_plan import first_plan
from borecheck.view.session import Session
from borecheck.view.tracked import Tracked

SCANNERS = {"zerobot": "ct_gantry", "mri_arm": "mri_open_magnet"}
RATE = 30.0
RADIUS = 0.005  # [m]


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m studies.igtl_latency")
    parser.add_argument("--robot", choices=SCANNERS, default="zerobot")
    parser.add_argument("--seconds", type=float, default=20.0)
    options = parser.parse_args()
    robot, scene = bc.load_robot(options.robot), bc.load_scene(SCANNERS[options.robot])
    session = Session(robot, scene, first_plan(robot, scene))
    T = robot.placements(robot.home)[robot.needle.tip]
    bridge = Bridge(Tracked(session), 0)
    try:
        count = int(RATE * options.seconds)
        links = len(robot.model.link_names)
        took = asked(bridge.port, T, count, links)
    finally:
        bridge.stop()
    ms = 1e3 * np.array(took)
    print(
        f"{options.robot}: {count} needles at {RATE:g} Hz, {len(took)} answered in "
        f"full ({links} links and a verdict): median {np.median(ms):.1f} ms, 95 % "
        f"within {np.percentile(ms, 95):.1f} ms, longest {ms.max():.1f} ms"
    )


def asked(port: int, T: np.ndarray, count: int, links: int) -> list[float]:
    """Seconds from each needle that is sent to the last part of its answer."""
    took: list[float] = []
    with socket.create_connection(("127.0.0.1", port)) as client:
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        reader = Reader()
        start = time.perf_counter()
        for k in range(count):
            angle = 2.0 * np.pi * k / RATE
            needle = T.copy()
            needle[:2, 3] += RADIUS * np.array([np.cos(angle), np.sin(angle)])
            sent = time.perf_counter()
            client.sendall(transform("Needle", needle, float(k + 1)).packed())
            due = start + (k + 1) / RATE
            if whole(client, reader, float(k + 1), links, due + 1.0):
                took.append(time.perf_counter() - sent)
            time.sleep(max(0.0, due - time.perf_counter()))
    return took


def whole(client, reader, number, links, until) -> bool:
    """Whether the verdict and all links of that needle came in time."""
    left = links + 1
    while time.perf_counter() < until:
        client.settimeout(max(0.001, until - time.perf_counter()))
        try:
            some = client.recv(65536)
        except TimeoutError:
            return False
        for message in reader.feed(some):
            left -= message.seconds == number
        if left == 0:
            return True
    return False


if __name__ == "__main__":
    main()
