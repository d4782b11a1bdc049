"""Zerobot as data: files, arguments, and the bridge to the paper's notation."""

from borecheck.plugin import Argument, JointMap, RobotDescription
from borecheck_models import data_folder

_FOLDER = data_folder("zerobot")

DESCRIPTION = RobotDescription(
    name="zerobot",
    title="Zerobot, CT-guided needle robot (five axes and insertion)",
    xacro=_FOLDER / "zerobot.urdf.xacro",
    arguments={
        "mount": Argument(
            "+90",
            "alpha_3 of Table 1 [deg]: reaches in along +x, or along -x with -90",
            choices=("+90", "-90"),
        ),
        "needle_length": Argument(
            "0.12",
            "l_E, from needle holder to tip; assumed",
            quantity="length",
            shapes=True,
        ),
        "level_parts": Argument(
            "parallelogram",
            "how the level rods are placed; frame4 is the paper's literal reading",
            choices=("parallelogram", "frame4"),
        ),
        **{
            f"tip_offset_{axis}": Argument(
                "0",
                f"calibrated shift of the tip along {axis} of frame 6",
                quantity="length",
            )
            for axis in "xyz"
        },
        **{
            f"q{i}_offset": Argument(
                "0",
                f"calibrated zero of joint q{i}",
                quantity="angle" if i in (4, 5) else "length",
            )
            for i in range(1, 7)
        },
    },
    meshes="zerobot.meshes:build",
    shipped=_FOLDER / "meshes" / "coarse",
    not_modelled=(
        "the real robot's outline (its STL data are not published)",
        "cables and drapes",
        "bending of the long beams and of the needle",
        "bearing pins between rods, crank and needle holder",
    ),
    source="Matsuno2020",
    home={"q1": 0.03, "q2": 0.0, "q3": 0.0, "q4": 0.0, "q5": 0.0, "q6": 0.0},
    scanner="ct_gantry",
    needle_link="needle",
    needle_radius=0.00055,  # [Matsuno2020] section 4.3: diameter about 1.1 mm
    tool_frame="E",
    base_frame="W",
    allowed_contacts=(
        ("arm", "crank", "the crank's shaft turns in the arm's drive box"),
        ("arm", "holder", "the holder's pins turn in the arm's fork"),
        ("carriage", "needle", "the needle sits in the carriage's clamp"),
    ),
    joints=tuple(
        JointMap(f"q{i}", source="[Matsuno2020] Table 1: the joint's own variable")
        for i in range(1, 7)
    ),
    # the paper's frames, then the bodies: the closed form (zerobot/bodies.py) has both
    frames={
        name: name
        for name in (
            *("W", "0", "1", "2", "3", "4", "5", "6", "E"),
            *("base", "lift", "slide", "cross", "arm", "holder", "carriage", "needle"),
            *("crank", "rod_a", "loop_a_rod", "loop_a_holder"),
            *("rod_b", "loop_b_rod", "loop_b_holder"),
        )
    },
    forward="zerobot.kinematics:forward",
    inverse="zerobot.kinematics:inverse",
    dimensions="zerobot.kinematics:dimensions",
    about_target="zerobot.directions:about_target",
    closed_form_arguments=(
        "mount",
        "needle_length",
        "level_parts",
        *(f"tip_offset_{axis}" for axis in "xyz"),
        *(f"q{i}_offset" for i in range(1, 7)),
    ),
    insertion_joint="q6",
)
