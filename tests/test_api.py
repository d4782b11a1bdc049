import json
import pickle
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import borecheck as bc
from borecheck.plans.corridor import Corridor
from borecheck.plans.needle_plan import NeedlePlan
from tests.places import PROJECT, ROBOTS

EXAMPLES = PROJECT / "borecheck" / "examples"
ROBOT = ROBOTS / "two_link.urdf"


@pytest.mark.parametrize("name", bc.__all__)
def test_every_public_name_is_there(name):
    assert callable(getattr(bc, name))
    assert name in dir(bc)


def test_names_stay_functions_after_their_modules_are_imported():
    code = (
        "import borecheck.validation, borecheck.contact.compare\n"
        "import borecheck.contact.check\n"
        "from borecheck.verify import check\n"  # a room that is called as a name is
        "import borecheck as bc\n"
        "import types\n"
        "found = {n: getattr(bc, n) for n in bc.__all__}\n"
        "bad = [n for n, f in found.items() if isinstance(f, types.ModuleType)]\n"
        "raise SystemExit(', '.join(bad) or 0)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="chekc"):
        bc.chekc  # noqa: B018


def test_validate_gives_findings_as_values(tmp_path):
    assert isinstance(bc.validate(ROBOT), list)
    broken = tmp_path / "broken.urdf"
    broken.write_text(ROBOT.read_text().replace('child link="arm"', 'child link="am"'))
    assert any(f.severity == "error" for f in bc.validate(broken))


def test_dir_shows_what_is_public():
    assert dir(bc) == sorted(["__version__", *bc.__all__])


@pytest.fixture(scope="module")
def zerobot():
    return bc.load_robot("zerobot"), bc.load_scene("ct_gantry")


@pytest.fixture(scope="module")
def arm():
    """The example's arm beside its patient, in its gantry."""
    robot = bc.load_robot(
        EXAMPLES / "arm.urdf",
        base="550mm,0,-350mm,0,0,180deg",
        needle="needle_link",
        tip="needle_tip:z",
    )
    torso = f"{EXAMPLES / 'torso.stl'}:mm@0,0,-0.1"
    return robot, bc.load_scene(f"{EXAMPLES / 'gantry.stl'}:mm", patients=[torso])


class Row(dict):
    """A row of a table: by name, and iterated over it gives values, as pandas does."""

    def __iter__(self):
        return iter(self.values())


class Table:
    """As pandas: iterated over it gives names of columns, rows by `iterrows`."""

    def __init__(self, rows):
        self.rows = rows

    def __iter__(self):
        return iter(self.rows[0].keys())

    def iterrows(self):
        return enumerate(map(Row, self.rows))


def test_a_configuration_in_any_form_gives_the_same_verdict(zerobot):
    robot, scene = zerobot
    named = dict(zip(robot.model.joint_names, robot.home, strict=True))
    told = [
        bc.check(robot, scene, q) for q in (robot.home, "home", named, list(robot.home))
    ]
    assert len({(v.verdict, v.q, v.clearance_m) for v in told}) == 1
    table = bc.first_contacts(robot, scene, Table([named, named]))
    several = bc.first_contacts(robot, scene, ["home", named])
    assert table.tolist() == several.tolist() == [told[0].contact] * 2


def test_a_margin_with_its_unit_is_the_same_margin(zerobot):
    told = [bc.check(*zerobot, "home", margin=m) for m in ("20mm", 0.02)]
    assert told[0].margin_m == told[1].margin_m == 0.02
    assert told[0].verdict == told[1].verdict


def test_a_base_as_text_is_that_transform():
    text = bc.load_robot(ROBOT, base="100mm,0,0,0,0,90deg").T_scene_root
    given = np.eye(4)
    given[:3] = [[0, -1, 0, 0.1], [1, 0, 0, 0], [0, 0, 1, 0]]
    assert np.allclose(text, given, atol=1e-15)


def test_forward_and_inverse_kinematics_agree(zerobot):
    robot, _ = zerobot
    needle = robot.needle_with_tip()
    T = bc.fk(robot, "home")[needle.tip]
    found = bc.inverse(robot, T[:3, 3], T[:3, :3] @ needle.axis)
    assert found.configurations
    for q in found.configurations:
        assert np.allclose(bc.fk(robot, q)[needle.tip][:3, 3], T[:3, 3], atol=1e-9)


def test_random_configurations_are_the_seeds(zerobot):
    robot, _ = zerobot
    first, again = (bc.random_configurations(robot, 5, seed=3) for _ in range(2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, bc.random_configurations(robot, 5, seed=4))
    assert not robot.model.beyond_limits(first).any()


def test_plans_give_what_the_command_gives(zerobot, capsys, tmp_path):
    from borecheck.cli import main

    whole = PROJECT / "urdf" / "zerobot" / "examples" / "plans.csv"
    file = tmp_path / "plans.csv"
    head, first = whole.read_text().splitlines()[:2]
    file.write_text(f"{head}\n{first}\nfar,0,0,2.0,0,0,1.9\n")
    answers = bc.check_plans(*zerobot, file, samples=3)
    words = ("check", "zerobot", "ct_gantry", "--plan", str(file), "--samples", "3")
    main([*words, "--format", "json"])
    plans = json.loads(capsys.readouterr().out)["plans"]
    told = [(a.plan.name, a.verdict, a.reason, a.reachable) for a in answers]
    assert [tuple(p[k] for k in KEYS) for p in plans] == told
    assert all("\n" not in repr(answer) for answer in answers)


KEYS = ("name", "verdict", "reason", "reachable")


def test_show_and_report_write_pages(zerobot, tmp_path):
    verdict = bc.show(*zerobot, "home", tmp_path / "pose.html")
    assert verdict.verdict in (tmp_path / "pose.html").read_text().lower()
    again = bc.report(tmp_path / "pose.html", tmp_path / "again.html")
    assert again.read_text() == (tmp_path / "pose.html").read_text()


def test_every_object_is_one_short_line(zerobot):
    robot, scene = zerobot
    mesh = robot.parts[0].mesh
    tree = bc.MeshTree.of(mesh)
    verdict = bc.check(robot, scene, "home")
    for thing in (robot, scene, tree, bc.Pair(tree, tree), verdict, verdict.itself):
        assert "\n" not in repr(thing)
        assert len(repr(thing)) < 200
    assert repr(verdict).startswith(f"<Verdict {verdict.verdict}: ")


def test_what_calls_give_is_one_line_that_says_what_was_found(zerobot, tmp_path):
    robot, scene = zerobot
    compared = bc.compare(robot, scene, [robot.home], checkers=["exact", "two-sided"])
    plan = bc.NeedlePlan("a", [0, 0, 0.1], [0, 0, -0.00002])
    needle = robot.needle_with_tip()
    T = bc.fk(robot, "home")[needle.tip]
    gone = bc.verify(tmp_path / "gone\x1b[2J.json")
    odd = replace(gone, problems=("\x1b[2J\nACCEPTED",))
    corridor = Corridor(plan.entry, plan.target, 6e-4)
    (finding, *_) = bc.validate(ROBOT)
    told = [
        (compared, "<Comparison: poses 1, in contact by exact 0, two-sided 0; 0 tri"),
        (plan, "<NeedlePlan a: (0, 0, 100) to (0, 0, 0) mm>"),
        (
            gone,
            f"<Verification rejected: {tmp_path / 'gone?[2J.json'} cannot be read: ",
        ),
        (odd, "<Verification rejected: ?[2J?ACCEPTED>"),
        (corridor, "<Corridor (0, 0, 100) to (0, 0, 0) mm, 0.6 mm round"),
        (bc.check_path(robot, scene, [robot.home]), "<PathVerdict clear: "),
        (finding, f"<Finding {finding.code} {finding.severity.value}, "),
    ]
    found = bc.inverse(robot, T[:3, 3], T[:3, :3] @ needle.axis)
    assert repr(found).startswith(f"<Solutions: {len(found.configurations)} within")
    for thing, begins in told:
        assert repr(thing).startswith(begins)
        assert repr(thing).isprintable()
    with pytest.raises(bc.BorecheckError, match="result is a PathVerdict: give a"):
        bc.report(bc.check_path(robot, scene, [robot.home]), tmp_path / "page.html")


def test_a_verdict_in_a_notebook_shows_the_robot(arm, tmp_path):
    """The picture is drawn when asked for, and goes nowhere else."""
    robot, scene = arm
    plan = NeedlePlan("a", (0, 0, 0), (0, 0, -0.06))
    (answer,) = bc.check_plans(robot, scene, plan, samples=3)
    path = bc.check_path(robot, scene, answer.motion.waypoints[:1], clearance=False)
    pose = bc.check(robot, scene, answer.motion.waypoints[0])
    for thing in (answer, path, pose):
        card = thing._repr_html_()
        assert card.count("<svg") == card.count("data:image/png;base64,") == 1
        assert "CLEAR" in card
    assert 'class="plan"' in answer._repr_html_()  # its line
    assert pickle.loads(pickle.dumps(pose)) == pose
    assert "_draw" not in pose.to_json()
    assert "<svg" not in replace(pose, reason="another")._repr_html_()


def test_a_certificate_is_written_from_python(arm, tmp_path):
    robot, scene = arm
    plan = NeedlePlan("a", (0, 0, 0), (0, 0, -0.06))
    written = bc.certify(robot, scene, plan, tmp_path / "a.json", margin="5mm")
    found = bc.verify(written, robot, scene, plans=plan, margin="5mm")
    assert found.accepted, found.problems
    start = np.radians([20, -120, 135, 0, 10, 0])
    way = bc.route(robot, scene, start, plan, margin="5mm")
    assert way.found, way
    np.testing.assert_allclose(way.waypoints[0], start)
    # 50 mm before the entry, where a plan's own motion begins
    tip = bc.fk(robot, way.waypoints[-1])["needle_tip"]
    np.testing.assert_allclose(
        tip[:3, 3], plan.entry - 0.05 * plan.direction, atol=1e-9
    )
    written = bc.certify(robot, scene, way.waypoints, tmp_path / "b.json")
    assert bc.verify(written, robot, scene, waypoints=way.waypoints).accepted
    corridor = Corridor(plan.entry, plan.target, 6e-4)
    wrong = [
        ((plan, "c.csv"), {}, "name it .json"),
        ((plan, "c.json"), {"corridor": corridor}, "a plan has its own corridor"),
        (([robot.home], "c.json"), {}, "there is no certificate to write"),
    ]
    for (motion, name), more, saying in wrong:
        with pytest.raises(bc.BorecheckError, match=saying):
            bc.certify(robot, scene, motion, tmp_path / name, **more)
        assert not (tmp_path / name).exists()


def test_degrees_of_a_continuous_joint_are_told(tmp_path, arm):
    text = (EXAMPLES / "arm.urdf").read_text()
    file = tmp_path / "arm.urdf"
    file.write_text(text.replace('type="revolute"', 'type="continuous"', 1))
    robot = bc.load_robot(file)
    with pytest.warns(UserWarning, match="more than a turn"):
        bc.check(robot, arm[1], [20, 0, 0, 0, 0, 0])


def test_a_card_escapes_what_files_are_called(zerobot):
    robot, scene = zerobot
    named = replace(robot, name="<script>")
    assert "<script>" not in named._repr_html_()
    assert "&lt;script&gt;" in named._repr_html_()
    verdict = replace(bc.check(robot, scene, "home"), reason="<b>x")
    assert "&lt;b&gt;x" in verdict._repr_html_()
    assert verdict.verdict.upper() in verdict._repr_html_()
