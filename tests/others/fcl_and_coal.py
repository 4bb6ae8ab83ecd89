#!/usr/bin/env python3
"""FCL and Coal on the valid cases of tests/data/hardcases/static.json, as a table.

    python3 tests/others/fcl_and_coal.py DIRECTORY

DIRECTORY holds the programs `bench_fcl` and `bench_coal`. They are not part of this project; what is asked of them is
`bench_X bool POSES TAG A B`: in a working directory with `../meshes/A.tri` (u32 vertex and triangle counts, f64 positions,
u32 corners; little-endian), `../poses/POSES.npy` (f64, 3 rows of 4 for A, then for B) and `results/`, they build an
OBB-RSS tree of each mesh, ask for one contact and write `results/*.json` with `answers`, 1 where the meshes interfere.

Each library gets the same triangles: the rounded world vertices of a case, in the triangulation of the table, placed by the
identity. What is counted is the verdict about surfaces alone. Each question has a process of its own, since some end it.
"""

import argparse
import json
import struct
import subprocess
import tempfile
from pathlib import Path

STATIC = Path(__file__).resolve().parent.parent / "data" / "hardcases" / "static.json"
PROGRAMS = {"FCL": "bench_fcl", "Coal": "bench_coal"}
KINDS = ["right", "missed", "invented", "A-B not B-A", "refused", "crashed"]
SECONDS = 60


def world_vertices(mesh, rows):
    """`((m0*x + m1*y) + m2*z) + m3` per row: Python rounds every operation to nearest in f64 and never fuses two."""
    return [[((m0 * x + m1 * y) + m2 * z) + m3 for m0, m1, m2, m3 in rows] for x, y, z in mesh["vertices"]]


def write_mesh(path, vertices, triangles):
    numbers = [coordinate for vertex in vertices for coordinate in vertex]
    corners = [corner for triangle in triangles for corner in triangle]
    header = struct.pack("<2I", len(vertices), len(triangles))
    path.write_bytes(header + struct.pack(f"<{len(numbers)}d", *numbers) + struct.pack(f"<{len(corners)}I", *corners))


def write_identities(path):
    """One pose of two bodies, in NumPy's format, version 1.0."""
    identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1, 2, 3, 4), }".ljust(117) + b"\n"
    path.write_bytes(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + struct.pack("<24d", *identity * 2))


def ask(program, directory, first, second):
    """True or False, or why there is no answer: `refused` (an exception, an error status) or `crashed` (a signal, no end)."""
    results = directory / "run" / "results"
    for old in results.iterdir():
        old.unlink()
    command = [program, "bool", "still", "one", first, second]
    try:
        run = subprocess.run(command, cwd=directory / "run", capture_output=True, text=True, timeout=SECONDS)
    except subprocess.TimeoutExpired:
        return "crashed"
    if "terminate called after throwing" in run.stderr or run.returncode > 0:
        return "refused"
    if run.returncode < 0:
        return "crashed"
    [result] = results.iterdir()
    [answer] = json.loads(result.read_text())["answers"]
    return bool(answer)


def add(tally, case, there, back):
    interfering = case["expected"]["surface_contact"]
    if "crashed" in (there, back):
        tally["crashed"].append(case["id"])
        return
    if there != back:
        tally["A-B not B-A"].append(case["id"])
    if there == "refused":
        tally["refused"].append(case["id"])
    elif there == interfering:
        tally["right"].append(case["id"])
    else:
        tally["invented" if there else "missed"].append(case["id"])


def tally_of(program, cases, directory):
    tally = {kind: [] for kind in KINDS}
    for case in cases:
        for body in "ab":
            mesh = case[body]
            write_mesh(directory / "meshes" / f"{body}.tri", world_vertices(mesh, case["m" + body]), mesh["triangles"])
        add(tally, case, ask(program, directory, "a", "b"), ask(program, directory, "b", "a"))
    return tally


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("directory", type=Path, help="where bench_fcl and bench_coal are")
    programs = parser.parse_args().directory.resolve()
    cases = [case for case in json.loads(STATIC.read_text())["cases"] if case["expected"]["valid"]]
    tallies = {}
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        for folder in ["meshes", "poses", "run/results"]:
            (directory / folder).mkdir(parents=True)
        write_identities(directory / "poses" / "still.npy")
        for library, program in PROGRAMS.items():
            tallies[library] = tally_of(programs / program, cases, directory)
    print(f"{len(cases)} valid cases".ljust(18), *(kind.rjust(12) for kind in KINDS))
    for library, tally in tallies.items():
        print(library.ljust(18), *(str(len(tally[kind])).rjust(12) for kind in KINDS))
    for library, tally in tallies.items():
        for kind in KINDS[1:]:
            if tally[kind]:
                print(f"{library}, {kind}: {', '.join(tally[kind])}")


main()
