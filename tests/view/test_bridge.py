"""OpenIGTLink: our messages against pyigtl, and the robot that answers."""

import socket
import struct
import time

import numpy as np
import pyigtl
import pytest
from pyigtl.messages import MessageBase

import borecheck as bc
from borecheck.exchange import igtl
from borecheck.exchange.igtl import HEADER, MAX_BODY, IgtlError, Message, Reader
from borecheck.plans.patient_place import at_isocentre
from borecheck.view.bridge import Bridge, address
from borecheck.view.first_plan import first_plan
from borecheck.view.session import Session
from borecheck.view.tracked import Tracked

SEEDED = np.random.default_rng(7)


def placement(rng=SEEDED):
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = q * np.sign(np.linalg.det(q)), rng.uniform(-1, 1, 3)
    return T


def in_mm(T):
    scaled = T.copy()
    scaled[:3, 3] *= 1e3
    return scaled


@pytest.mark.parametrize("version", [1, 2])
def test_pyigtl_sends_and_we_read(version):
    T = placement()
    sent = pyigtl.TransformMessage(in_mm(T), device_name="Needle", timestamp=12.5)
    sent.header_version = version
    if version == 2:
        sent.metadata = {"a": "b", "status": "OK"}
    text = pyigtl.StringMessage("hello", device_name="Note")
    text.header_version = version
    packed = sent.pack() + text.pack()
    reader, found = Reader(), []
    for k in range(0, len(packed), 7):  # as a socket may cut it
        found += reader.feed(packed[k : k + 7])
    assert [(m.kind, m.name) for m in found] == [
        ("TRANSFORM", "Needle"),
        ("STRING", "Note"),
    ]
    # 32-bit floats
    np.testing.assert_allclose(igtl.transform_of(found[0]), T, atol=1e-6)
    assert found[0].seconds == pytest.approx(12.5, abs=1e-6)
    assert igtl.text_of(found[1]) == "hello"


def theirs(packed):
    fields = MessageBase.parse_header(packed[:58])
    message = MessageBase.create_message(fields["message_type"])
    message.unpack(fields, packed[58 : 58 + fields["body_size"]])
    assert message.is_valid
    return message


def test_we_send_and_pyigtl_reads():
    T = placement()
    message = theirs(igtl.transform("link_1", T, 3.25).packed())
    np.testing.assert_allclose(message.matrix, in_mm(T), rtol=1e-6, atol=1e-4)
    assert (message.device_name, message.timestamp) == ("link_1", 3.25)
    assert theirs(igtl.string("Verdict", "clear: ü").packed()).string == "clear: ü"
    body = igtl.transform("x", T).content
    assert igtl.crc64(body) == pyigtl.messages.CRC64(body)


GOOD = igtl.transform("Needle", np.eye(4)).packed()
HOSTILE = {
    "another protocol": b"GET / HTTP/1.1\r\n\r\n",
    "a wrong checksum": GOOD[:-1] + b"\x01",
    "a giant": HEADER.pack(1, b"IMAGE", b"x", 0, 0, 2**62, 0),
    "a large one": HEADER.pack(1, b"IMAGE", b"x", 0, 0, MAX_BODY + 1, 0),
    "version 9": HEADER.pack(9, b"STATUS", b"x", 0, 0, 0, 0),
    "no extended header": HEADER.pack(2, b"TRANSFORM", b"x", 0, 0, 0, 0),
}


def extended(start, index, meta):
    body = struct.pack(">HHII", start, index, meta, 0)
    return HEADER.pack(2, b"TRANSFORM", b"x", 0, 0, 12, igtl.crc64(body)) + body


HOSTILE["a long extended header"] = extended(60000, 0, 0)
HOSTILE["large metadata"] = extended(12, 0, 2**32 - 1)


@pytest.mark.parametrize("case", HOSTILE)
def test_what_is_no_message_ends_the_connection(case):
    with pytest.raises(IgtlError):
        list(Reader().feed(HOSTILE[case]))


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1.1, -1.0])
def test_what_is_not_rigid_is_no_placement(bad):
    T = np.eye(4)
    T[0, 0] = bad
    with pytest.raises(IgtlError, match="not rigid"):
        igtl.transform_of(igtl.transform("Needle", T))
    with pytest.raises(IgtlError, match="not 48"):
        igtl.transform_of(Message("TRANSFORM", "x", b"1234"))


def test_damaged_bytes_are_a_message_or_refused():
    rng = np.random.default_rng(1)
    good = GOOD + igtl.string("a", "b").packed()
    for _ in range(400):
        damaged = bytearray(good)
        for _ in range(rng.integers(1, 4)):
            damaged[rng.integers(len(damaged))] = rng.integers(256)
        try:
            for message in Reader().feed(bytes(damaged)):
                if message.kind == "TRANSFORM":
                    assert np.isfinite(igtl.transform_of(message)).all()
        except IgtlError:
            continue


