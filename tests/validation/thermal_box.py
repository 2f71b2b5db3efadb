#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The box of Rangel, Franci, Cornejo, Onate, Zarate, "Thermo-mechanical analysis of continuous and discrete media with PFEM
and DEM", 3.3: 4,454 grains in 0.6 m x 0.6 m at 400 K, cold sides and bottom of 300 K, insulated top. Full DEM against the
continuum with the homogenised conductivity and with that of the grains; thermal-only runs against runs with mechanics.

   thermal_box.py        from the root, after `make`

The paper gives no stiffness, hence no contact radius. Here the grains settle under their weight and a lid is lowered to 0.6 m,
without which they do not fit: their area is 0.916 of the box (the paper's: 0.918), that of a loose packing 0.84. The
contact radius is the geometric one of the overlaps that this makes."""
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from report import Report, Run  # noqa: E402

GRAINS, SIDE, DENSITY, CONDUCTIVITY, CAPACITY = 4454, 0.6, 2500.0, 2000.0, 100.0
MEAN, DEVIATION, SMALLEST, LARGEST = 4.83e-3, 0.53e-3, 2.56e-3, 7.92e-3
COLD, HOT = 300.0, 400.0
STIFFNESS, MECHANICS_STEP = 1e4, 4e-5  # N/m; s, a twentieth of the duration of a contact

HEAD = f"""
atom_style granular
atom_modify map array sort 0 0
units si
newton off
communicate single vel yes
boundary f f p
region box block -0.02 {SIDE + 0.02} -0.02 1.3 -0.01 0.01 units box
create_box 1 box
neighbor 0.002 bin
neigh_modify delay 0
fix m1 all property/global kn peratomtypepair 1 {STIFFNESS}
fix m2 all property/global kt peratomtypepair 1 {0.5 * STIFFNESS}
fix m3 all property/global gamman peratomtypepair 1 1500
fix m4 all property/global gammat peratomtypepair 1 750
fix m5 all property/global coefficientFriction peratomtypepair 1 {{friction}}
fix k all property/global thermalConductivity peratomtype {CONDUCTIVITY}
fix c all property/global thermalCapacity peratomtype {CAPACITY}
pair_style gran model hooke/stiffness tangential history
pair_coeff * *
timestep {MECHANICS_STEP}
read_data grains.data add
"""
WALL = "fix {name} all wall/gran model hooke/stiffness tangential history primitive type 1 {plane}{heat}\n"
WALLS = {"left": "xplane 0.0", "right": f"xplane {SIDE}", "bottom": "yplane 0.0"}


def walls(**temperatures):
    return "".join(WALL.format(name=name, plane=plane, heat=f" temperature {temperatures[name]}" if name in temperatures else "")
                   for name, plane in WALLS.items())


def data_file(radius, x, y):
    rows = [f"{n + 1} 1 {2 * r!r} {DENSITY} {a!r} {b!r} 0" for n, (r, a, b) in enumerate(zip(radius, x, y))]
    return (f"grains\n\n{len(rows)} atoms\n1 atom types\n\n-0.02 {SIDE + 0.02} xlo xhi\n-0.02 1.3 ylo yhi\n-0.01 0.01 zlo zhi\n\n"
            "Atoms\n\n" + "\n".join(rows) + "\n")


def pour():
    """Grains in rows that do not touch: (radius, x, y). The area is the paper's."""
    random = np.random.default_rng(1)
    radius = np.clip(random.normal(MEAN, DEVIATION, GRAINS), SMALLEST, LARGEST)
    x, y, floor, first = np.zeros(GRAINS), np.zeros(GRAINS), 0.0, 0
    while first < GRAINS:
        ends = np.cumsum(2.02 * radius[first:])
        count = max(1, int(np.searchsorted(ends, SIDE)))
        row = slice(first, min(first + count, GRAINS))
        tallest = radius[row].max()
        gap = (SIDE - ends[row.stop - first - 1]) / (row.stop - first)
        x[row] = ends[:row.stop - first] - 1.01 * radius[row] + gap * (np.arange(row.stop - first) + 0.5)
        y[row] = floor + 1.01 * tallest
        floor, first = floor + 2.02 * tallest, row.stop
    return radius, x, y


def settle():
    """(radius, x, y) of the settled grains."""
    radius, x, y = pour()
    top, stage = 0.68, 5e-4  # m: the lid comes down by 5 % of a diameter in 100 steps
    script = HEAD.format(friction=0) + walls() + f"""
fix move all nve/sphere
fix damp all viscous 0.01
fix g all gravity 9.81 vector 0 -1 0
thermo 1000
thermo_style custom step atoms ke cpu
run 10000
unfix g
variable stage loop {round((top - SIDE) / stage)}
label lower
variable height equal {top}-{stage}*${{stage}}
fix lid all wall/gran model hooke/stiffness tangential history primitive type 1 yplane ${{height}}
run 100
unfix lid
next stage
jump SELF lower
fix lid all wall/gran model hooke/stiffness tangential history primitive type 1 yplane {SIDE}
run 4000
dump end all custom 1 end.dump id radius x y z
dump_modify end sort id format "%d %.17g %.17g %.17g %.17g"
run 1
"""
    run = Run("box_settle", script, {"grains.data": data_file(radius, x, y)})
    frame = run.dump("end.dump")[-1][1]
    return run, np.array(frame["radius"]), np.array(frame["x"]), np.array(frame["y"])


# ----------------------------------------------------------------------------------------------------------- heat
def conduct(grains, temperatures, fixes, commands):
    """A script with grains between walls with `temperatures`, and its file."""
    heat = f"fix heat all heat/gran/grain initial_temperature {HOT} direct batchelor\n"
    return HEAD.format(friction=0) + walls(**temperatures) + heat + fixes + commands, {"grains.data": data_file(*grains)}


REST = """fix rest all heat/rest {}
thermo_style custom step atoms f_heat f_heat[3] f_rest[1] f_rest[2] f_rest[3] f_rest[4]
thermo_modify format float %.12g
"""
DUMP = """dump T all custom {every} T.dump id x y f_Temp[0]
dump_modify T sort id format "%d %.17g %.17g %.17g"
"""
TOP = WALL.format(name="top", plane=f"yplane {SIDE}", heat=" temperature {}")


class Network:
    """The contacts of the packing, worked out here once more: pairs i, j and conductances h of Batchelor and O'Brien."""

    def __init__(self, radius, x, y):
        from scipy.spatial import cKDTree
        pairs = cKDTree(np.c_[x, y]).query_pairs(2 * radius.max(), output_type="ndarray")
        i, j = pairs[:, 0], pairs[:, 1]
        d = np.hypot(x[i] - x[j], y[i] - y[j])
        touch = d < radius[i] + radius[j]
        self.i, self.j, self.d = i[touch], j[touch], d[touch]
        a, b = radius[self.i], radius[self.j]
        self.contact = np.sqrt(a ** 2 - ((a ** 2 - b ** 2 + self.d ** 2) / (2 * self.d)) ** 2)
        self.overlap = (a + b - self.d) / (a + b)
        self.h = 2 * CONDUCTIVITY * self.contact
        self.capacity = CAPACITY * DENSITY * 4 / 3 * np.pi * radius ** 3
        self.radius, self.x, self.y = radius, x, y
        import scipy.sparse as sparse
        _, label = sparse.csgraph.connected_components(
            sparse.coo_matrix((np.ones(len(self.i)), (self.i, self.j)), (len(x), len(x))))
        self.used = label == np.argmax(np.bincount(label))  # others keep the temperature of the start

    def wall(self, distance):
        """Conductances to a wall."""
        return 2 * CONDUCTIVITY * np.sqrt(np.maximum(self.radius ** 2 - distance ** 2, 0.0))

    def affine(self):
        """Diffusivities x, y if temperatures were affine, m2/s: per thickness, sum h l_x^2 / sum m c."""
        return [np.sum(self.h * (a[self.i] - a[self.j]) ** 2) / self.capacity.sum() for a in (self.x, self.y)]

    def solve(self, axis):
        """Diffusivity between walls of `axis`, from the steady state by scipy's sparse direct solver: heat through them over
        the gradient in the middle 60 %, per heat capacity of the volume."""
        import scipy.sparse as sparse
        from scipy.sparse.linalg import spsolve
        along, n = (self.x, self.y)[axis], len(self.x)
        matrix = sparse.coo_matrix((np.r_[-self.h, -self.h], (np.r_[self.i, self.j], np.r_[self.j, self.i])), (n, n)).tocsr()
        load, walls_h = np.zeros(n), []
        for place, T in ((0.0, 1.0), (SIDE, 0.0)):
            walls_h.append(self.wall(along - place))
            load += walls_h[-1] * T
        diagonal = -np.asarray(matrix.sum(1)).ravel() + walls_h[0] + walls_h[1]
        alone = ~self.used
        T = spsolve((matrix + sparse.diags(diagonal + alone)).tocsc(), load)
        flow = np.sum(walls_h[0] * (1.0 - T))
        return diffusivity(along, T, flow, self.capacity, self.used), T


def fit(along, T, used):
    """(gradient, value at 0) of temperatures in the middle 60 %."""
    middle = used & (np.abs(along - SIDE / 2) < 0.3 * SIDE)
    slope, start = np.polyfit(along[middle], T[middle], 1)
    return -slope, start


def diffusivity(along, T, flow, capacity, used):
    """Heat flow / (gradient * heat capacity per length): both per height and thickness, which cancel."""
    return flow / (fit(along, T, used)[0] * capacity.sum() / SIDE)


def exact(x, y, t, kappa, wall=(0.0, 0.0)):
    """T = 300 + 100 X Y: cold sides and bottom, insulated top; diffusivities of x and y. `wall`: thickness of more material, m,
    that resists as the contacts with side walls and bottom do."""
    n = 2 * np.arange(200)[:, None] + 1
    width, height = SIDE + 2 * wall[0], SIDE + wall[1]
    X = np.sum(4 / (n * np.pi) * np.sin(n * np.pi * (x + wall[0]) / width) * np.exp(-(n * np.pi / width) ** 2 * kappa[0] * t), 0)
    Y = np.sum(4 / (n * np.pi) * np.sin(n * np.pi * (y + wall[1]) / (2 * height)) *
               np.exp(-(n * np.pi / (2 * height)) ** 2 * kappa[1] * t), 0)
    return COLD + (HOT - COLD) * X * Y


def main():
    report = Report("box of PFEM-DEM 3.3")
    settled, radius, x, y = settle()
    grains = (radius, x, y)
    n = Network(*grains)
    area = np.sum(np.pi * radius ** 2) / SIDE ** 2
    print(f"{len(radius)} grains, {len(n.i)} contacts, {np.sum(~n.used)} grains without a way to a wall, area {area:.4f}, settled in "
          f"{settled.seconds:.0f} s of processor time; overlap over sum of radii {n.overlap.mean():.4f}, Rc / R {np.mean(2 * n.contact / (radius[n.i] + radius[n.j])):.3f}")
    paper = exact(np.array([0.3]), np.array([0.6]), 10.0, 2 * [2000 / (2296.3 * 100)])[0]
    report.check("continuum with the paper's data: mid-top temperature at 10 s against its reference value 308.1721311745, K",
                 abs(paper - 308.17213117451433), 1e-9)
    report.check("grains that are not there", GRAINS - len(radius), 0)
    kappa, wall = conductivity(report, n, grains)
    cooling(report, n, grains, kappa, wall, area)
    speed(report, grains)
    sys.exit(report.write())


def conductivity(report, n, grains):
    """Steady states between two walls, by fix heat/rest and by scipy: (diffusivities of x and y, thickness that resists as the
    contacts with the walls do)."""
    found, thickness = [], []
    for axis, words, more in ((0, {"left": HOT, "right": COLD}, ""), (1, {"bottom": HOT}, TOP.format(COLD))):
        run = Run(f"box_steady_{'xy'[axis]}",
                  *conduct(grains, words, more + REST.format("solver steady"), DUMP.format(every=1) + "run 1\n"))
        T = np.array(run.dump("T.dump")[-1][1]["f_Temp[0]"])
        expected, reference = n.solve(axis)
        report.check(f"steady temperatures between walls of {'xy'[axis]}, over the difference of the walls",
                     np.max(np.abs((T - COLD) / (HOT - COLD) - reference)[n.used]), 1e-7, run.seconds)
        along = (n.x, n.y)[axis]
        kappa = diffusivity(along, T, np.sum(n.wall(along) * (HOT - T)), n.capacity, n.used)
        report.check(f"diffusivity {'xy'[axis]}: fix heat/rest against scipy", abs(kappa / expected - 1), 1e-6)
        gradient, start = fit(along, T, n.used)
        found.append(kappa)
        thickness.append(0.5 * ((HOT - COLD) / gradient - SIDE))
        whole = np.sum(n.wall(along) * (HOT - T)) * SIDE ** 2 / ((HOT - COLD) * n.capacity.sum())
        print(f"{'xy'[axis]}: diffusivity {kappa:.4e} m2/s, affine sum {n.affine()[axis]:.4e} ({n.affine()[axis] / kappa - 1:+.1%}), with "
              f"the contacts at the walls {whole:.4e}; a wall resists as {thickness[-1] * 1e3:.1f} mm of grains")
    return found, thickness


def cooling(report, n, grains, kappa, wall, area):
    """10 s from 400 K: the mid-top temperature and the field against the exact solution of the continuum."""
    cold = dict.fromkeys(WALLS, COLD)
    run = Run("box_cooling", *conduct(grains, cold, REST.format(""), DUMP.format(every=5000) + "timestep 1e-4\nrun 100000\n"))
    step = Run("box_cooling_implicit", *conduct(grains, cold, REST.format("solver implicit"),
                                                DUMP.format(every=50) + "timestep 1e-2\nrun 1000\n"))
    frames, coarse = run.dump("T.dump"), step.dump("T.dump")
    time = np.array([k * 1e-4 for k, _ in frames])
    top = int(np.argmin(np.hypot(n.x - SIDE / 2, n.y - SIDE)))
    field = np.array([frame["f_Temp[0]"] for _, frame in frames])
    report.check("implicit steps of 1e-2 s against explicit ones of 1e-4 s: mid-top temperature, K",
                 np.max(np.abs(field[:, top] - [frame["f_Temp[0]"][top] for _, frame in coarse])), 0.5, step.seconds)
    naive = CONDUCTIVITY / (area * DENSITY * CAPACITY)
    laws = {"homogenised (network), walls resist": (kappa, wall), "homogenised (network)": (kappa, (0, 0)),
            "homogenised (affine sum)": (n.affine(), (0, 0)), "of the grains' material": ((naive, naive), (0, 0))}
    curves = {}
    for law, values in laws.items():
        continuum = np.array([exact(n.x, n.y, t, *values) if t > 0 else np.full(len(n.x), HOT) for t in time])
        curves[law] = continuum[:, top]
        bound = {"homogenised (network), walls resist": 2.0, "homogenised (network)": 4.0}.get(law)
        report.check(f"mid-top temperature over 10 s, conductivity {law}: largest difference, K",
                     np.max(np.abs(field[:, top] - continuum[:, top])), bound, run.seconds)
        for t in (2.5, 10.0):
            k = int(np.argmin(np.abs(time - t)))
            report.check(f"temperatures at {t:g} s, conductivity {law}: root mean square difference, K",
                         np.sqrt(np.mean((field[k] - continuum[k])[n.used] ** 2)), None)
        print(f"{law}: diffusivity {np.mean(values[0]):.4e} m2/s, mid-top at 10 s {continuum[-1, top]:.2f} K (full DEM {field[-1, top]:.2f} K)")
    draw(report, n, time, field, top, curves)


def draw(report, n, time, field, top, curves):
    import matplotlib.pyplot as plt
    from matplotlib.collections import EllipseCollection
    figure, axes = plt.subplots(1, 3, figsize=(15, 4.2), width_ratios=(1, 1, 1.4))
    for axis, t in zip(axes, (2.5, 10.0)):
        k = int(np.argmin(np.abs(time - t)))
        disks = EllipseCollection(2 * n.radius, 2 * n.radius, 0 * n.radius, units="xy", offsets=np.c_[n.x, n.y],
                                  transOffset=axis.transData, array=field[k], cmap="inferno", clim=(COLD, HOT))
        axis.add_collection(disks)
        axis.set(xlim=(0, SIDE), ylim=(0, SIDE), aspect="equal", xlabel="x (m)", ylabel="y (m)", title=f"full DEM, {t:g} s")
        figure.colorbar(disks, ax=axis, label="T (K)", shrink=0.8)
    axes[2].plot(time, field[:, top], "ko", ms=4, label="full DEM, thermal only")
    for (law, curve), style in zip(curves.items(), ("-", "--", "-.", ":")):
        axes[2].plot(time, curve, style, label=f"continuum: {law}")
    axes[2].set(xlabel="time (s)", ylabel="T at the middle of the top (K)", xlim=(0, 10), ylim=(270, 405))
    axes[2].legend(fontsize=7, loc="lower left")
    figure.tight_layout()
    report.save(figure, "thermal_box")


def speed(report, grains):
    """Processor time of a step, and of a second, with mechanics and without: medians of 3 rounds in turn, less the set-up."""
    steps = {"mechanics": 1000, "rest": 20000}
    fixes = {"mechanics": "fix move all nve/sphere\n", "rest": REST.format("") + "timestep 1e-3\n"}
    times = {name: [] for name in steps}
    for _ in range(3):
        for name, count in steps.items():
            run, start = (Run(f"box_speed_{name}_{k}", *conduct(grains, dict.fromkeys(WALLS, COLD), fixes[name], f"run {k}\n"),
                              again=True) for k in (count, 0))
            times[name].append((run.seconds - start.seconds) / count)
            if name == "rest":
                limit = run.thermo[-1]["rest[1]"][-1]
    per_step = {name: float(np.median(value)) for name, value in times.items()}
    ratio = per_step["mechanics"] / per_step["rest"]
    same = ratio * 1e-3 / MECHANICS_STEP
    print(f"{per_step['mechanics'] * 1e6:.0f} and {per_step['rest'] * 1e6:.1f} microseconds a step; limit of the thermal step {limit:.3e} s, "
          f"of mechanics {MECHANICS_STEP:g} s: {ratio:.0f} times as fast per step, {same:.0f} times for the same simulated time")
    report.check("processor time of thermal-only over mechanics, per step", 1 / ratio, None)
    report.check("processor time of thermal-only over mechanics, same simulated time", 1 / same, 1 / 50)


if __name__ == "__main__":
    main()
