#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The cases of TM-DEMPM against their references: error beside seconds.

   verify.py [--full] [case ...]        from the root (make verify, make verify-full)

Writes build/verify (build/verify-full): report.json, report.md, figures. Ends with 1 if a bound is missed or a run fails. A
finished run is not repeated, so that an interrupted verification goes on with the run that was cut; with --full from its last
restart file, bit for bit, and each run tells its progress and the time left."""
import argparse
import importlib
import json
import pathlib
import platform
import sys
import time
import traceback

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from study import BUILD, THREADS, Study  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
ORDER = ["heated_bar", "heated_plate", "rod", "heated_square", "biaxial", "silo", "column_collapse"]
CASES = [name for name in ORDER if (HERE / f"case_{name}.py").exists()]


def processor():
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":")[1].strip()
    return platform.machine()


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
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true")
    parser.add_argument("cases", nargs="*", metavar="case", help=", ".join(CASES))
    arguments = parser.parse_args()
    unknown = set(arguments.cases) - set(CASES)
    if unknown:
        parser.error(f"no such case: {', '.join(sorted(unknown))}; there are {', '.join(CASES)}")
    folder = BUILD / ("verify-full" if arguments.full else "verify")
    start, failed, studies = time.monotonic(), [], []
    wanted = arguments.cases or CASES
    for k, name in enumerate(wanted):
        print(f"{name} ({k + 1} of {len(wanted)}, {time.monotonic() - start:.0f} s so far)", flush=True)
        study = Study(name, folder, arguments.full)
        studies.append(study)
        try:
            importlib.import_module(f"case_{name}").verify(study)
        except Exception:  # one case that breaks must not take the others' results along
            traceback.print_exc()
            study.note(f"did not end: {traceback.format_exc().strip().splitlines()[-1]}")
            failed.append(name)
        write_report(folder, studies, time.monotonic() - start, arguments.full)
    missed = [row for study in studies for row in study.rows if row["pass"] is False]
    print(f"{folder / 'report.md'}: {sum(len(s.rows) for s in studies)} figures, {len(missed)} miss their bound, "
          f"{time.monotonic() - start:.0f} s")
    for row in missed:
        print(f"  {row['case']}: {row['quantity']}: {row['error']:.3g} > {row['bound']:g}")
    return 1 if missed or failed else 0


if __name__ == "__main__":
    sys.exit(main())
