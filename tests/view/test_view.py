import os
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import numpy as np
import pytest

from borecheck.cli import main
from borecheck.contact.check import check
from borecheck.core.result_file import read_result
from borecheck.errors import BorecheckError, UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.plans.plan_file import read_plans
from borecheck.plans.plan_motion import UnreachableError
from borecheck.view.first_plan import first_plan
from borecheck.view.panel import plain
from borecheck.view.server import HOST, LiveView, check_port
from borecheck.view.session import CHECKING, Session

# Inverse kinematics puts the tip on the plan to rounding.
TIP = 1e-9
PATIENCE = 30.0


@pytest.fixture(scope="module")
def session(zerobot, ct_gantry):
    return Session(zerobot, ct_gantry, first_plan(zerobot, ct_gantry))


def test_first_plan_begins_on_the_skin(session):
    entry = session.plan.entry
    torso = next(o for o in session.scene.obstacles if o.role == "patient").mesh
    gaps = np.linalg.norm(torso.vertices - entry, axis=1)
    assert entry[2] > session.plan.target[2]
    assert gaps.min() < 0.1
    assert abs(entry[2]) < 0.01  # examples/plans.csv: the skin is at -1.1 mm


def test_glance_never_says_clear_and_judge_does(session):
    q = session.robot.home
    glance, judged = session.glance(q), session.judge(q)
    assert judged.state == "clear"
    assert glance.state == CHECKING
    assert glance.closest == judged.closest


def test_glance_and_judge_agree_about_contact(session):
    rng = np.random.default_rng(3)
    found = 0
    for q in session.robot.model.random_configurations(rng, 8):
        verdict = check(session.robot, session.scene, q)
        if verdict.contacts:
            found += 1
            assert session.glance(q).state == "contact"
            assert session.judge(q).touching
            assert session.judge(q).lit.shape[1:] == (2, 3, 3)
            assert len(session.judge(q).lit) > 0
    assert found > 0


def test_margin_counts_in_both(session):
    q = session.robot.home
    narrow = Session(session.robot, session.scene, session.plan, margin=0.04)
    assert narrow.glance(q).state == narrow.judge(q).state == "contact"


def test_robot_follows_the_plan(session):
    moved = session.with_plan((0.02, 0.03, 0.0), (0.02, 0.02, -0.06))
    motion = moved.motion()
    tip = moved.robot.description.tool_frame
    end = moved.robot.placements(moved.at(motion, 1.0))[tip][:3, 3]
    np.testing.assert_allclose(end, moved.plan.target, atol=TIP)
    with pytest.raises(UnreachableError):
        session.with_plan((3.0, 0.0, 0.0), (3.0, 0.0, -0.06)).motion()


def test_mount_switch_keeps_the_place(session):
    turned = session.with_mount("-90")
    assert turned.robot.arguments["mount"] == "-90"
    np.testing.assert_allclose(turned.robot.T_scene_base, session.robot.T_scene_base)
    with pytest.raises(BorecheckError):
        session.with_mount("45")


def test_patient_is_replaced_and_a_bad_mesh_refused(session, tmp_path):
    path = tmp_path / "lump.stl"
    write_stl(path, box("lump", (0.2, 0.2, 0.1)))
    other = session.with_patient(f"{path}:m@0,0,-0.1")
    assert [o.name for o in other.scene.obstacles if o.role == "patient"] == ["lump"]
    assert len(other.scene.obstacles) == len(session.scene.obstacles)
    bad = tmp_path / "bad.stl"
    bad.write_bytes(b"no mesh")
    with pytest.raises(BorecheckError):
        session.with_patient(str(bad))


@pytest.mark.parametrize("name", ["plan.csv", "plan.json"])
def test_saved_plan_is_read_back(session, tmp_path, name):
    path = tmp_path / name
    session.save_plan(path)
    (plan,) = read_plans(path)
    np.testing.assert_allclose(plan.entry, session.plan.entry, atol=1e-12)
    np.testing.assert_allclose(plan.target, session.plan.target, atol=1e-12)


def test_report_is_a_page_of_the_plan(session, tmp_path):
    path = tmp_path / "live.html"
    verdict = session.write_report(path, session.robot.home, samples=3)
    document = read_result(path)
    assert document["verdict"] == verdict
    assert document["plans"][0]["name"] == "live"


