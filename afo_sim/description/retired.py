"""Tables of former versions: refused where they would act, left out with a warning elsewhere."""

import warnings

from afo_sim.common import InputError
from afo_sim.description.tree import Tree

# What stands for it now, by (table, key).
RETIRED = {
    ("controller", "impedance"): "a function of your own, afo_sim.run(…, controller=…): a few lines, "
    "docs/controllers.md; or [controller.pid]",
    ("leg", "subtalar"): "a leg without it: the foot does not turn to its side, and peak_inversion_moment is "
    "of the muscles about the ankle",
}


def leave_out(tree: Tree) -> None:
    """Take out of a description what nothing reads any more; InputError where a run would depend on it."""
    for (table, key), instead in RETIRED.items():
        own = tree.kind == table
        holder = tree.root if own else tree.root.get(table)
        if not isinstance(holder, dict) or key not in holder:
            continue
        rest = {name: value for name, value in holder.items() if name != key}
        if holder[key] is not None:  # as a recording has what was not described
            where = tree.place((key,) if own else (table, key))
            # the hinge did not turn in recorded walking, and a leg alone does not run
            if key == "impedance" or not (own or tree.root.get("gait")):
                raise InputError("is retired", **where, allowed=instead)
            warnings.warn(str(InputError("is retired, and has no effect here", **where)), stacklevel=4)
        if own:
            tree.root = rest
        else:
            tree.root[table] = rest
