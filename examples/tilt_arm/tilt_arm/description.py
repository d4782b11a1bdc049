"""The tilt arm and its tube as data."""

from pathlib import Path

from borecheck.plugin import Argument, JointMap, RobotDescription, ScannerDescription

HERE = Path(__file__).parent

ROBOT = RobotDescription(
    name="tilt_arm",
    title="Tilt arm: two slides, a tilt, an insertion (made up)",
    xacro=HERE / "tilt_arm.urdf.xacro",
    not_modelled=("cables",),
    source="made up for this example",
    home={"x": 0.0, "z": 0.05, "tilt": 0.0, "insertion": 0.0},
    scanner="tube",
    needle_link="needle",
    needle_radius=0.0005,
    tool_frame="needle",
    base_frame="scanner",
    joints=tuple(
        JointMap(name, source="made up: the closed form's own variable")
        for name in ("x", "z", "tilt", "insertion")
    ),
    frames={"base": "base", "tilt": "tilt_link", "tip": "needle"},
    forward="tilt_arm.kinematics:forward",
    inverse="tilt_arm.kinematics:inverse",
    dimensions="tilt_arm.kinematics:dimensions",
    insertion_joint="insertion",
)

SCANNER = ScannerDescription(
    name="tube",
    title="Four slabs and a block (made up)",
    xacro=HERE / "tube.urdf.xacro",
    arguments={
        "width": Argument("0.9", "between left and right; made up", quantity="length")
    },
    not_modelled=("everything but five boxes",),
    source="made up for this example",
    roles={
        "top": "scanner",
        "left": "scanner",
        "right": "scanner",
        "table": "couch",
        "torso": "patient",
    },
)
