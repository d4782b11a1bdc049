"""The blind comparator, its samples, the third source, and that all of it can fail."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from borecheck.core.se3 import transform
from borecheck.errors import GeometryError, UnknownNameError, UsageError
from borecheck.robots.description import JointMap, RobotDescription
from borecheck.robots.kinematics import sources
from borecheck.robots.kinematics.agreement import Tolerances, differences, disagreements
from borecheck.robots.kinematics.configurations import sample_configurations
from borecheck.robots.kinematics.cross_check import cross_check, to_json
from borecheck.robots.kinematics.perturbation import changed_urdfs, unseen_perturbations
from borecheck.robots.model import RobotModel
from borecheck.robots.robot import load_robot

LENGTH = 0.4


def joint(name: str, kind: str, parent: str, child: str, body: str) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/>'
        f'<child link="{child}"/>{body}</joint>'
    )


LIMIT = '<limit lower="-0.5" upper="0.7" effort="1" velocity="1"/>'
# A slide and a hinge, a rod that mimics the hinge to stay level, and a lonely plate.
URDF = (
    '<robot name="two">'
    + "".join(f'<link name="{n}"/>' for n in ("W", "slide", "arm", "rod", "plate"))
    + joint("s", "prismatic", "W", "slide", f'<axis xyz="0 0 1"/>{LIMIT}')
    + joint("h", "revolute", "slide", "arm", f'<axis xyz="0 1 0"/>{LIMIT}')
    + joint(
        "r",
        "revolute",
        "arm",
        "rod",
        f'<origin xyz="{LENGTH} 0 0"/><axis xyz="0 1 0"/>'
        '<mimic joint="h" multiplier="-1"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/>',
    )
    + joint("p", "fixed", "W", "plate", '<origin xyz="1 0 0"/>')
    + "</robot>"
)


def forward(
    q: np.ndarray,
    *,
    perturbed: Mapping[str, float] | None = None,
    **arguments: str,
) -> dict[str, np.ndarray]:
    """The closed form of URDF; hinge angle in the opposite sense."""
    d = {"length": LENGTH, "spare": 0.0}
    for name, by in (perturbed or {}).items():
        d[name] += by
    z, angle = q[0], -q[1]
    arm = transform([0, 0, z], [0, angle, 0])
    x, drop = math.cos(angle) * d["length"], -math.sin(angle) * d["length"]
    return {"W": np.eye(4), "A": arm, "R": transform([x, 0, z + drop])}


def dimensions(**arguments: str) -> dict[str, float]:
    return {"length": LENGTH, "spare": 0.0}


@dataclass
class Robot:
    """As the loader's robot, as far as the cross-check sees it."""

    description: RobotDescription | None
    urdf_text: str = URDF
    arguments: Mapping[str, str] = field(default_factory=dict)

    @property
    def model(self) -> RobotModel:
        return RobotModel(self.urdf_text)


def described(**changes: object) -> RobotDescription:
    values: dict[str, object] = {
        "name": "two",
        "title": "a test robot",
        "xacro": Path("two.urdf"),
        "arguments": {},
        "meshes": "",
        "shipped": Path(),
        "not_modelled": (),
        "source": "",
        "base_frame": "W",
        "joints": (JointMap("s"), JointMap("h", -1.0)),
        "frames": {"W": "W", "A": "arm", "R": "rod"},
        "forward": f"{__name__}:forward",
        "dimensions": f"{__name__}:dimensions",
    }
    return RobotDescription(**(values | changes))  # type: ignore[arg-type]


