# SPDX-License-Identifier: GPL-2.0-or-later
"""The twin scripts of examples/compare at tiny sizes: both run, take their physics from one file, and give the same quantities."""
import importlib
import math
import re
import sys

import pytest

from conftest import ROOT

sys.path.insert(0, str(ROOT / "tests" / "compare"))
from comparison import Comparison  # noqa: E402

# Largest error of one quantity that 250 grains must meet; measured: 0.065, 0.18, 0.10, 0.07.
CASES = {"bed": ("heat in the bed", 0.2), "biaxial": ("stress on the plate", 0.4), "column": ("profile at the end", 0.3),
         "melting_column": ("profile at the end", 0.3)}


@pytest.mark.parametrize("case", CASES)
def test_both_sides_answer(case, tmp_path):
    comparison = Comparison(case, tmp_path, "tiny")
    importlib.import_module(f"scene_{case}").compare(comparison)
    errors = {row["quantity"]: row["error"] for row in comparison.rows}
    print(errors)
    assert all(math.isfinite(error) for error in errors.values())
    quantity, bound = CASES[case]
    assert errors[quantity] < bound, errors
    assert all(row["seconds_multiscale"] > 0 and row["seconds_full_dem"] > 0 for row in comparison.rows)
    log, = comparison.folder.glob("multiscale*/log.liggghts")
    assert re.search(r"packing( rve_16_\d\.packing){4} ", log.read_text())  # points take four packings in turn


@pytest.mark.parametrize("folder", ["bed", "biaxial", "column"])
def test_twins_share_their_parameters(folder):
    """Properties of the grains, and what fixes are given of physics, come from parameters.inc: no numbers in the twins' properties."""
    for name in ("in.full_dem", "in.multiscale"):
        text = (ROOT / "examples" / "compare" / folder / name).read_text().replace("&\n", " ")
        assert re.search(r"^include\s+parameters\.inc$", text, re.M)
        properties = re.findall(r"^fix\s+\S+\s+all property/global (\S+) (?:peratomtypepair (?:\d)|peratomtype)(.*)$", text, re.M)
        assert len(properties) >= 5
        for property_name, values in properties:
            numbers = [word for word in values.split() if not word.startswith("${") and word != "0"]
            assert not numbers, f"{folder}/{name}: {property_name} {numbers}"
