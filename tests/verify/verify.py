#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The cases of TM-DEMPM against their references: error beside seconds.

   verify.py [--full] [case ...]        from the root (make verify, make verify-full)

Writes build/verify (build/verify-full): report.json, report.md, figures. Ends with 1 if a bound is missed or a run fails. A
finished run is not repeated, so that an interrupted verification goes on with the run that was cut; with --full from its last
restart file, bit for bit, and each run tells its progress and the time left."""
import json
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
from command import parse, present, processor, run_cases  # noqa: E402
from study import BUILD, THREADS, Study  # noqa: E402

CASES = present(HERE, "case", ("heated_bar", "heated_plate", "rod", "heated_square", "biaxial", "silo", "column_collapse"))


def number(value):
    return "" if value is None or value == 0 else f"{value:.3g}" if isinstance(value, float) else f"{value}"


def write_report(folder, studies, seconds, full):
    rows = [row for study in studies for row in study.rows]
    (folder / "report.json").write_text(json.dumps(rows, indent=1) + "\n")
    size = "the papers' sizes" if full else "quick cases whole, long ones at a smaller size"
    lines = [f"# Verification: {size}", "", f"{processor()}, {THREADS} threads, {seconds:.0f} s in all.", ""]
    for study in studies:
        lines += [f"## {study.case}", "", "| quantity | error | bound | | seconds | points | grains | DEM steps |",
                  "| --- | --- | --- | --- | --- | --- | --- | --- |"]
        for row in study.rows:
            verdict = {True: "passes", False: "**fails**", None: ""}[row["pass"]]
            lines.append(f"| {row['quantity']} | {row['error']:.3g} | {number(row['bound'])} | {verdict} | {row['seconds']:.3g} | "
                         f"{number(row['points'])} | {number(row['grains'])} | {number(row['dem_steps'])} |")
        lines += [""] + [f"* {note}" for note in study.notes] + [""] + [f"![{name}]({name})" for name in study.figures] + [""]
    (folder / "report.md").write_text("\n".join(lines))


def main():
    names, full = parse(__doc__, CASES, "full")
    folder = BUILD / ("verify-full" if full else "verify")
    studies, failed, seconds = run_cases("case", "verify", names, lambda name: Study(name, folder, full),
                                         lambda done, passed: write_report(folder, done, passed, full))
    missed = [row for study in studies for row in study.rows if row["pass"] is False]
    print(f"{folder / 'report.md'}: {sum(len(s.rows) for s in studies)} figures, {len(missed)} miss their bound, "
          f"{seconds:.0f} s")
    for row in missed:
        print(f"  {row['case']}: {row['quantity']}: {row['error']:.3g} > {row['bound']:g}")
    return 1 if missed or failed else 0


if __name__ == "__main__":
    sys.exit(main())
