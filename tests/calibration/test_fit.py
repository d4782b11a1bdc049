"""Simulated arms are found again; what cannot be found is refused with one line."""

from importlib.metadata import files
from pathlib import Path

import numpy as np
import pytest

from borecheck.calibration.axes_motion import Lines, jacobian, joint_jacobian, positions
from borecheck.calibration.axis_by_axis import estimate
from borecheck.calibration.corrected_urdf import corrected_urdf
from borecheck.calibration.measurements import (
    Measurements,
    find_moving,
    read_measurements,
    write_measurements,
)
from borecheck.calibration.observability import design, observe
from borecheck.calibration.refinement import parameter_jacobian, refine
from borecheck.calibration.sample_sets import base_points, split
from borecheck.calibration.sensors import LaserTracker
from borecheck.calibration.serial_arm import serial_arm
from borecheck.calibration.setup import CalibrationSetup
from borecheck.calibration.simulate import simulate
from borecheck.errors import BorecheckError, GeometryError, InputError, UsageError
from borecheck.robots.model import RobotModel
from borecheck.robots.urdf.parse import parse
from tests.places import DATA

CALIBRATION = DATA / "calibration"
SKEW = CALIBRATION / "skew_arm.urdf"

EXACT = 1e-12  # the figure for noise-free data
ROUNDING = 1e-13

SETUP = CalibrationSetup(
    target=(0.06, 0.15, -0.08), sensors={"laser": {"": LaserTracker()}}
)


def stranger(name):
    """A URDF of the package example-robot-data."""
    for file in files("example-robot-data") or ():
        if file.name == name:
            return Path(str(file.locate()))
    pytest.skip(f"example-robot-data has no {name}")


def robot(path):
    text = path.read_text()
    tree = parse(text, path.name)
    return text, tree, serial_arm(tree)


def arms():
    return [SKEW, stranger("ur5_robot.urdf"), stranger("panda.urdf")]


def simulated(arm, noise="none", seed=0, samples=21):
    return simulate(arm, SETUP, samples, noise, np.random.default_rng(seed))


def test_positions_are_those_of_the_engine():
    for path in arms():
        text, _, arm = robot(path)
        model = RobotModel(text, path.name)
        rng = np.random.default_rng(1)
        target = arm.T_world_tip @ np.array([0.1, 0.2, 0.3, 1.0])
        for q in arm.random(rng, 10):
            named = dict(zip(arm.joint_names, q, strict=True))
            T = model.placements(model.configuration(named))[arm.tip_link]
            found = positions(arm.lines, q, target[:3])[0]
            expected = (T @ np.array([0.1, 0.2, 0.3, 1.0]))[:3]
            np.testing.assert_allclose(found, expected, atol=ROUNDING)


def test_jacobians_against_differences():
    _, _, arm = robot(SKEW)
    rng = np.random.default_rng(2)
    q, target, step = arm.random(rng, 4), np.array([0.5, -0.3, 0.9]), 1e-6
    J = jacobian(arm.lines, q, target)
    k = len(arm.lines)
    for j in range(4 * k + 3):
        move = step * np.eye(4 * k + 3)[j]
        rate = [
            positions(arm.lines.moved(s * move[:-3]), q, target + s * move[-3:])
            for s in (1, -1)
        ]
        np.testing.assert_allclose(
            J[:, :, j], (rate[0] - rate[1]) / (2 * step), atol=1e-8
        )
    J = joint_jacobian(arm.lines, q, target)
    for j in range(k):
        move = step * np.eye(k)[j]
        ahead = positions(arm.lines, q + move, target)
        behind = positions(arm.lines, q - move, target)
        np.testing.assert_allclose(J[:, :, j], (ahead - behind) / (2 * step), atol=1e-8)


@pytest.mark.parametrize("start", ["points", "nominal"])
def test_noise_free_data_give_every_parameter(start):
    for path in arms():
        _, _, arm = robot(path)
        for seed in range(5):
            data, true = simulated(arm, seed=seed)
            deviation = max(
                abs(true.parameters[n] - arm.nominal[n]) for n in arm.forms.names
            )
            assert deviation > 1e-3  # there was something to find
            found = estimate(arm, data, start=start)
            for name in arm.forms.names:
                assert found.parameters[name] == pytest.approx(
                    true.parameters[name], abs=EXACT
                ), (path.name, name)
            np.testing.assert_allclose(found.target, true.target, atol=EXACT)
            assert found.iterations.max() <= 8


