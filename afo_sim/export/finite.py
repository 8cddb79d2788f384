"""Rows without a number that is none, for programs that cannot read one."""

import dataclasses

import numpy as np

from afo_sim.export.rows import TIME, Rows


def finite(rows: Rows, *, failed: bool) -> Rows:
    """Rows of finite numbers only, with notes on what is left out.

    A run that failed ends before its first row with such a number; of one that did not, columns with such a
    number are left out.
    """
    columns, notes = dict(rows.columns), list(rows.notes)
    whole = np.logical_and.reduce([np.isfinite(values) for values in columns.values()])
    if failed and whole[0] and not whole.all():
        end = int(np.argmin(whole))
        columns = {name: values[:end] for name, values in columns.items()}
        notes.append(f"the last {len(whole) - end} rows are left out: they hold numbers that are not finite")
    bad = [name for name, values in columns.items() if name != TIME and not np.isfinite(values).all()]
    if bad:
        notes.append(f"left out, since they are not finite in every row: {', '.join(bad)}")
    kept = {name: values for name, values in columns.items() if name not in bad}
    return dataclasses.replace(rows, columns=kept, notes=tuple(notes))
