# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs that go on after an interruption. A script of examples/ (one that ends in `run ${steps}`) is given two restart files, written
in turn; after a cut its continuation reads the newer one that is whole. What the parts wrote is put together at the end: of each part
what lies before the next one's start."""
import os
import pathlib
import re
import shutil

SAVED = ("saved.a.restart", "saved.b.restart")
RUN = re.compile(r"^run\s+(\$\{steps\}|\d+)\s*$", re.MULTILINE)
MADE = re.compile(r"^(create_box|create_atoms|read_restart|boundary|set)\b.*$", re.MULTILINE)


def with_restarts(text):
    """The script, writing restart files about fifty times, and its log line by line."""
    steps = RUN.search(text).group(1)
    first = f"variable resume_every equal 200*ceil({steps}/10000)\nrestart ${{resume_every}} {SAVED[0]} {SAVED[1]}\n"
    return RUN.sub(lambda run: f"{first}thermo_modify flush yes\n{run.group(0)}", text)


def continuation(text, file, last):
    """The script from a restart file on to step `last`: nothing is made a second time."""
    place = re.search(r"^(create_box|read_restart)\b", text, re.MULTILINE).start()
    rest = MADE.sub("", text[place:])
    rest = re.sub(r'^.*bonds install.*$', "", rest, flags=re.MULTILINE)
    text = re.sub(r"^boundary\b.*$", "", text[:place], flags=re.MULTILINE) + f"read_restart {file}\n" + rest
    return RUN.sub(f"run {last} upto", with_restarts(text))


def last_step(log):
    """The step at which a script's run ends, from the log of its first part; None if it did not get that far."""
    length, first = re.findall(r"^run\s+(\d+)\s*$", log, re.MULTILINE), first_step(log)
    return None if not length or first is None else first + int(length[-1])


def rows(log):
    """(index of the line, step) of the thermo rows after the last header, and the index of that header."""
    lines = log.splitlines()
    heads = [k for k, line in enumerate(lines) if line.split()[:1] == ["Step"]]
    if not heads:
        return [], None
    width = len(lines[heads[-1]].split())
    found = [(k, line.split()) for k, line in enumerate(lines) if k > heads[-1] and len(line.split()) == width]
    return [(k, int(words[0])) for k, words in found if words[0].isdigit()], heads[-1]


def first_step(log):
    found, _ = rows(log)
    return found[0][1] if found else None


def present_step(log):
    found, _ = rows(log)
    return found[-1][1] if found else None


def user_time(process):
    """Seconds that a process, its children and those of theirs have had a processor for, so far; 0 where /proc does not tell."""
    try:
        fields = pathlib.Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
        children = pathlib.Path(f"/proc/{process}/task/{process}/children").read_text().split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[13])) / os.sysconf("SC_CLK_TCK") + sum(map(user_time, children))


def restart_files(path):
    """Newest first."""
    return sorted((path / name for name in SAVED if (path / name).exists()), key=lambda file: -file.stat().st_mtime_ns)


def is_series(file):
    """A text file that grows with the run: a dump or a table of fix ave/time."""
    with open(file, "rb") as opened:
        start = opened.read(40)
    return start.startswith((b"ITEM: TIMESTEP", b"# Time-averaged data"))


def series_of(folder):
    """Those of a part's folder, or of the run's own without those of the parts in it."""
    files = [file for file in folder.rglob("*") if file.is_file() and not file.relative_to(folder).parts[0].startswith("part.")]
    return [file for file in files if is_series(file)]


def set_aside(path):
    """Moves log and series of the part that was cut into the next folder part.N; forgets it if it did not begin to run."""
    log = path / "log.liggghts"
    if not log.exists() or first_step(log.read_text(errors="replace")) is None:
        return
    part = path / f"part.{len(list(path.glob('part.*')))}"
    part.mkdir()
    for file in [log] + series_of(path):
        target = part / file.relative_to(path)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(file, target)


def merge(path):
    """Puts log and series of all parts together."""
    parts = sorted(path.glob("part.*"), key=lambda part: int(part.suffix[1:]))
    if not parts:
        return
    folders = parts + [path]
    logs = [(folder / "log.liggghts").read_text(errors="replace") for folder in folders]
    starts = [first_step(log) for log in logs]
    names = {file.relative_to(folder) for folder in folders for file in series_of(folder)}
    (path / "log.liggghts").write_text(merge_logs(logs, starts))
    for name in names:
        series = [(folder / name).read_text() if (folder / name).exists() else "" for folder in folders]
        (path / name).write_text(merge_series(series, starts))
    for part in parts:
        shutil.rmtree(part)


def ends(starts):
    """The steps (after, to) that count of each part."""
    return [(start if k else -1, min(starts[k + 1:], default=float("inf"))) for k, start in enumerate(starts)]


def merge_logs(logs, starts):
    """LIGGGHTS' time starts at zero again after read_restart: the column is that of the first part, carried on."""
    result, clock = [], None
    for log, (after, to) in zip(logs, ends(starts)):
        lines = log.splitlines()
        found, head = rows(log)
        columns = lines[head].split()
        if "Time" in columns:
            at = columns.index("Time")
            times = [float(lines[k].split()[at]) for k, _ in found]
            length = (times[-1] - times[0]) / max(found[-1][1] - found[0][1], 1)
            clock = clock or (found[0][1], times[0], length)
            for k, step in found:
                words = lines[k].split()
                words[at] = repr(clock[1] + (step - clock[0]) * (clock[2] or length))
                lines[k] = " ".join(words) if result else lines[k]
        drop = {k for k, step in found if not after < step <= to}
        result += [line for k, line in enumerate(lines) if k not in drop and (not result or k > head)]
    return "\n".join(result) + "\n"


def merge_series(series, starts):
    result = []
    for text, (after, to) in zip(series, ends(starts)):
        if text.startswith("ITEM"):
            blocks = [("ITEM: TIMESTEP" + block) for block in text.split("ITEM: TIMESTEP")[1:]]
            result += [block for block in blocks if after < int(block.split("\n")[1] or -1) <= to]
        else:
            lines = text.splitlines(keepends=True)
            result += [line for line in lines if (line.startswith("#") and not after >= 0)
                       or (line[:1].isdigit() and after < int(line.split()[0]) <= to)]
    return "".join(result)
