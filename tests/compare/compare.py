#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The multiscale answer against full DEM, for the same scene: differences, and what each took.

   compare.py [--quick] [case ...]        from the root (make compare; QUICK=1: few grains, to try it)

Writes build/compare (build/compare-quick): report.json, coarse_dem.json, report.md, figures. A finished run is not repeated."""
import json
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
from comparison import Comparison  # noqa: E402
from command import parse, present, processor, run_cases  # noqa: E402
from study import BUILD  # noqa: E402

CASES = present(HERE, "scene", ("bed", "biaxial", "column", "melting_column"))


def write_report(folder, comparisons, seconds, quick):
    for name, rows in (("report", [row for c in comparisons for row in c.rows]),
                       ("coarse_dem", [row for c in comparisons for row in c.coarse_rows])):
        (folder / f"{name}.json").write_text(json.dumps(rows, indent=1) + "\n")
    lines = [f"# Multiscale against full DEM{': few grains, to try it' if quick else ''}", "",
             f"{processor()}, one thread; processor seconds (user time) of the runs, without the preparation of the packings; "
             f"{seconds:.0f} s in all. Errors: root mean square of the difference over that of the mean full DEM.", ""]
    for c in comparisons:
        lines += [f"## {c.case}", ""] + [line for table in c.tables for line in [*table, ""]]
        lines += [f"* {note}" for note in c.notes] + [""] + [f"![{name}]({name})" for name in c.figures] + [""]
    (folder / "report.md").write_text("\n".join(lines))


def main():
    names, quick = parse(__doc__, CASES, "quick")
    folder = BUILD / ("compare-quick" if quick else "compare")
    comparisons, failed, seconds = run_cases("scene", "compare", names, lambda name: Comparison(name, folder, "quick" if quick else "full"),
                                             lambda studies, passed: write_report(folder, studies, passed, quick))
    print(f"{folder / 'report.md'}: {sum(len(c.rows) for c in comparisons)} figures, {seconds:.0f} s")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