def test_refinement_gives_every_parameter_too():
    for path in arms():
        _, _, arm = robot(path)
        data, true = simulated(arm, seed=7)
        found = refine(arm, data)  # from the nominal arm
        for name in arm.forms.names:
            assert found.parameters[name] == pytest.approx(
                true.parameters[name], abs=EXACT
            ), (path.name, name)


def test_stated_uncertainty_is_the_scatter():
    """The mean of e' C^-1 e over its number of freedoms is 1."""
    _, _, arm = robot(SKEW)
    names = arm.forms.names
    refined_sizes, axes_sizes = [], []
    for seed in range(100, 130):
        data, true = simulated(arm, "laser", seed=seed)
        axes = estimate(arm, data)
        refined = refine(arm, data, axes.lines)
        for result, sizes in ((refined, refined_sizes), (axes, axes_sizes)):
            A = parameter_jacobian(arm, result.lines)
            C = A @ result.covariance[: A.shape[1], : A.shape[1]] @ A.T
            e = np.array([result.parameters[n] - true.parameters[n] for n in names])
            sizes.append(e @ np.linalg.solve(C, e) / len(names))
    # 30 arms of 20 freedoms scatter by 0.06; each axis knows its noise from 36 only
    assert np.mean(refined_sizes) == pytest.approx(1.0, abs=0.2)
    assert np.mean(axes_sizes) == pytest.approx(1.06, abs=0.25)


def test_refinement_is_better_at_poses_not_used():
    _, _, arm = robot(SKEW)
    axes_error, refined_error = [], []
    for seed in range(10):
        data, true = simulated(arm, "laser", seed=seed)
        axes = estimate(arm, data)
        refined = refine(arm, data, axes.lines)
        q = arm.random(np.random.default_rng(seed + 99), 50)
        truth = positions(true.lines, q, true.target)
        for found, errors in ((axes, axes_error), (refined, refined_error)):
            off = positions(found.lines, q, found.target) - truth
            errors.append(np.sqrt((off**2).sum(axis=1).mean()))
    assert np.mean(refined_error) < np.mean(axes_error)


def test_outliers_are_left_out_or_trusted_less():
    _, _, arm = robot(SKEW)
    data, true = simulated(arm, "laser", seed=3)
    points = data.points.copy()
    wrong = [2, 30, 50, 77, 100]
    points[wrong] += 0.02
    spoiled = Measurements(data.q, points, data.moving)
    plain = refine(arm, spoiled, estimate(arm, spoiled).lines)
    robust_axes = estimate(arm, spoiled, robust=True)
    robust = refine(arm, spoiled, robust_axes.lines, loss="cauchy")
    assert set(wrong) <= set(robust_axes.outliers)

    def error(result):
        return max(
            abs(result.parameters[n] - true.parameters[n]) for n in arm.forms.names
        )

    assert error(plain) > 1e-3
    clean = estimate(arm, data)
    assert error(robust_axes) < 2.0 * error(clean)
    assert error(robust) < 2.0 * error(refine(arm, data, clean.lines))


def test_corrected_urdf_moves_as_the_true_arm():
    for path in arms():
        text, tree, arm = robot(path)
        data, true = simulated(arm, seed=4)
        corrected = corrected_urdf(text, tree, arm, estimate(arm, data).lines)
        model = RobotModel(corrected, "corrected")
        assert model.joint_names == RobotModel(text, "nominal").joint_names
        again = serial_arm(parse(corrected, "corrected"))
        for name in arm.forms.names:
            assert arm.parameters(again.lines)[name] == pytest.approx(
                true.parameters[name], abs=1e-11
            )
        # a point of the hand moves alike: at zero it is where the joint frames are
        local = np.linalg.inv(again.T_world_tip) @ np.append(true.target, 1.0)
        for q in arm.random(np.random.default_rng(5), 5):
            named = dict(zip(arm.joint_names, q, strict=True))
            T = model.placements(model.configuration(named))[arm.tip_link]
            expected = positions(true.lines, q, true.target)[0]
            np.testing.assert_allclose((T @ local)[:3], expected, atol=1e-11)


