"""The MRI arm as data: files, arguments, and the bridge to the paper's notation."""

from borecheck.plugin import Argument, JointMap, RobotDescription
from borecheck_models import data_folder

_FOLDER = data_folder("mri_arm")

DESCRIPTION = RobotDescription(
    name="mri_arm",
    title="Arm for neurosurgery in an open magnet (six axes and insertion)",
    xacro=_FOLDER / "mri_arm.urdf.xacro",
    arguments={
        "base_x": Argument(
            "0",
            "axis 1 from the image centre, to the feet; assumed",
            quantity="length",
        ),
        "base_y": Argument(
            "-1.30",
            "axis 1 from the image centre, across; beyond 1 m (2 mT), assumed",
            quantity="length",
        ),
        "base_yaw": Argument(
            "0",
            "of the base; at 0 the forearm points along +y; assumed",
            quantity="angle",
        ),
        "needle_mount": Argument(
            "along",
            "of the needle on the flange: along axis 6 or square to it; assumed",
            choices=("along", "square"),
            shapes=True,
        ),
        "needle_length": Argument(
            "0.15",
            "from flange to tip, 'biopsy needle (150 mm)', section 4",
            quantity="length",
            shapes=True,
        ),
    },
    meshes="mri_arm.meshes:build",
    shipped=_FOLDER / "meshes" / "coarse",
    not_modelled=(
        "the real arm's outline (published in photographs only)",
        "nylon strings of joints 5 and 6, cables, drapes",
        "bending of the forearm and of the needle",
    ),
    source="Heikkila2010",
    home={
        **{"q1": 1.2, "q2": 0.0, "q3": 0.0, "q4": 0.0, "q5": 0.0, "q6": 0.0},
        "insertion": 0.0,
    },
    scanner="mri_open_magnet",
    needle_link="needle",
    needle_radius=1.05e-3,  # a 14 G biopsy needle is 2.1 mm thick, assumed
    tool_frame="E",
    base_frame="I",
    allowed_contacts=(),
    joints=(
        *(
            JointMap(f"q{i}", source="[Heikkila2010] section 4: zero as in Fig. 5")
            for i in range(1, 7)
        ),
        JointMap("insertion", source="[Heikkila2010] section 3: the optional axis"),
    ),
    frames={
        name: name
        for name in (
            *("I", "W", *"123456", "E"),
            *("base", "turret", "upper_arm", "elbow", "forearm", "wrist", "hand"),
            *("carriage", "needle"),
        )
    },
    forward="mri_arm.kinematics:forward",
    inverse="mri_arm.kinematics:inverse",
    dimensions="mri_arm.kinematics:dimensions",
    closed_form_arguments=(
        *("base_x", "base_y", "base_yaw"),
        *("needle_mount", "needle_length"),
    ),
    insertion_joint="insertion",
)
