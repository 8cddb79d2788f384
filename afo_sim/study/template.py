"""Files to start from: a new sweep or design search that runs at once."""

import os
import pathlib
from collections.abc import Mapping

from afo_sim.common import InputError, assets, check_writable, write_text
from afo_sim.description import base_of, target_of
from afo_sim.description.new import reference, refuse_both

# {what the template says of a seated device: what stands there for walking}
_WALKING = {
    "range_of_motion": "toe_clearance",
    "air_per_cycle": "air_per_stride",
    "15 deg": "10 mm",
    "8 s": "7.2 s",
}


def new_study(
    kind: str, name: str, out: str | os.PathLike[str] = ".", *, like: str = "",
    uses: Mapping[str, str] | None = None, whole: bool = False,
) -> pathlib.Path:  # fmt: skip
    """Write a commented sweep or search that runs as it is."""
    for used, where in (uses or {}).items():
        if used != "scenario":
            raise InputError(f"does not go with a new {kind}", field=used, value=where, allowed="`scenario`")
    target = target_of(kind, name, pathlib.Path(out))
    refuse_both(whole, like)
    if like:
        if uses:
            raise InputError("does not go with `like`", field="scenario", value=uses["scenario"])
        text = base_of(kind, like).read_text(encoding="utf-8")
    else:
        chosen = (uses or {}).get("scenario", "seated")
        scenario = reference("scenario", chosen, target.parent)
        walks = "gait" in assets.read_toml(assets.find("scenario", chosen))
        text = assets.template(kind, whole=whole).read_text(encoding="utf-8")
        text = text.replace("NAME", name).replace("keys seated", f"keys {scenario}")
        for written, now in ({"seated": scenario} | (_WALKING if walks else {})).items():
            text = text.replace(f'"{written}"', f'"{now}"')
    check_writable(target.parent)
    write_text(target, text)
    return target
