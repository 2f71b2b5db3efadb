#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Times one RVE job in every DEM code at hand and writes rve.json and rve.png; see doc/performance.md.

  rve.py BUILD [--rounds N] [--until TIME] [--core N] [--codes NAME,...] [--gpu]

After three rounds none is begun that would not end before TIME (seconds since 1970).

Exit code 1 if the codes do not end at the same stresses: then they have not done the same job, and no ratio counts.
"""
import argparse
import datetime
import json
import os
import pathlib
import platform
import re
import resource
import shutil
import statistics
import subprocess
import sys
import time

import codes

TOLERANCE = 0.04  # of an end stress, from the median of all codes: 400 grains part ways after 20,000 steps
GPU_WARPS = 16, 8, 4  # of a block, at most; the first is the default
FEWEST_ROUNDS = 3  # of which a median can be taken, whatever the time
TUNING_STEPS, TUNING_TRIES = 4000, 2  # the same for all codes
# Floating-point operations and bytes moved per particle-step, a + b * slots; counted from the kernels' source in
# doc/performance.md, and to be counted anew when they change. Whole reactions are longer, in 3D.
FLOP = {2: (55, 79), 3: (109, 172)}
BYTES = {2: (216, 152), 3: (384, 264)}
BYTES_WHOLE = {**BYTES, 3: (384, 280)}


def text(*command):
    """First line of a command's output; "" if it cannot be run."""
    try:
        return subprocess.run(command, text=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout.split("\n")[0]
    except OSError:
        return ""


def machine(build):
    info = pathlib.Path("/proc/cpuinfo")
    entries = dict(re.findall(r"^(model name|flags)\s*: (.*)$", info.read_text(), re.M)) if info.exists() else {}
    flags = build / "flags"
    return {"processor": entries.get("model name", platform.processor()), "architecture": platform.machine(),
            "cores": len(os.sched_getaffinity(0)), "flags": entries.get("flags", "").split(), "kernel": platform.release(),
            "compiler": text("gcc", "--version"), "compiler_flags": flags.read_text().split(" | ")[0] if flags.exists() else "",
            "load_before": os.getloadavg()}


def versions():
    names = ["gcc", "liggghts", "lammps", "yade", "python3"]
    if not shutil.which("dpkg-query"):
        return {}
    return {name: text("dpkg-query", "-W", "-f", "${Version}", name) for name in names}


def busy_seconds():
    """Processor time that all processes have used, this machine's hypervisor's included."""
    words = pathlib.Path("/proc/stat").read_text().split("\n")[0].split()[1:9]
    return (sum(map(int, words)) - int(words[3]) - int(words[4])) / os.sysconf("SC_CLK_TCK")


def timed(command, read, cores, folder, **environment):
    """A result, with the processor time that others used meanwhile."""
    used = lambda: sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
    busy, own, start = busy_seconds(), used(), time.time()
    result = read(codes.execute(command, cores, folder, **environment))
    result["whole_seconds"] = time.time() - start
    result["foreign_seconds"] = max(0.0, busy_seconds() - busy - (used() - own))
    return result


class Bench:
    def __init__(self, build, core, rounds, wanted):
        self.build, self.core, self.rounds = build, core, rounds
        self.folder = build / "bench"
        self.codes = [code for code in codes.all_codes(build, self.folder) if not wanted or code.name in wanted]
        self.runs, self.skins = [], {}

    def say(self, line):
        print(line, flush=True)

    def tune(self, dimension):
        """Each code's best skin, from short runs that take turns."""
        for code in self.codes:
            best = {}
            for _ in range(TUNING_TRIES):
                for skin in code.skins:
                    result = timed(code.command(dimension, skin, TUNING_STEPS), code.read, [self.core], self.folder)
                    best[skin] = min(best.get(skin, 1e9), result["seconds"])
            self.skins[f"{code.name}_{dimension}d"] = min(best, key=best.get)

    def round(self, dimension, number):
        for code in self.codes:
            skin = self.skins[f"{code.name}_{dimension}d"]
            result = timed(code.command(dimension, skin, codes.STEPS), code.read, [self.core], self.folder)
            rate = codes.GRAINS[dimension] * codes.STEPS / result["seconds"]
            self.runs.append({"code": code.name, "dimension": dimension, "round": number, "skin": skin,
                              "particle_steps_per_second": rate, **result})
            self.say(f"  round {number}  {dimension}D  {code.label:16} {1e-6 * rate:7.2f} million particle-steps/s   "
                     f"sxx {result['sxx']:.5g} syy {result['syy']:.5g}   others' load {result['foreign_seconds']:.1f} s")

    def take_turns(self, until):
        """Up to as many rounds as asked; a round lasts as long as the longest one before, for all that is known."""
        longest = 0.0
        for number in range(1, self.rounds + 1):
            start = time.time()
            if number > FEWEST_ROUNDS and start + longest > until:
                self.say(f"  {number - 1} rounds of {self.rounds}: another one would take more time than there is")
                self.rounds = number - 1
                return
            for dimension in (2, 3):
                self.round(dimension, number)
            longest = max(longest, time.time() - start)

    def rates(self, name, dimension):
        return [run["particle_steps_per_second"] for run in self.runs
                if run["code"] == name and run["dimension"] == dimension]

    def summary(self):
        table = {}
        for code in self.codes:
            for dimension in (2, 3):
                rates = self.rates(code.name, dimension)
                ends = [run for run in self.runs if run["code"] == code.name and run["dimension"] == dimension]
                table[f"{code.name}_{dimension}d"] = {
                    "median": statistics.median(rates), "best": max(rates), "worst": min(rates),
                    "skin": self.skins[f"{code.name}_{dimension}d"], "sxx": ends[-1]["sxx"], "syy": ends[-1]["syy"],
                    "coordination": [ends[-1]["coordination_start"], ends[-1]["coordination_end"]]}
        return table

    def agreement(self, table):
        """Largest deviation of an end stress from the median of the codes, and of a coordination number at the start."""
        worst = {}
        for dimension in (2, 3):
            rows = {name: row for name, row in table.items() if name.endswith(f"_{dimension}d")}
            for component in ("sxx", "syy"):
                middle = statistics.median(row[component] for row in rows.values())
                worst[f"{component}_{dimension}d"] = max(abs(row[component] / middle - 1.0) for row in rows.values())
            starts = [row["coordination"][0] for row in rows.values()]
            worst[f"coordination_{dimension}d"] = max(starts) / min(starts) - 1.0
        return {"tolerance": TOLERANCE, "deviation": worst, "agree": max(worst.values()) <= TOLERANCE}

    def job(self, dimension, threads, *words):
        """bench_rve_shear with keywords, on as many cores as threads."""
        cores = sorted(os.sched_getaffinity(0))[:threads] if threads > 1 else [self.core]
        return timed([self.build / "bench" / "bench_rve_shear", codes.DATA[dimension], dimension, "threads", threads, *words],
                     codes.last_json, cores, self.folder, OMP_NUM_THREADS=str(threads), OMP_PROC_BIND="true",
                     OMP_PLACES=",".join(f"{{{core}}}" for core in cores))

    def scaling(self):
        """Batches of 64 RVEs on one and on two cores, in turns."""
        if len(os.sched_getaffinity(0)) < 2:
            return {}
        result = {}
        for dimension, steps in ((2, 1500), (3, 400)):
            seconds = {1: [], 2: []}
            for _ in range(max(3, self.rounds)):
                for threads in seconds:
                    run = self.job(dimension, threads, "rves", 64, "steps", steps, "call", steps // 2)
                    seconds[threads] += run["seconds"]
            ratio = statistics.median(seconds[1]) / statistics.median(seconds[2])
            result[f"{dimension}d"] = {"rves": 64, "steps": steps, "seconds": seconds, "speedup": ratio}
            self.say(f"  64 RVEs, {dimension}D: two cores {ratio:.2f} times as fast as one")
        return result

    def skipping(self):
        """What absent physics costs: absent contacts here, absent heat, bonds, dashpots and 3D in bench_rve_parts."""
        result = {}
        for dimension in (2, 3):
            parts = codes.last_json(codes.execute(
                [self.build / "bench" / "bench_rve_parts", codes.DATA[dimension], dimension], [self.core], self.folder))
            gas = self.job(dimension, 1, "gas", 1.3, "repeat", 5)
            step = statistics.median(gas["seconds"]) / gas["steps"]
            parts["gas_ns_per_rve_step"], parts["gas_ns_per_particle_step"] = 1e9 * step, 1e9 * step / gas["grains"]
            result[f"{dimension}d"] = parts
        flat = result["2d"]
        flat["full_over_only"] = flat["full"] / flat["only"]
        self.say(f"  2D: {flat['full']:.1f} ns per particle-step, {flat['only']:.1f} in a kernel that knows nothing else; "
                 f"without contacts {flat['gas_ns_per_particle_step']:.1f}; lists {100 * flat['list_share']:.1f} %")
        return result

    def roofline(self, table, skipping):
        peak = codes.last_json(codes.execute([self.build / "bench" / "bench_peak"], [self.core], self.folder))
        result = {"peak": peak}
        for dimension in (2, 3):
            slots, rate = skipping[f"{dimension}d"]["used_slots"], table.get(f"dempm_{dimension}d", {}).get("median", 0.0)
            moving = BYTES_WHOLE if peak["isa"] == "avx512_whole" else BYTES
            flop, moved = (a + b * slots for a, b in (FLOP[dimension], moving[dimension]))
            result[f"{dimension}d"] = {
                "slots_per_grain": slots, "flop": flop, "bytes": moved, "gflops": 1e-9 * flop * rate,
                "gbs": 1e-9 * moved * rate, "share_of_peak": 1e-9 * flop * rate / peak["gflops"]}
        return result


def figure(path, labels, table):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    plot, axes = plt.subplots(1, 2, figsize=(10, 0.5 * len(labels) + 1.4), constrained_layout=True)
    for axis, dimension in zip(axes, (2, 3)):
        rows = [table[f"{name}_{dimension}d"] for name in labels]
        middle = [1e-6 * row["median"] for row in rows]
        spread = [[1e-6 * (row["median"] - row["worst"]) for row in rows],
                  [1e-6 * (row["best"] - row["median"]) for row in rows]]
        axis.barh(list(labels.values()), middle, xerr=spread, capsize=3,
                  color=["#0072b2" if name.startswith("dempm") else "#999999" for name in labels])
        for k, row in enumerate(rows):
            axis.text(1e-6 * row["best"], k, f"  {middle[k]:.1f}", va="center")
        axis.set_xlim(0, 1.25e-6 * max(row["best"] for row in rows))
        axis.invert_yaxis()
        axis.set_title(f"{dimension}D, {codes.GRAINS[dimension]} grains")
        axis.set_xlabel("million particle-steps/s on one core")
    plot.savefig(path, dpi=150)


def ratios(table, ours):
    """One of ours over each peer; LAMMPS is the native build where there is one."""
    result = {}
    for peer in ("liggghts", "lammps", "yade"):
        for dimension in (2, 3):
            mine = table.get(f"{ours}_{dimension}d")
            other = table.get(f"{peer}_native_{dimension}d") or table.get(f"{peer}_{dimension}d")
            result[f"{peer}_{dimension}d"] = mine["median"] / other["median"] if mine and other else None
    return result


def gpu(build, folder):
    """The job in a batch on the device, with blocks of up to 16 warps (the default), 8 and 4; a warm-up is in the first repetition."""
    result = {"date": datetime.datetime.now().isoformat(timespec="seconds"), "particle_steps_per_second": {}, "by_warps": {}, "runs": []}
    for dimension, rves, steps in ((2, 1584, 2000), (3, 528, 1000)):
        for warps in GPU_WARPS:
            run = codes.last_json(codes.execute(
                [build / "bench" / "bench_rve_shear", codes.DATA[dimension], dimension, "backend", "cuda", "rves", rves, "steps",
                 steps, "call", 500, "repeat", 4], sorted(os.sched_getaffinity(0)), folder, DEMPM_CUDA_WARPS=str(warps)))
            rate = run["grains"] * rves * steps / statistics.median(run["seconds"][1:])
            if warps == GPU_WARPS[0]:
                result["particle_steps_per_second"][f"cuda_{dimension}d"] = rate
            result["by_warps"][f"cuda_{dimension}d_{warps}"] = rate
            result["runs"].append({"warps": warps, **run})
            print(f"  {run['backend']} {dimension}D {rves} RVEs, {warps} warps: {rate:.3g} particle-steps/s", flush=True)
    (folder / "gpu.json").write_text(json.dumps(result, indent=1) + "\n")
    return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--until", type=float, default=float("inf"))
    parser.add_argument("--core", type=int, default=max(os.sched_getaffinity(0)))
    parser.add_argument("--codes", type=lambda names: names.split(","), default=[])
    parser.add_argument("--gpu", action="store_true")
    arguments = parser.parse_args()
    build = arguments.build.resolve()
    folder = build / "bench"
    if arguments.gpu:
        return gpu(build, folder)
    bench = Bench(build, arguments.core, arguments.rounds, arguments.codes)
    result = {"date": datetime.datetime.now().isoformat(timespec="seconds"), "machine": machine(build),
              "versions": versions(), "core": bench.core}
    scaling, skipping = bench.scaling(), bench.skipping()
    for dimension in (2, 3):
        bench.tune(dimension)
    bench.take_turns(arguments.until)
    result["rounds"] = bench.rounds
    table = bench.summary()
    labels = {code.name: code.label for code in bench.codes}
    result["ratios"] = ratios(table, "dempm")
    result["ratios_dashpots"] = ratios(table, "dempm_dashpots")
    result["ratios_mixed"] = ratios(table, "dempm_mixed")
    result["lammps_build"] = "native" if "lammps_native" in labels else "Debian's"
    result["particle_steps_per_second"] = {
        f"cpu_{d}d": table[f"dempm_{d}d"]["median"] for d in (2, 3) if "dempm" in labels}
    result["two_core_scaling"] = min((entry["speedup"] for entry in scaling.values()), default=None)
    result["agreement"] = bench.agreement(table)
    result.update(codes=table, scaling=scaling, skipping=skipping, roofline=bench.roofline(table, skipping), runs=bench.runs)
    result["machine"]["load_after"] = os.getloadavg()
    (folder / "rve.json").write_text(json.dumps(result, indent=1) + "\n")
    figure(folder / "rve.png", labels, table)
    print("dempm is faster by " + ", ".join(f"{name} {ratio:.1f}" for name, ratio in result["ratios"].items() if ratio))
    print(f"written: {folder / 'rve.json'}, {folder / 'rve.png'}")
    if not result["agreement"]["agree"]:
        print(f"rve.py: the codes end at different stresses: {result['agreement']}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except codes.Failure as failure:
        sys.exit(f"rve.py: {failure}")
