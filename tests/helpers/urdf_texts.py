"""Small URDF files."""


def inertial(mass: float, centre: str = "0 0 0", inertia: str = "0.02 0.02 0.02") -> str:
    """A mass at a place, with its principal moments of inertia in the link's axes."""
    ixx, iyy, izz = inertia.split()
    return (
        f'<inertial><origin xyz="{centre}"/><mass value="{mass}"/><inertia ixx="{ixx}" iyy="{iyy}" '
        f'izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial>'
    )


BODY = inertial(2, "0.1 0 -0.2", "0.02 0.03 0.04")
INERTIA = BODY[BODY.index("<inertia ") : BODY.index("</inertial>")]


def robot(inside: str) -> str:
    return f'<robot name="leg">{inside}</robot>'


def link(name: str, inside: str = BODY) -> str:
    return f'<link name="{name}">{inside}</link>'


def joint(
    kind: str, more: str = "", *, name: str = "ankle", parent: str = "shank", child: str = "foot"
) -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{more}</joint>'


def two(kind: str, more: str = "", *, shank: str = BODY, foot: str = BODY) -> str:
    """A shank, a foot, and the joint `ankle` between them."""
    return robot(link("shank", shank) + link("foot", foot) + joint(kind, more))
