# SPDX-License-Identifier: GPL-2.0-or-later
"""Tables of `thermo` output in LIGGGHTS' logs."""
import numpy as np


def tables(text):
    """[{name of the column: array}] of a log, one for each `run`: a header line whose first word is Step, rows of numbers,
    and `Loop time` at the end, which a run that was cut lacks."""
    result, names = [], None
    for line in text.splitlines():
        words = line.split()
        if words and words[0] == "Step":
            names, rows = words, []
            result.append((names, rows))
        elif line.startswith("Loop time"):
            names = None
        elif names and len(words) == len(names):
            try:
                rows.append([float(word) for word in words])
            except ValueError:  # a message of as many words as there are columns
                pass
    return [dict(zip(names, np.array(rows).reshape(-1, len(names)).T)) for names, rows in result]


def last_table(path):
    return tables(path.read_text(errors="replace"))[-1]
