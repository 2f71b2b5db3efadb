#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Conductances of pairs, all models: what build/tests/test_grain_heat measures, as rows of the report. Reference values are
those of independent scripts (adaptive quadrature, relative tolerance 1e-10); own quadratures are converged in long double, over size
ratios of 1 to 20, gaps of -3 % to 30 % of the mean radius and conductivities of 0.1 to 1e5 times the fluid's.

   thermal_pairs.py        from the root, after `make build/tests/test_grain_heat`"""
import pathlib
import re
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from report import BUILD, Report  # noqa: E402

MODELS = ["batchelor", "liggghts", "pipe", "collisional", "voronoi_a", "voronoi_b", "layer"]


def main():
    report = Report("pair conductances")
    done = subprocess.run([BUILD / "tests" / "test_grain_heat"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    reference = dict(re.findall(r"^grain heat, (\w+): (\S+) from the reference", done.stdout, re.M))
    line = re.search(r"^grain heat: (.*) from own quadratures", done.stdout, re.M)
    own = dict(re.findall(r"(\w+) ([^ ,]+)", line.group(1))) if line else {}
    if done.returncode != 0 or not own or set(MODELS) - set(reference):
        sys.exit(f"test_grain_heat ended with {done.returncode}\n{done.stdout[-2000:]}")
    for model in MODELS:
        report.check(f"{model}: largest relative deviation from the reference values", reference[model], 1e-10)
        if model in own:
            report.check(f"{model}: largest relative deviation from own quadrature, 192 pairs", own[model], 1e-10)
    sys.exit(report.write())


if __name__ == "__main__":
    main()