@pytest.fixture(scope="module")
def session():
    robot, scene = bc.load_robot("zerobot"), bc.load_scene("ct_gantry")
    made = Session(robot, scene, first_plan(robot, scene))
    q = made.motion().waypoints[0]
    made.glance(q), made.judge(q)  # compiled now, not while somebody waits
    return made


def needle_at(session, q):
    robot = session.robot
    return robot.placements(q)[robot.needle.tip]


def wait_for(client, name, holds=lambda message: True, seconds=30.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        message = client.wait_for_message(name, timeout=0.5)
        if message is not None and holds(message):
            return message
    raise AssertionError(f"no {name} that holds")


def test_a_needle_is_followed_and_judged(session):
    bridge = Bridge(Tracked(session), 0)
    client = pyigtl.OpenIGTLinkClient("127.0.0.1", bridge.port)
    try:
        q = session.motion().waypoints[0]
        T = needle_at(session, q)
        sent = pyigtl.TransformMessage(in_mm(T), device_name="Needle", timestamp=77.0)
        assert client.send_message(sent, wait=True)
        tip = wait_for(client, session.robot.needle.tip, lambda m: m.timestamp == 77.0)
        np.testing.assert_allclose(tip.matrix[:3, 3], 1e3 * T[:3, 3], atol=1e-3)
        expected = bc.check(session.robot, session.scene, q).verdict
        told = wait_for(client, "Verdict", lambda m: "checking" not in m.string)
        assert told.string.partition(":")[0] == expected
        far = in_mm(T)
        far[:3, 3] = 4000.0
        client.send_message(pyigtl.TransformMessage(far, device_name="Needle"))
        wait_for(client, "Verdict", lambda m: m.string.startswith("unknown: out of"))
    finally:
        client.stop()
        bridge.stop()


def test_the_patients_coordinates_come_and_go(session):
    place = at_isocentre([0.012, -0.04, -0.75], "FFS")
    plain, placed = Tracked(session), Tracked(session, place)
    q = session.motion().waypoints[0]
    T = needle_at(session, q)
    ras = np.diag([-1.0, -1.0, 1.0, 1.0]) @ np.linalg.inv(place.T_scanner_lps) @ T
    ours, theirs_ = plain.needle(T), placed.needle(ras)
    np.testing.assert_allclose(theirs_.shown.q, ours.shown.q, atol=1e-9)
    name = session.robot.needle.tip
    sent = {m.name: m for m in placed.messages(theirs_, 0.0)}[name]
    np.testing.assert_allclose(igtl.transform_of(sent), ras, atol=1e-6)


def test_the_table_carries_couch_and_patient(session):
    tracked = Tracked(session)
    T = np.eye(4)
    T[:3, 3] = [0.1, 0.0, -0.2]
    tracked.table(T)
    before = {o.name: o for o in session.scene.obstacles}
    for obstacle in tracked.session.scene.obstacles:
        shift = T[:3, 3] if obstacle.role in ("couch", "patient") else np.zeros(3)
        moved = obstacle.mesh.bounds - before[obstacle.name].mesh.bounds
        np.testing.assert_allclose(moved, [shift, shift], atol=1e-12)
    tracked.table(np.eye(4))  # back, not further
    for obstacle in tracked.session.scene.obstacles:
        there = before[obstacle.name].mesh.bounds
        np.testing.assert_allclose(obstacle.mesh.bounds, there, atol=1e-12)


def test_a_stranger_is_left_and_others_are_served(session):
    lines = []
    bridge = Bridge(Tracked(session), 0, say=lines.append)
    try:
        with socket.create_connection(("127.0.0.1", bridge.port), 5.0) as stranger:
            stranger.sendall(HOSTILE["another protocol"])
            stranger.settimeout(5.0)
            assert stranger.recv(10) == b""
        assert any("closed" in line for line in lines)
        with socket.create_connection(("127.0.0.1", bridge.port), 5.0) as client:
            client.settimeout(10.0)
            T = needle_at(session, session.motion().waypoints[0])
            client.sendall(igtl.transform("Needle", T).packed())
            (first, *_) = Reader().feed(client.recv(65536))
            assert (first.kind, first.name) == ("STRING", "Verdict")
    finally:
        bridge.stop()


def test_an_address_is_this_machine_unless_told():
    assert address("18944") == ("127.0.0.1", 18944)
    assert address("0.0.0.0:5") == ("0.0.0.0", 5)
    for bad in ("x", "1:2:x", "70000", "-1", ""):
        with pytest.raises(bc.BorecheckError, match="--igtl"):
            address(bad)
