# SPDX-License-Identifier: GPL-2.0-or-later
"""The command line of verify.py and compare.py: case after case, each a module PREFIX_NAME."""
import argparse
import importlib
import pathlib
import platform
import time
import traceback


def present(folder, prefix, names):
    """Those of the names that have a module in the folder."""
    return [name for name in names if (pathlib.Path(folder) / f"{prefix}_{name}.py").exists()]


def parse(text, cases, option):
    """(cases asked for, whether --OPTION was given)."""
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(f"--{option}", action="store_true", dest="option")
    parser.add_argument("cases", nargs="*", metavar="case", help=", ".join(cases))
    arguments = parser.parse_args()
    unknown = set(arguments.cases) - set(cases)
    if unknown:
        parser.error(f"no such case: {', '.join(sorted(unknown))}; there are {', '.join(cases)}")
    return arguments.cases or cases, arguments.option


def run_cases(prefix, function, names, make, report):
    """Calls FUNCTION(make(name)) of each case's module, then report(studies, seconds). Returns (studies, cases that did not end, seconds)."""
    start, failed, studies = time.monotonic(), [], []
    for k, name in enumerate(names):
        print(f"{name} ({k + 1} of {len(names)}, {time.monotonic() - start:.0f} s so far)", flush=True)
        studies.append(make(name))
        try:
            getattr(importlib.import_module(f"{prefix}_{name}"), function)(studies[-1])
        except (Exception, SystemExit):  # one case that breaks must not take the others' results along
            traceback.print_exc()
            studies[-1].note(f"did not end: {traceback.format_exc().strip().splitlines()[-1]}")
            failed.append(name)
        report(studies, time.monotonic() - start)
    return studies, failed, time.monotonic() - start


def processor():
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":")[1].strip()
    return platform.machine()