def test_csv_gives_the_data_back(tmp_path):
    _, _, arm = robot(SKEW)
    data, _ = simulated(arm, "laser")
    write_measurements(tmp_path / "data.csv", arm, data)
    again = read_measurements(tmp_path / "data.csv", arm)
    np.testing.assert_array_equal(again.q, data.q)
    np.testing.assert_array_equal(again.points, data.points)
    assert again.moving == data.moving


def test_moving_joint_is_told_from_the_values():
    _, _, arm = robot(SKEW)
    data, _ = simulated(arm)
    alone = np.vstack([data.q, arm.random(np.random.default_rng(0), 5)])
    assert find_moving(alone, arm.joint_names) == (*data.moving, *[""] * 5)


def test_units_are_in_the_names(tmp_path):
    _, _, arm = robot(SKEW)
    data, _ = simulated(arm)
    names = [f"{n}_deg" for n in arm.joint_names] + ["x_mm", "y_cm", "z_m"]
    table = np.hstack([np.degrees(data.q), data.points * [1e3, 1e2, 1.0]])
    rows = [",".join(names)] + [",".join(map(repr, map(float, r))) for r in table]
    (tmp_path / "data.csv").write_text("\n".join(rows))
    again = read_measurements(tmp_path / "data.csv", arm)
    np.testing.assert_allclose(again.q, data.q, atol=1e-15)
    np.testing.assert_allclose(again.points, data.points, atol=1e-15)
    assert again.moving == data.moving


HEADER = "turn,lift,fold,roll,tip,x,y,z"
ROW = "0,1,0,0,0,0.1,0.2,0.3"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        (HEADER, "no measurement"),
        (f"{ROW}\n{ROW}", "its columns have no names; the first line must be turn,"),
        (f"{HEADER},speed\n{ROW},1", "unknown column 'speed'"),
        (f"turn,turn_deg,lift,fold,roll,tip,x,y,z\n0,{ROW}", "'turn' is there twice"),
        (f"{HEADER}\n{ROW}".replace(",", ";"), "separated by commas, not semicolons"),
        (f"turn_deg,{HEADER[5:]}\n{ROW}", "turn_deg says its unit and lift does not"),
        (f"turn_mm,{HEADER[5:]}\n{ROW}", "'mm' is no unit of turn"),
        ("turn,lift,x,y,z\n0,1,0,0,0", "column fold, roll, tip is missing"),
        (f"{HEADER}\n0,1,0,0,0,nan,0.2,0.3", "line 2, column x: 'nan' is no finite"),
        (f"{HEADER}\n0,1,0,0,0,0.1,here,0.3", "'here' is no finite number"),
        (f"{HEADER}\n{ROW},5", "line 2: 9 cells, but the header has 8"),
        (f"{HEADER}\n40{ROW}", "if these are degrees, name the column turn_deg"),
        (f"{HEADER}\n{ROW}\n0,1,0,0,0,500,200,300", "if these are millimetres"),
        (f"{HEADER},moving\n{ROW},arm", "unknown joint 'arm'"),
        (f"{HEADER},drive\n{ROW},0.05", "prismatic joint drive must stand at 0.0 m"),
    ],
)
def test_files_that_mean_nothing_are_refused(tmp_path, text, words):
    _, _, arm = robot(SKEW)
    (tmp_path / "bad.csv").write_text(text)
    with pytest.raises(InputError) as caught:
        read_measurements(tmp_path / "bad.csv", arm)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def spoiled(arm, change):
    data, _ = simulated(arm, "laser")
    q, points, moving = data.q.copy(), data.points.copy(), list(data.moving)
    change(q, points, moving)
    return Measurements(q, points, tuple(moving))


