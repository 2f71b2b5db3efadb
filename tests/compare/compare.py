#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The multiscale answer against full DEM, for the same scene: differences, and what each took.

   compare.py [--quick] [case ...]        from the root (make compare; QUICK=1: few grains, to try it)

Writes build/compare (build/compare-quick): report.json, coarse_dem.json, report.md, figures. A finished run is not repeated."""
import argparse
import importlib
import json
import pathlib
import sys
import time
import traceback

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from comparison import Comparison  # noqa: E402
from study import BUILD  # noqa: E402
from verify import processor  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
CASES = [name for name in ("bed", "biaxial", "column", "melting_column") if (HERE / f"scene_{name}.py").exists()]


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
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("cases", nargs="*", metavar="case", help=", ".join(CASES))
    arguments = parser.parse_args()
    unknown = set(arguments.cases) - set(CASES)
    if unknown:
        parser.error(f"no such case: {', '.join(sorted(unknown))}; there are {', '.join(CASES)}")
    folder = BUILD / ("compare-quick" if arguments.quick else "compare")
    start, failed, comparisons = time.monotonic(), [], []
    for name in arguments.cases or CASES:
        print(name, flush=True)
        comparison = Comparison(name, folder, "quick" if arguments.quick else "full")
        comparisons.append(comparison)
        try:
            importlib.import_module(f"scene_{name}").compare(comparison)
        except Exception:  # one case that breaks must not take the others' results along
            traceback.print_exc()
            comparison.note(f"did not end: {traceback.format_exc().strip().splitlines()[-1]}")
            failed.append(name)
        write_report(folder, comparisons, time.monotonic() - start, arguments.quick)
    print(f"{folder / 'report.md'}: {sum(len(c.rows) for c in comparisons)} figures, {time.monotonic() - start:.0f} s")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
