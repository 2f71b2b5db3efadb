# SPDX-License-Identifier: GPL-2.0-or-later
"""build/validate/report.json: rows {"case", "quantity", "error", "bound", "pass", "seconds"}, as those of make verify."""
import json

from peer_rve import BUILD


class Report:
    """Collects the rows of one case; write() puts them in the place of those of an earlier run."""

    def __init__(self, case):
        self.case, self.rows, self.folder = case, [], BUILD / "validate"
        self.folder.mkdir(parents=True, exist_ok=True)

    def check(self, quantity, error, bound, seconds):
        """error <= bound passes; bound None: for information."""
        error = float(error)
        self.rows.append({"case": self.case, "quantity": quantity, "error": error, "bound": bound,
                          "pass": None if bound is None else bool(error <= bound), "seconds": round(seconds, 2)})
        verdict = "" if bound is None else f" <= {bound:g} {'ok' if error <= bound else 'FAILS'}"
        print(f"{self.case}: {quantity}: {error:.3g}{verdict}", flush=True)

    def write(self):
        """Returns how many rows miss their bounds."""
        file = self.folder / "report.json"
        others = [row for row in json.loads(file.read_text()) if row["case"] != self.case] if file.exists() else []
        file.write_text(json.dumps(others + self.rows, indent=1) + "\n")
        return sum(row["pass"] is False for row in self.rows)