@pytest.fixture(autouse=True)
def hooks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tests are imported by path: their hooks are looked up here."""
    functions = {"forward": forward, "dimensions": dimensions}
    by_name = lambda text: functions[text.partition(":")[2]]  # noqa: E731
    for module in ("sources", "cross_check", "perturbation"):
        monkeypatch.setattr(f"borecheck.robots.kinematics.{module}.hook", by_name)


@pytest.fixture
def qs() -> np.ndarray:
    return sample_configurations(RobotModel(URDF), np.random.default_rng(0), 20)


def test_three_sources_agree(qs: np.ndarray) -> None:
    result = cross_check(Robot(described()), qs)
    assert result.disagreements == ()
    assert result.position_m < 1e-14
    assert result.rotation_rad < 1e-14
    assert set(result.worst) == {
        ("analytic", "pinocchio"),
        ("analytic", "yourdfpy"),
        ("pinocchio", "yourdfpy"),
    }
    assert result.moved_m > 1.0
    assert result.parameters["length"] == LENGTH


def test_a_wrong_bridge_is_a_disagreement(qs: np.ndarray) -> None:
    wrong = described(joints=(JointMap("s"), JointMap("h", 1.0)))
    result = cross_check(Robot(wrong), qs)
    frames = {(d.frame, d.rotation_rad > 0.1) for d in result.disagreements}
    assert ("A", True) in frames
    worst = result.worst["analytic", "pinocchio"]["A"]
    assert worst.rotation_rad == pytest.approx(2 * 0.7)  # at the corner, hinge 0.7
    assert abs(worst.q_rotation[1]) == 0.7
    # the engines still agree with each other
    engines = result.worst["pinocchio", "yourdfpy"]
    assert not any(d.exceeds(Tolerances()) for d in engines.values())


def test_offset_of_the_bridge_is_used(qs: np.ndarray) -> None:
    moved = described(joints=(JointMap("s", 1.0, 0.1), JointMap("h", -1.0)))
    result = cross_check(Robot(moved), qs)
    worst = result.worst["analytic", "pinocchio"]["A"]
    assert worst.position_m == pytest.approx(0.1)
    assert worst.rotation_rad < 1e-14


def test_robot_without_closed_form_has_two_sources(qs: np.ndarray) -> None:
    result = cross_check(Robot(None), qs)
    assert set(result.worst) == {("pinocchio", "yourdfpy")}
    assert set(result.frames) == {"W", "slide", "arm", "rod", "plate"}
    assert "analytic" in result.silent
    assert result.disagreements == ()


def test_json_has_the_contract_and_is_json(qs: np.ndarray) -> None:
    document = to_json(cross_check(Robot(described()), qs))
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert {"parameters", "frames", "worst"} <= set(document)
    assert set(document["frames"]["A"]) == {"analytic", "pinocchio", "yourdfpy"}
    assert set(document["worst"]) == {"position_m", "rotation_rad"}
    assert np.array(document["frames"]["A"]["analytic"]).shape == (4, 4)
    assert document["agree"] is True
    missing = to_json(cross_check(Robot(None), qs))
    assert missing["frames"]["arm"]["analytic"] is None


def test_every_number_is_seen_or_named(qs: np.ndarray) -> None:
    study = unseen_perturbations(Robot(described()), qs)
    unseen = {item.number: item.why for item in study.unseen}
    assert set(unseen) == {
        "spare",
        "s/axis xyz[2]",
        "h/axis xyz[1]",
        "r/axis xyz[1]",
        *(f"p/origin {a}[{i}]" for a in ("xyz", "rpy") for i in range(3)),
    }
    assert unseen["p/origin xyz[0]"].endswith("without a closed form: plate")
    assert "the same axis" in unseen["s/axis xyz[2]"]
    assert {"length", "r/mimic multiplier", "r/mimic offset"} <= set(study.seen)
    assert {f"{n}/axis reversed" for n in "shr"} <= set(study.seen)
    assert len(study.seen) > 25


def test_changed_urdfs_change_one_number_and_nothing_stays_behind() -> None:
    texts = dict(changed_urdfs(URDF, 0.5))
    assert len(set(texts.values())) == len(texts)
    assert texts["p/origin xyz[1]"].count("0.5") == URDF.count("0.5") + 1
    again = dict(changed_urdfs(URDF, 0.5))
    assert again == texts


def test_a_study_of_disagreeing_sources_is_refused(qs: np.ndarray) -> None:
    wrong = described(joints=(JointMap("s"), JointMap("h", 1.0)))
    with pytest.raises(UsageError, match="before any number"):
        unseen_perturbations(Robot(wrong), qs)
    with pytest.raises(UsageError, match="no closed form"):
        unseen_perturbations(Robot(None), qs)


def test_comparator_is_blind_and_finds_the_worst() -> None:
    def first(q: np.ndarray) -> dict[str, np.ndarray]:
        return {"a": transform([q[0], 0, 0]), "b": np.eye(4)}

    def second(q: np.ndarray) -> dict[str, np.ndarray]:
        return {"a": transform([0, 0, 0], [0, 0, 0.1 - q[0]]), "b": np.eye(4)}

    found = disagreements(first, second, [[0.0], [0.1], [-0.3]])
    assert [d.frame for d in found] == ["a"]
    assert found[0].position_m == pytest.approx(0.3)
    assert found[0].rotation_rad == pytest.approx(0.4)
    assert found[0].q_position == (-0.3,)
    loose = Tolerances(0.31, 0.41)
    assert disagreements(first, second, [[0.0], [-0.3]], loose) == []


def test_nan_is_a_disagreement_wherever_it_stands() -> None:
    def sound(q: np.ndarray) -> dict[str, np.ndarray]:
        return {"a": np.eye(4)}

    def ill(q: np.ndarray) -> dict[str, np.ndarray]:
        return {"a": np.eye(4) * (np.nan if q[0] == 1 else 1)}

    for order in ([[0.0], [1.0], [2.0]], [[1.0], [0.0]], [[0.0], [1.0]]):
        assert len(disagreements(sound, ill, order)) == 1


def test_nothing_to_compare_is_an_error() -> None:
    def frames(q: np.ndarray) -> dict[str, np.ndarray]:
        return {"a": np.eye(4)}

    with pytest.raises(UsageError, match="nothing was checked"):
        differences(frames, frames, [])
    with pytest.raises(UnknownNameError, match="'b'"):
        differences(frames, lambda q: {"a": np.eye(4), "b": np.eye(4)}, [[0.0]])


def test_a_sample_in_which_nothing_moves_is_an_error() -> None:
    robot = Robot(described())
    with pytest.raises(GeometryError, match="no frame moved"):
        cross_check(robot, np.zeros((3, 2)))
    assert cross_check(robot, np.zeros(2)).configurations == 1


def test_sample_holds_zero_corners_and_inner_points() -> None:
    model = RobotModel(URDF)
    sample = sample_configurations(model, np.random.default_rng(1), 30)
    assert sample.shape == (30, 2)
    assert (sample[0] == 0).all()
    corners = {tuple(q) for q in sample[1:5]}
    assert corners == {(a, b) for a in (-0.5, 0.7) for b in (-0.5, 0.7)}
    inner = (sample[5:] > model.lower) & (sample[5:] < model.upper)
    assert inner.all()
    with pytest.raises(UsageError, match="at least 1"):
        sample_configurations(model, np.random.default_rng(1), 0)


def test_unknown_names_in_the_bridge_are_named() -> None:
    with pytest.raises(UnknownNameError, match="'x'"):
        sources.analytic(Robot(described(joints=(JointMap("s"), JointMap("x")))))
    with pytest.raises(UnknownNameError, match="'lost'"):
        sources.pinocchio(Robot(described(frames={"W": "W", "A": "lost"})))
    with pytest.raises(UsageError, match="closed form has 1"):
        sources.analytic(Robot(described(joints=(JointMap("s"),))))


def test_base_frame_need_not_be_the_root() -> None:
    robot = Robot(described(base_frame="A"))
    said = sources.pinocchio(robot)(np.array([0.3, 0.2]))
    assert np.abs(said["A"] - np.eye(4)).max() < 1e-15
    third = sources.yourdfpy(robot)(np.array([0.3, 0.2]))
    assert np.abs(said["W"] - third["W"]).max() < 1e-15


@pytest.mark.parametrize("mount", ["+90", "-90"])
def test_zerobot_is_the_same_in_three_sources(
    mount: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.undo()  # the real hooks
    robot = load_robot("zerobot", mount=mount)
    sample = sample_configurations(robot.model, np.random.default_rng(2), 100)
    result = cross_check(robot, sample)
    assert result.disagreements == ()
    assert set(result.frames) == set(robot.model.link_names)
    assert result.moved_m > 0.5


def test_every_number_of_zerobot_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only the length of an axis vector, which no placement depends on, is not."""
    monkeypatch.undo()  # the real hooks
    robot = load_robot("zerobot", q5_offset="1deg", tip_offset_y="2mm")
    sample = robot.model.random_configurations(np.random.default_rng(3), 3)
    study = unseen_perturbations(robot, sample)
    along_axis = {
        f"{joint.name}/axis xyz[{int(np.argmax(np.abs(joint.axis)))}]"
        for joint in robot.model.tree.joints
        if joint.type != "fixed"
    }
    assert {item.number for item in study.unseen} == along_axis
    assert len(study.seen) > 200