def test_port_that_is_taken_is_one_clear_line(capsys):
    with socket.socket() as taken:
        taken.bind((HOST, 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(UsageError, match=f"port {port} .*--port"):
            check_port(port)
        assert main(["view", "zerobot", "--port", str(port)]) == 2
    err = capsys.readouterr().err
    assert err.startswith("borecheck: error: port")
    assert len(err.splitlines()) == 1


def test_names_do_not_become_markup():
    assert plain("<b>*x*</b>") == "\\<b\\>\\*x\\*\\</b\\>"


@pytest.fixture(scope="module")
def view(session):
    pytest.importorskip("viser", reason="viser is missing")
    with socket.socket() as probe:
        probe.bind((HOST, 0))
        port = probe.getsockname()[1]
    view = LiveView(session, port)
    yield view
    view.stop()


def settled(view, answers):
    """Waits until a full check has been shown since `answers`."""
    end = time.monotonic() + PATIENCE
    while view.answers <= answers or view.shown.state == CHECKING:
        assert time.monotonic() < end
        time.sleep(0.01)
    return view.shown


def test_it_serves_this_machine_only(view):
    assert view.server.get_host() == HOST
    with urllib.request.urlopen(view.address, timeout=10) as page:
        assert page.status == 200


def test_a_moved_joint_is_judged(view):
    settled(view, 0)
    answers = view.answers
    slider, scale = view.panel.sliders[0]
    slider.value = scale * 0.04
    view.panel.joint_moved(0, slider, scale)(None)
    shown = settled(view, answers)
    assert shown.q[0] == pytest.approx(0.04)
    assert "CLEAR" in view.panel.state.content
    part = view.session.robot.parts[0]
    position = view.stage.links[part.mesh.name].position
    np.testing.assert_allclose(position, shown.placements[part.link][:3, 3])


def test_dragged_handles_move_the_robot_and_errors_are_told(view):
    answers = view.answers
    view.panel.along.value = 100.0
    view.stage.ends[0].position = np.array([0.02, 0.0, 0.0])
    view.stage.ends[1].position = np.array([0.02, 0.0, -0.05])
    view.replan()
    shown = settled(view, answers)
    tip = shown.placements[view.session.robot.description.tool_frame][:3, 3]
    np.testing.assert_allclose(tip, (0.02, 0.0, -0.05), atol=TIP)
    view.stage.ends[1].position = np.array([5.0, 0.0, -0.05])
    view.replan()
    assert "Not done" in view.panel.note.content
    answers = view.answers
    view.ask()
    settled(view, answers)
    assert "UNKNOWN" in view.panel.state.content


def test_a_bad_mesh_dropped_is_told_and_the_view_goes_on(view):
    class Dropped:
        name = "../../bad<b>.stl"
        content = b"nothing of a mesh"

    view.take(Dropped)
    assert "Not done" in view.panel.note.content
    assert "<b>" not in view.panel.note.content.replace("\\<b\\>", "")
    answers = view.answers
    view.ask()
    settled(view, answers)
    assert not Path("bad<b>.stl").exists()


def test_a_failure_takes_the_verdict_off_and_the_view_goes_on(view, monkeypatch):
    def broken(*_):
        raise RuntimeError("<b>broken</b>")

    answers = view.answers
    view.ask()
    settled(view, answers)
    with monkeypatch.context() as patched:
        patched.setattr(Session, "glance", broken)
        view.ask()
        end = time.monotonic() + PATIENCE
        while "broken" not in view.panel.state.content:
            assert time.monotonic() < end
            time.sleep(0.01)
        assert "UNKNOWN" in view.panel.state.content
    answers = view.answers
    slider, scale = view.panel.sliders[0]
    view.panel.joint_moved(0, slider, scale)(None)
    settled(view, answers)
    assert "UNKNOWN" not in view.panel.state.content


def test_kill_int_ends_it_even_in_the_background(tmp_path):
    """A shell without job control starts what runs behind `&` deaf to Ctrl-C."""
    words = f"'{sys.executable}' -m borecheck view zerobot --port 0"
    process = subprocess.Popen(
        ["sh", "-c", f"{words} & echo $!; wait"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        cwd=tmp_path,
        text=True,
    )
    number = int(process.stdout.readline())
    lines = iter(process.stderr.readline, "")
    assert any("live view at http://127.0.0.1:" in line for line in lines)
    os.kill(number, signal.SIGINT)
    _, told = process.communicate(timeout=PATIENCE)
    assert "interrupted" in told
    assert "Traceback" not in told
