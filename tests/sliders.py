"""A robot of blocks that slide along x, each on its own: any two can meet."""

BOX = '<box size="0.1 0.1 0.1"/>'
BALL = '<sphere radius="0.05"/>'


def sliders(names="abcd", shapes=None):
    """The URDF: blocks a, b, ... 0.1 m wide, at x of their joint `to_NAME`."""
    links = "".join(
        f'<link name="{n}"><collision><geometry>{(shapes or {}).get(n, BOX)}'
        "</geometry></collision></link>"
        for n in names
    )
    joints = "".join(
        f'<joint name="to_{n}" type="prismatic"><parent link="rail"/>'
        f'<child link="{n}"/><axis xyz="1 0 0"/>'
        '<limit lower="-9" upper="9" effort="1" velocity="1"/></joint>'
        for n in names
    )
    return f'<robot name="sliders"><link name="rail"/>{links}{joints}</robot>'


def spread(names="abcd", **at):
    """A configuration in which no blocks meet, but for those told where to be."""
    return [at.get(name, float(k)) for k, name in enumerate(names)]


def srdf(*elements):
    """An SRDF of these elements, the first one in line 2."""
    return '<robot name="sliders">\n' + "\n".join(elements) + "\n</robot>\n"


def pair(first, second, reason=None):
    """A `disable_collisions`."""
    more = "" if reason is None else f' reason="{reason}"'
    return f'<disable_collisions link1="{first}" link2="{second}"{more}/>'
