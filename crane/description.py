"""CRANE as data: files, arguments, and the bridge to the paper's notation."""

from borecheck.plugin import Argument, JointMap, RobotDescription
from borecheck_models import data_folder

_FOLDER = data_folder("crane")

DESCRIPTION = RobotDescription(
    name="crane",
    title="CRANE, redundant in-bore needle robot (eight axes, insertion among them)",
    xacro=_FOLDER / "crane.urdf.xacro",
    arguments={
        "base_x": Argument(
            "-0.45",
            "pitch axis at q3 = 0 from the isocentre, along the bore; assumed",
            quantity="length",
        ),
        "base_y": Argument("0", "likewise, across; assumed", quantity="length"),
        "base_z": Argument("0", "likewise, up; assumed", quantity="length"),
        "base_yaw": Argument(
            "0",
            "of the base; at 0 the arm reaches in along +x; assumed",
            quantity="angle",
        ),
        "stand": Argument(
            "floor",
            "what the portal of the stages stands on, 'Floor/Couch' of Table I",
            choices=("floor", "couch"),
            shapes=True,
        ),
        "needle_length": Argument(
            "0.15",
            "of the whole needle, before and behind the guide; assumed",
            quantity="length",
            shapes=True,
        ),
        "needle_ahead": Argument(
            "0.05",
            "how far ahead of frame 8 the clutch grips the needle; assumed",
            quantity="length",
            shapes=True,
        ),
    },
    meshes="crane.meshes:build",
    shipped=_FOLDER / "meshes" / "coarse",
    not_modelled=(
        "the real robot's outline (published in photographs only)",
        "cables outside of the tube, drapes, the tracker and its mount",
        "bending of the tube and of the needle, stretch of the cables",
        "the second clutch's grip: a plan drives the needle by one stroke of q8",
    ),
    source="CRANE",
    home={
        **{"q1": 0.0, "q2": 0.2, "q3": 0.0, "q4": 0.0, "q5": 0.0, "q6": 0.0},
        **{"q7": 0.5235987755982988, "q8": 0.0},
    },
    scanner="ct_gantry",
    needle_link="needle",
    needle_radius=0.915e-3,  # 15 gauge, section VI-B2
    tool_frame="needle_tip",
    base_frame="I",
    allowed_contacts=(),
    joints=tuple(
        JointMap(f"q{i}", source="[CRANE] Table IV: the joint's own variable")
        for i in range(1, 9)
    ),
    frames={
        name: name
        for name in (
            *("I", "W", *"012345678", "needle_tip"),
            *("portal", "trolley", "mast", "slide", "tube"),
            *("back", "mid", "tip", "carriage", "needle"),
        )
    },
    forward="crane.kinematics:forward",
    inverse="crane.kinematics:inverse",
    dimensions="crane.kinematics:dimensions",
    family="crane.family:family",
    closed_form_arguments=("base_x", "base_y", "base_z", "base_yaw", "needle_ahead"),
    insertion_joint="q8",
)
