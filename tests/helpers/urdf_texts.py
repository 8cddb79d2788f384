"""Small URDF files."""

INERTIA = '<inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0" ixz="0" iyz="0"/>'
BODY = f'<inertial><origin xyz="0.1 0 -0.2"/><mass value="2"/>{INERTIA}</inertial>'


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
