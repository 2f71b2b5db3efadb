#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Grains for LIGGGHTS, cut out of a large 2D packing of dempm-pack.

   cut.py column PACKING DATA --density RHO --size LX LY --like PACKING --box X0 X1 Y0 Y1
   cut.py block  PACKING DATA --density RHO --size LX LY --slab S --axis x|y --box X0 X1 Y0 Y1 --groups FILE

column: grains that lie between x = 0 and LX with their whole disk, above y = 0 with their centre, so many that they have the mass of LX x LY
        filled with the packing --like; type 1. Below them a rough floor, two grains thick, that goes on to the end of the box by repeating
        the periodic packing: type 2.
block:  0 to LX times 0 to LY. Beyond both ends of --axis stand slabs of thickness S, rough walls or plates. Across it the packing stays
        periodic if LX or LY is 0, else grains with their centre inside are kept. FILE: commands that define the groups bottom and top
        (the slabs), left and right (the grains that are seen from the sides) and inner (all others); along x bottom and top are
        the slabs at the left and right.

Grains keep the places that they have in the packing; its tangential forces are lost."""
import argparse
import pathlib

import numpy as np


def read_packing(path):
    """(places in the cell with its lower corner at 0, radii, edges). The cell's slight shear, left by its compression, is dropped: that
    changes distances of neighbours by less than 1e-3 of them."""
    lines = pathlib.Path(path).read_text().splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith("grains "))
    count = int(lines[start].split()[1])
    cell = np.array([float(w) for w in next(line for line in lines if line.startswith("cell ")).split()[1:]]).reshape(3, 3)
    rows = np.array([[float(w) for w in line.split()] for line in lines[start + 1:start + 1 + count]])
    edges = np.diag(cell)[:2]
    return (rows[:, :2] % 1.0) * edges, rows[:, 3], edges


def fraction(packing):
    """Solid fraction, overlaps not removed."""
    _, radius, edges = read_packing(packing)
    return np.pi * np.sum(radius**2) / np.prod(edges)


def cut_column(packing, size, like, length):
    """Places, radii, types of a column on a rough floor that is `length` long."""
    place, radius, edges = read_packing(packing)
    thick = 4 * radius.mean()
    floor = place[:, 1] < thick
    copies = np.arange(-1, np.ceil(length / edges[0]) + 1)
    floor_x = (place[floor, 0] + copies[:, None] * edges[0]).ravel()
    floor_y, floor_r = np.tile(place[floor, 1] - thick, len(copies)), np.tile(radius[floor], len(copies))
    inside = (floor_x > -0.1 * size[0]) & (floor_x < length)
    x, y = place[:, 0], place[:, 1] - thick
    keep = np.flatnonzero((y >= 0) & (x >= radius) & (x <= size[0] - radius))
    keep = keep[np.argsort(y[keep])]
    filled = np.cumsum(np.pi * radius[keep] ** 2)
    wanted = fraction(like) * size[0] * size[1]
    if filled[-1] < wanted:
        raise SystemExit(f"{packing}: has {filled[-1]:.4g} m2 of grains for the column, wanted are {wanted:.4g} m2: a larger packing is needed")
    keep = keep[:np.searchsorted(filled, wanted) + 1]
    places = np.vstack([np.column_stack([x, y])[keep], np.column_stack([floor_x, floor_y])[inside]])
    return places, np.append(radius[keep], floor_r[inside]), np.append(np.ones(len(keep), int), np.full(inside.sum(), 2))


BLOCK = ("bottom", "top", "left", "right", "inner")


def cut_block(packing, size, slab, axis):
    """Places, radii, types and kinds (numbers in BLOCK) of a block between slabs, in the order of the kinds."""
    place, radius, edges = read_packing(packing)
    kind = np.full(len(radius), BLOCK.index("inner"))
    for a in range(2):
        margin = slab if a == axis else 0.0
        if size[a] + 2 * margin > edges[a]:
            raise SystemExit(f"{packing}: the block needs {size[a] + 2 * margin:g} m along {'xy'[a]}, the packing's cell has {edges[a]:g} m")
        if size[a]:
            place[:, a] -= 0.5 * (edges[a] - size[a])
    x, across = place[:, axis], place[:, 1 - axis]
    kind[x < 0], kind[x > size[axis]] = BLOCK.index("bottom"), BLOCK.index("top")
    keep = (x >= -slab) & (x <= size[axis] + slab)
    if size[1 - axis]:  # plates stick out
        keep &= (kind != BLOCK.index("inner")) | ((across >= 0) & (across <= size[1 - axis]))
    place, radius, kind = place[keep], radius[keep], kind[keep]
    if size[1 - axis]:
        for side, name in ((-1, "left"), (1, "right")):
            kind[find_skin(place, radius, kind == BLOCK.index("inner"), side, 1 - axis)] = BLOCK.index(name)
    order = np.argsort(kind, kind="stable")
    return place[order], radius[order], np.ones(len(order), int), kind[order]


def find_skin(place, radius, among, side, axis):
    """Numbers of the grains that rays along -side * axis meet first."""
    numbers = np.flatnonzero(among)
    depth, along, r = side * place[numbers, axis], place[numbers, 1 - axis], radius[numbers]
    seen = set()
    for ray in np.arange(along.min(), along.max(), 0.2 * r.min()):
        root = r**2 - (along - ray) ** 2
        if root.max() > 0:
            seen.add(numbers[np.argmax(np.where(root > 0, depth + np.sqrt(np.maximum(root, 0)), -np.inf))])
    return sorted(seen)


def write_groups(path, kind):
    """Groups by ranges of ids; kinds that do not occur are left out."""
    lines = []
    for k, name in enumerate(BLOCK):
        ids = np.flatnonzero(kind == k) + 1
        if len(ids):
            lines.append(f"group {name} id <> {ids[0]} {ids[-1]}")
    pathlib.Path(path).write_text("\n".join(lines) + "\n")


def write_data(path, grains, box, density, types):
    """A data file of LIGGGHTS, atom_style granular (id type diameter density x y z). `types`: of atoms that the file has room for."""
    place, radius, kind = grains[:3]
    thick = radius.max()
    lines = ["grains cut out of a packing of dempm-pack", "", f"{len(radius)} atoms", f"{types} atom types", "",
             f"{box[0]:.15g} {box[1]:.15g} xlo xhi", f"{box[2]:.15g} {box[3]:.15g} ylo yhi", f"{-thick:.15g} {thick:.15g} zlo zhi", "",
             "Atoms", ""]
    lines += [f"{k + 1} {t} {2 * r:.15g} {density:.15g} {x:.15g} {y:.15g} 0" for k, ((x, y), r, t) in enumerate(zip(place, radius, kind))]
    pathlib.Path(path).write_text("\n".join(lines) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("column", "block"))
    parser.add_argument("packing")
    parser.add_argument("data")
    parser.add_argument("--density", type=float, required=True)
    parser.add_argument("--size", nargs=2, type=float, required=True, metavar=("LX", "LY"))
    parser.add_argument("--like", metavar="PACKING")
    parser.add_argument("--slab", type=float, default=0.0)
    parser.add_argument("--axis", choices="xy", default="y")
    parser.add_argument("--box", nargs=4, type=float, required=True, metavar=("X0", "X1", "Y0", "Y1"))
    parser.add_argument("--types", type=int, default=1, help="atom types that a block's file has room for; all grains are of type 1")
    parser.add_argument("--groups", metavar="FILE")
    a = parser.parse_args()
    if a.what == "column" and not a.like:
        parser.error("a column needs --like")
    column = a.what == "column"
    grains = cut_column(a.packing, a.size, a.like, a.box[1]) if column else cut_block(a.packing, a.size, a.slab, "xy".index(a.axis))
    box, edges = list(a.box), read_packing(a.packing)[2]
    for k in range(2):
        if not a.size[k]:
            box[2 * k:2 * k + 2] = 0.0, edges[k]
    write_data(a.data, grains, box, a.density, 3 if column else a.types)
    if a.groups:
        write_groups(a.groups, grains[3])
    print(f"{a.data}: {len(grains[1])} grains")


if __name__ == "__main__":
    main()