def test_data_that_fix_no_axis_are_refused():
    _, _, arm = robot(SKEW)
    data, _ = simulated(arm, "laser")
    fold = data.of("fold")

    def too_few(q, points, moving):
        for i in fold[2:]:
            moving[i] = ""

    def one_place(q, points, moving):
        points[fold] = points[fold[0]]

    def straight(q, points, moving):
        share = np.linspace(0, 1, len(fold))[:, None]
        points[fold] = share * points[fold[0]] + (1 - share) * points[fold[-1]]

    def reversed_encoder(q, points, moving):
        q[fold, 2] *= -1

    def others_move(q, points, moving):
        q[fold, 4] = np.linspace(0, 1, len(fold))

    for change, words in (
        (too_few, "joint fold: 2 samples in which it turned alone"),
        (one_place, "joint fold: the points are all in one place"),
        (straight, "joint fold: the points lie on a straight line"),
        (reversed_encoder, "joint fold: turns the other way round"),
        (others_move, "joint fold: joints below it did not stand still"),
    ):
        with pytest.raises(GeometryError) as caught:
            estimate(arm, spoiled(arm, change))
        assert words in str(caught.value)


def test_an_arc_too_short_for_its_noise_is_refused():
    _, _, arm = robot(SKEW)
    data, true = simulated(arm)
    fold = data.of("fold")
    q = data.q.copy()
    q[fold, 2] = np.linspace(0, np.radians(0.5), len(fold))
    exact = positions(true.lines, q, true.target)
    found = estimate(arm, Measurements(q, exact, data.moving))
    assert found.parameters["d2"] == pytest.approx(true.parameters["d2"], abs=1e-6)
    noise = LaserTracker().measure(exact, np.random.default_rng(0))
    with pytest.raises(GeometryError, match=r"arc of 0\.5 deg is too short for"):
        estimate(arm, Measurements(q, noise, data.moving))


def test_what_samples_do_not_show_is_named():
    _, _, arm = robot(SKEW)
    data, _ = simulated(arm, "laser")
    without_tip = np.flatnonzero(np.array(data.moving) != "tip")
    q = data.q[without_tip].copy()
    q[:, 4] = 0.2
    part = Measurements(q, data.points[without_tip], ("",) * len(q))
    with pytest.raises(GeometryError, match=r"ill-conditioned: .* do not show .*4"):
        refine(arm, part)
    with pytest.raises(GeometryError, match="9 equations for 23 unknowns"):
        refine(arm, Measurements(data.q[:3], data.points[:3], data.moving[:3]))


def test_chosen_samples_are_better_than_as_many_random_ones():
    _, _, arm = robot(SKEW)
    rng = np.random.default_rng(6)
    target = np.array([0.9, 0.1, 0.8])
    candidates, poses = arm.random(rng, 200), arm.random(rng, 30)
    chosen = design(arm, candidates, 15, target, poses)
    assert len(set(chosen)) == 15
    random = observe(arm, candidates[:15], target, 1e-4, poses)
    better = observe(arm, candidates[chosen], target, 1e-4, poses)
    assert better.tip_sigma < 0.8 * random.tip_sigma
    still = candidates.copy()
    still[:, 3] = 0.0
    blind = observe(arm, still, target, 1e-4, poses)
    assert blind.condition == np.inf
    assert blind.unseen


def test_base_points_keep_within_the_limits():
    np.testing.assert_allclose(
        np.degrees(base_points(-3, 3, 0.1)), [-120, 0, 120], atol=1e-9
    )
    np.testing.assert_allclose(base_points(-0.35, 0.35, 0.05), [-0.3, 0, 0.3])
    assert split(98) == [33, 33, 32]
    assert split(182) == [61, 61, 60]


def test_arms_that_cannot_be_told_are_refused():
    tree = parse(SKEW.read_text(), "skew")
    with pytest.raises(BorecheckError, match="unknown link 'nose'"):
        serial_arm(tree, tip="nose")
    with pytest.raises(UsageError, match="no revolute joint between floor and table"):
        serial_arm(tree, tip="table")
    with pytest.raises(UsageError, match="not reached"):
        serial_arm(tree, world="finger", tip="floor")
    assert serial_arm(tree, tip="lamp").joint_names == ("turn", "lamp_turn")


def test_lines_near_a_place_are_the_same_lines():
    lines = Lines(np.array([[0.0, 0, 0]]), np.array([[0.0, 0, 1]]))
    np.testing.assert_allclose(lines.near([1, 2, 3]).points, [[0, 0, 3]])
