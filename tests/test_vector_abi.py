# SPDX-License-Identifier: GPL-2.0-or-later
"""No clone (function attribute target_clones) hands a vector by value to code that is compiled for the plain processor, or takes one
from it: such calls use other registers on either side, and gcc only warns of the first one in a file (-Wpsabi, switched off).

Without optimization gcc inlines nothing but what is always_inline: its dump then holds every call that could ever remain."""
import concurrent.futures
import os
import platform
import re

import pytest

from conftest import ROOT, execute

CLONE = re.compile(r"\.(avx2|arch_x86_64_v\d)\b")
FUNCTION = re.compile(r"^;; Function (\S+) \(.*\)$", re.M)
COMMAND = [os.environ.get("CC", "gcc"), "-std=c17", "-Wno-psabi", "-w", "-O0", "-S", "-o", os.devnull, "-fopenmp", "-x", "c",
           "-fdump-tree-optimized=/dev/stdout"]
CLONES = '__attribute__((target_clones("avx2", "default"))) '
VECTOR = "typedef double Vec __attribute__((vector_size(32)));\n"


def functions(source):
    """{name: (its head, its body)} of what gcc makes of a C file."""
    code, dump = execute([*COMMAND, source])
    assert code == 0, dump[-2000:]
    parts = FUNCTION.split(dump)[1:]
    found = {}
    for name, text in zip(parts[::2], parts[1::2]):
        head, _, body = text.partition("\n{")
        found[name] = head.strip(), body
    return found


def takes_vectors(head, types):
    """By value, also as its result."""
    return re.search(rf"\b(?:{'|'.join(types)}|vector\(\d+\)[\w ]*?) (?:\w+(?= \()|\w+(?=[,)]))", head) is not None


def mistakes(sources, types):
    """(clone, function it calls), and how many clones and functions of vectors there are."""
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        files = list(pool.map(functions, sources))
    plain = {name for file in files for name, (head, _) in file.items() if not CLONE.search(name) and takes_vectors(head, types)}
    clones = [(name, body) for file in files for name, (_, body) in file.items() if CLONE.search(name)]
    calls = [(name, callee) for name, body in clones for callee in plain if re.search(rf"\b{callee} \(", body)]
    return calls, len(clones), len(plain)


x86 = pytest.mark.skipif(platform.machine() != "x86_64", reason="clones are made for x86-64")


@x86
def test_vectors_stay_with_code_of_one_kind():
    headers = "".join(path.read_text() for path in (ROOT / "src" / "mpm").glob("*.h"))
    types = re.findall(r"typedef [\w ]+? (\w+) __attribute__\(\(vector_size", headers)
    calls, clones, plain = mistakes(sorted((ROOT / "src" / "mpm").glob("*.c")), types)
    assert len(types) >= 2 and clones >= 20 and plain >= 3
    assert calls == []


def test_only_the_mpm_has_clones_and_vectors():
    """The RVE kernels are compiled as a whole for each kind of processor."""
    others = [path for kind in ("c", "h", "cpp") for path in (ROOT / "src").rglob(f"*.{kind}") if path.parent.name != "mpm"]
    assert len(others) > 50
    assert [path.name for path in others if re.search(r"target_clones|vector_size|MpmVec\b", path.read_text())] == []


@x86
@pytest.mark.parametrize("function, call, mistaken", [
    ("static void give(double *x, const Vec v) { x[0] += v[0]; }", "give(x, v)", True),
    ("static Vec take(double *x, Vec *unused) { return unused[0] * x[0]; }", "v = take(x, &v)", True),
    ("static void hand(double *x, const Vec *v) { x[0] += (*v)[0]; }", "hand(x, &v)", False),
    ("static inline __attribute__((always_inline)) void keep(double *x, Vec v) { x[0] += v[0]; }", "keep(x, v)", False),
], ids=["argument", "result", "address", "inlined"])
def test_the_check_finds(function, call, mistaken, tmp_path):
    source = tmp_path / "one.c"
    source.write_text(VECTOR + function + "\n" + CLONES + "void clone(double *x) {\n  Vec v = {x[0], x[1], x[2], x[3]};\n"
                      f"  {call};\n  x[1] = v[1];\n}}\n")
    calls, clones, _ = mistakes([source], ["Vec"])
    assert clones == 1 and bool(calls) == mistaken
