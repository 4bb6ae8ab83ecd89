#!/usr/bin/env python3
"""Ours beside parry, and beside FCL and Coal where they are, on the same work in the same run, as a table.

    python3 tests/others/peers.py [--libraries DIR] [--meshes DIR [--poses PATH]] [--pair NAME A B]... [--only WORK...]

Without arguments: the shipped meshes, generated poses, ours and parry. `--meshes` names a folder of meshes, `--poses` a file
`NAME.npy` of poses, (n, 2, 3, 4) f64, or a folder of such files. `--pair NAME A B` says of which two meshes NAME.npy is; it is not
needed for names of PAIRS below, nor where the folder has but one mesh or two. Beside NAME.npy, `NAME.meta.json` says under `cls` of
each pose whether it is 0, disjoint, 1, near, or 2, hit; `NAME_motion_lin.npy` and `NAME_motion_rot.npy`, (n, 2, 2, 3, 4), hold
motions; `many_1000.npy` and `many_5000.npy`, (steps, bodies, 3, 4), steps of low_poly_bunny. What is not there is generated; a pose
of which no class is said is disjoint where the boxes of the bodies are apart, by ours.

`--libraries` names a folder with the programs `bench_fcl` and `bench_coal`, which are not part of this project. In a working
directory with `../meshes/NAME.tri`, `../poses/NAME.npy` and `results/`, they take MODE NAME TAG A B ... and write a JSON file.

Each round asks all libraries all questions, one after the other; a ratio is one of figures of the same round.
"""

import argparse
import json
import shutil
import statistics
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
SHIPPED = ROOT / "daemon" / "meshes"
# Names of poses, and the meshes they are of.
PAIRS = {
    "suzanne_knight": ("suzanne", "decimated-knight"),
    "env_rob": ("env", "rob"),
    "bunny_bunny": ("stanford-bunny", "stanford-bunny"),
}
SHIPPED_PAIRS = {
    "env_rob": ("env", "rob"),
    "low_poly_bunny": ("low_poly_bunny", "low_poly_bunny"),
    "spot_spot": ("spot", "spot"),
}
CROWD_MESH = "low_poly_bunny"
ENDINGS = (".obj", ".stl", ".ply", ".off")
PROGRAMS = {"FCL": "bench_fcl", "Coal": "bench_coal"}
LIBRARIES = ["ours", "FCL", "Coal", "parry stock", "parry dual", "raw iceoryx2"]
CLASSES = ["disjoint", "near", "hit"]
WORKS = ["boolean", "batch", "smooth", "polygon-pairs", "distance", "time-of-contact", "crowd", "build", "shared-memory"]
NO_CONTACT = 2.0
SECONDS = 600


class Trouble(Exception):
    """What is wrong, for the person who runs this."""


class Row:
    """A line of the table: of each library a figure a round. Ours is compared with the fastest other, or with ours in `against`."""

    def __init__(self, work, unit, asked):
        self.work, self.unit, self.asked = work, unit, asked
        self.figures = {}
        self.remarks = {}
        self.against = None

    def add(self, library, figure, remark=None):
        if figure is not None:
            self.figures.setdefault(library, []).append(figure)
        if remark:
            self.remarks[library] = remark

    def ratios(self):
        others = [figures for library, figures in self.figures.items() if library != "ours"]
        if self.against:
            others = [self.against.figures["ours"]]
        rounds = zip(self.figures.get("ours", []), *others)
        return [ours / min(others) for ours, *others in rounds if others and min(others) > 0]

    def cells(self):
        figure = lambda library: number(statistics.median(self.figures[library])) if library in self.figures else "–"
        ratios = self.ratios()
        ratio = share(statistics.median(ratios)) if ratios else "–"
        spread = f"{share(min(ratios))}–{share(max(ratios))}" if ratios else "–"
        remarks = "; ".join(f"{library}: {remark}" for library, remark in self.remarks.items())
        asked = f"{self.asked} of 1 thread" if self.against else self.asked
        return [f"{self.work}, {self.unit}", *map(figure, LIBRARIES), ratio, str(asked), spread, remarks or "–"]


class Table:
    HEAD = ["work", *LIBRARIES, "ratio to the fastest", "asked", "spread of the ratio", "answers unlike ours"]

    def __init__(self):
        self.rows = {}

    def row(self, work, unit, asked):
        return self.rows.setdefault((work, unit), Row(work, unit, asked))

    def text(self):
        lines = [self.HEAD, ["---"] * len(self.HEAD), *(row.cells() for row in self.rows.values())]
        return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


class Run:
    """The programs, and the folders they work in."""

    def __init__(self, arguments, folder):
        self.arguments, self.folder = arguments, folder
        self.program = build_program()
        for name in ["meshes", "poses", "run/results"]:
            (folder / name).mkdir(parents=True)

    def command(self, *words):
        finished = subprocess.run([self.program, *map(str, words)], capture_output=True, text=True)
        if finished.returncode:
            raise Trouble("\n".join(finished.stderr.strip().splitlines()[:4]))
        return finished.stdout

    def ours_and_parry(self, *words):
        """What is said of the work, and the record of each library by its name."""
        limits = ["--passes", self.arguments.passes, "--seconds", self.arguments.seconds]
        about = json.loads(self.command(*words, *limits))
        return about, {record["library"]: record for record in about["libraries"]}

    def others(self, mode, name, *words):
        """What each other library wrote, by its name; libraries that have no such mode, or fail, are left out."""
        found = {}
        if not self.arguments.libraries:
            return found
        for library, program in PROGRAMS.items():
            results = self.folder / "run" / "results"
            for old in results.iterdir():
                old.unlink()
            command = [self.arguments.libraries.resolve() / program, mode, name, "run", *map(str, words)]
            try:
                subprocess.run(command, cwd=self.folder / "run", capture_output=True, timeout=SECONDS)
                [result] = results.iterdir()
                found[library] = json.loads(result.read_text())
            except (OSError, subprocess.TimeoutExpired, ValueError) as reason:
                if library == "FCL" or mode != "ccd":
                    print(f"{library}, {mode} {name}: {reason}", file=sys.stderr)
        return found

    def mesh(self, path, subdivide=0):
        """Exports a mesh for the others; its name there."""
        name = f"{path.stem}-{subdivide}" if subdivide else path.stem
        out = self.folder / "meshes" / f"{name}.tri"
        if self.arguments.libraries and not out.exists():
            self.command("export", "--mesh", path, "--subdivide", subdivide, "--out", out)
        return name

    def poses(self, kind, name, given, meshes, count):
        """The given file, or a generated one, among the poses; where it is."""
        out = self.folder / "poses" / f"{name}.npy"
        if out.exists():
            return out
        if given and given.exists():
            shutil.copy(given, out)
        else:
            words = [word for pair in zip(["--mesh-a", "--mesh-b"], meshes) for word in pair]
            self.command("generate", kind, *words, "--count", count, "--out", out)
        return out


class Pair:
    """Two meshes, and where their poses and motions are, if they are given."""

    def __init__(self, name, meshes, poses):
        self.name, self.meshes, self.poses = name, meshes, poses
        self.words = ["--mesh-a", meshes[0], "--mesh-b", meshes[1]]

    def beside(self, ending):
        return self.poses and self.poses.with_name(f"{self.name}{ending}.npy")

    def classes(self):
        """What is said of the poses: of each its class; none where nothing is."""
        path = self.poses and self.poses.with_name(f"{self.name}.meta.json")
        return json.loads(path.read_text()).get("cls") if path and path.exists() else None


def build_program():
    command = ["cargo", "build", "--release", "-p", "collided-tests", "--features", "parry", "--bin", "peers"]
    # The daemon, which the program starts.
    command += ["--bin", "collided-under-test", "--message-format=json"]
    built = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
    if built.returncode:
        raise Trouble("the benchmark does not build")
    executables = [message.get("executable") for message in map(json.loads, built.stdout.splitlines())]
    return next(path for path in executables if path and Path(path).stem == "peers")


def number(value):
    digits = 0 if value >= 100 else 1 if value >= 10 else 2 if value >= 1 else 3
    return f"{value:,.{digits}f}"


def share(value):
    return f"{value:.2f}" if value >= 0.1 else f"{value:.3f}"


def median(values):
    """As FCL's and Coal's programs take it: the upper one of two."""
    return sorted(values)[len(values) // 2] if values else None


def unlike(answers, ours, same):
    """A remark that counts answers that are not the same as ours, among those that both have."""
    count = sum(not same(theirs, own) for theirs, own in zip(answers, ours))
    return f"{count} of {min(len(answers), len(ours))}" if count else None


def nearly(share):
    return lambda theirs, ours: abs(theirs - ours) <= share * abs(ours)


def boolean(run, table, pair):
    poses = run.poses("poses", pair.name, pair.poses, pair.meshes, 1000)
    about, records = run.ours_and_parry("pair", "boolean", *pair.words, "--poses", poses)
    for library, found in run.others("bool", pair.name, *map(run.mesh, pair.meshes)).items():
        records[library] = {"us": found["t_us"], "answers": found["answers"]}
    ours, classes = records["ours"]["answers"], pair.classes() or about["classes"]
    for library, record in records.items():
        remark = unlike(record["answers"], ours, lambda theirs, own: theirs == own)
        total = statistics.fmean(record["us"])
        table.row(f"boolean, {pair.name}", "ms per 1,000 poses", 0.5).add(library, total, remark)
        for number_of_class, name in enumerate(CLASSES):
            times = [us for us, place in zip(record["us"], classes) if place == number_of_class]
            table.row(f"boolean, {pair.name}, {name}", "µs", 0.8).add(library, median(times))


def batch(run, table, pair):
    """Ours through shared memory, by a daemon with two threads; the others within a process, on one."""
    poses = run.poses("poses", pair.name, pair.poses, pair.meshes, 1000)
    _, records = run.ours_and_parry("batch", *pair.words, "--poses", poses)
    for library, found in run.others("bool", pair.name, *map(run.mesh, pair.meshes)).items():
        records[library] = {"us": found["t_us"], "answers": found["answers"]}
    row = table.row(f"batch, {pair.name}, {len(records['ours']['us']):,} poses", "µs a pose", 0.35)
    for library, record in records.items():
        remark = unlike(record["answers"], records["ours"]["answers"], lambda theirs, own: theirs == own)
        row.add(library, statistics.fmean(record["us"]), remark)


def shared_memory(run, table):
    steps = ["--steps", 200] if run.arguments.quick else []
    for step in json.loads(run.command("shared-memory", *steps))["steps"]:
        row = table.row(step["name"], "µs", step["asked"] or "–")
        row.add("ours", step["ours"])
        row.add("raw iceoryx2", step["raw"])


def smooth(run, table, pair):
    name = f"{pair.name}_smooth"
    poses = run.poses("smooth", name, None, pair.meshes, run.arguments.smooth_steps)
    _, records = run.ours_and_parry("pair", "smooth", *pair.words, "--poses", poses)
    for library, found in run.others("bool", name, *map(run.mesh, pair.meshes)).items():
        records[library] = {"us": found["t_us"], "answers": found["answers"]}
    row = table.row(f"smooth motion, {pair.name}, {run.arguments.smooth_steps:,} steps", "µs a step, mean", 0.1)
    for library, record in records.items():
        remark = unlike(record["answers"], records["ours"]["answers"], lambda theirs, own: theirs == own)
        row.add(library, statistics.fmean(record["us"]), remark)


def over_some_poses(run, table, pair, question, mode, values, same):
    """Questions that are asked of some poses only: the same ones for all, unless a library errs about which interfere."""
    poses = run.poses("poses", pair.name, pair.poses, pair.meshes, 1000)
    count = run.arguments.count
    about, records = run.ours_and_parry("pair", question, *pair.words, "--poses", poses, "--count", count)
    row = table.row(f"{question}, {pair.name}", "µs", 0.5)
    ours = dict(zip(about["poses"], records["ours"]["answers"]))
    for library, record in records.items():
        row.add(library, median(record["us"]), unlike(record["answers"], records["ours"]["answers"], same))
    for library, found in run.others(mode, pair.name, *map(run.mesh, pair.meshes), count).items():
        both = [(value, ours[pose]) for pose, value in zip(found["idx"], found[values]) if pose in ours]
        remark = unlike([theirs for theirs, _ in both], [own for _, own in both], same)
        row.add(library, found["us"] and found["us"]["median"], remark)


def polygon_pairs(run, table, pair):
    over_some_poses(run, table, pair, "polygon-pairs", "contacts", "count", nearly(0))


def distance(run, table, pair):
    over_some_poses(run, table, pair, "distance", "dist", "value", nearly(1e-6))


def time_of_contact(run, table, pair):
    for kind in ["lin", "rot"]:
        name = f"{pair.name}_motion_{kind}"
        motions = run.poses(kind, name, pair.beside(f"_motion_{kind}"), pair.meshes, 60)
        rigid = ["--rigid"] if kind == "rot" else []
        _, records = run.ours_and_parry("time-of-contact", *pair.words, "--motions", motions, *rigid)
        names = map(run.mesh, pair.meshes)
        for library, found in run.others("ccd", pair.name, *names, 60, kind, "naive").items():
            if "us" in found:
                records[library] = {"median": found["us"]["median"], "answers": found["toi"]}
        ours = records["ours"]["answers"]
        row = table.row(f"time of contact, {pair.name}, {kind}", "µs", 0.5)
        for library, record in records.items():
            figure = record.get("median") or median(record["us"])
            row.add(library, figure, contact_remark(record["answers"], ours))


def contact_remark(times, ours):
    """Contacts missed, invented, or more than a thousandth of the motion off; motions left open, or that it panicked at."""
    pairs = list(zip(times, ours))
    counts = {
        "missed": sum(theirs == NO_CONTACT and 0 <= own < NO_CONTACT for theirs, own in pairs),
        "invented": sum(0 <= theirs < NO_CONTACT and own == NO_CONTACT for theirs, own in pairs),
        "off": sum(min(theirs, own) >= 0 and max(theirs, own) < NO_CONTACT and abs(theirs - own) > 1e-3 for theirs, own in pairs),
        "without an answer": sum(theirs < 0 for theirs, _ in pairs),
    }
    found = [f"{count} {what}" for what, count in counts.items() if count]
    return f"{', '.join(found)} of {len(pairs)}" if found else None


def crowd(run, table, meshes, folder):
    mesh = meshes / f"{CROWD_MESH}.obj"
    mesh = mesh if mesh.exists() else SHIPPED / mesh.name
    run.mesh(mesh)
    for count in [1000, 5000]:
        given = folder and folder / f"many_{count}.npy"
        steps = run.poses("crowd", f"many_{count}", given, [mesh], count)
        few = steps.with_name(f"many_{count}_few.npy")
        few.write_bytes(few_moving(steps.read_bytes()))
        for moving, file, asked in [("all", steps, 0.4), ("1 %", few, 0.05)]:
            row = table.row(f"{count:,} bodies, {moving} moving", "ms a step", asked)
            of_crowd(run, table, mesh, row, (count, file))


def of_crowd(run, table, mesh, row, counted):
    count, file = counted
    words = ["crowd", "--mesh", mesh, "--steps", file, "--threads"]
    _, one = run.ours_and_parry(*words, 1)
    ours = one["ours"]["answers"]
    for library, record in one.items():
        row.add(library, median(record["us"]) / 1e3, unlike(record["answers"], ours, nearly(0)))
    for library, found in run.others("many", file.stem.removeprefix("many_")).items():
        row.add(library, found["step_ms"]["median"], unlike(found["hits"][1:], ours, nearly(0)))
    if file.stem == f"many_{count}":
        shared = table.row(f"{row.work}, 2 threads", row.unit, 0.56)
        shared.against = row
        for library, record in run.ours_and_parry(*words, 2)[1].items():
            shared.add(library, median(record["us"]) / 1e3)


def few_moving(npy):
    """Of the same bodies, one of a hundred moves in each step to where it is then, and stays there."""
    start = 10 + struct.unpack("<H", npy[8:10])[0]
    shape = npy[10:start].decode().split("(")[1].split(")")[0].split(",")
    steps, bodies, size = int(shape[0]), int(shape[1]), 8 * 12
    now = bytearray(npy[start : start + bodies * size])
    data = [bytes(now)]
    for step in range(1, steps):
        for body in range(step % 100, bodies, 100):
            there = start + (step * bodies + body) * size
            now[body * size : (body + 1) * size] = npy[there : there + size]
        data.append(bytes(now))
    return npy[:start] + b"".join(data)


def build(run, table, pair):
    """The second mesh of the pair, and the same cut into about a million triangles."""
    mesh = pair.meshes[1]
    about, _ = run.ours_and_parry("build", "--mesh", mesh)
    times = 0
    while about["triangles"] * 4**times < 700_000:
        times += 1
    for subdivide in [0] if run.arguments.quick else [0, times]:
        about, records = run.ours_and_parry("build", "--mesh", mesh, "--subdivide", subdivide)
        triangles = about["triangles"]
        found = {name: (record["us"][0] / 1e3, record["answers"][0]) for name, record in records.items()}
        for library, result in run.others("build", run.mesh(mesh, subdivide)).items():
            found[library] = (result["ms"]["min"], (result["mem_usage_mb"] or result["rss_delta_mb"]) * 1e6)
        for library, (time, size) in found.items():
            table.row(f"build, {triangles:,} triangles", "ms", 0.5).add(library, time)
            table.row(f"memory, {triangles:,} triangles", "bytes a triangle", 0.8).add(library, size / triangles)


def meshes_in(folder):
    return {path.stem: path for path in sorted(folder.iterdir()) if path.suffix.lower() in ENDINGS}


def pairs_of(arguments):
    """The pairs of meshes, by what was given."""
    meshes = meshes_in(arguments.meshes)
    names = {name: (a, b) for name, a, b in arguments.pair}
    known = {**PAIRS, **names}
    if arguments.poses is None:
        default = SHIPPED_PAIRS if arguments.meshes == SHIPPED else {name: (name, name) for name in meshes}
        files = {name: None for name in names or default}
        known = {**default, **names}
    elif arguments.poses.is_dir():
        files = {path.stem: path for path in sorted(arguments.poses.glob("*.npy")) if path.stem in (names or known)}
    else:
        files = {arguments.poses.stem: arguments.poses}
        if len(meshes) <= 2:
            known.setdefault(arguments.poses.stem, (min(meshes), max(meshes)))
    return [Pair(name, paths(name, known, meshes), file) for name, file in files.items()]


def paths(name, known, meshes):
    if name not in known:
        raise Trouble(f"{name}: of which meshes? Give --pair {name} A B, with names among {', '.join(meshes)}")
    for mesh in known[name]:
        if mesh not in meshes:
            raise Trouble(f"{name}: there is no mesh {mesh} among {', '.join(meshes)}")
    return [meshes[mesh] for mesh in known[name]]


def one_round(run, table, pairs):
    arguments = run.arguments
    asked = [("boolean", boolean), ("batch", batch), ("polygon-pairs", polygon_pairs), ("distance", distance)]
    for work, function in [*asked, ("time-of-contact", time_of_contact)]:
        for pair in pairs if work in arguments.only else []:
            function(run, table, pair)
    largest = max(pairs, key=lambda pair: pair.meshes[1].stat().st_size)
    for work, function in [("smooth", smooth), ("build", build)]:
        if work in arguments.only:
            function(run, table, largest)
    if "crowd" in arguments.only:
        folder = arguments.poses and (arguments.poses if arguments.poses.is_dir() else arguments.poses.parent)
        crowd(run, table, arguments.meshes, folder)
    if "shared-memory" in arguments.only:
        shared_memory(run, table)


def parsed():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--libraries", type=Path, help="where bench_fcl and bench_coal are")
    parser.add_argument("--meshes", type=Path, default=SHIPPED, help="folder of meshes")
    parser.add_argument("--poses", type=Path, help="file or folder of poses")
    parser.add_argument("--pair", nargs=3, action="append", default=[], metavar=("NAME", "A", "B"))
    parser.add_argument("--only", nargs="+", choices=WORKS, default=WORKS, metavar="WORK", help=" ".join(WORKS))
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--passes", type=int, default=3, help="passes of ours and parry within a round")
    parser.add_argument("--seconds", type=float, default=10, help="ours or parry is stopped when a pass takes longer")
    parser.add_argument("--count", type=int, default=100, help="poses for polygon pairs and distance")
    parser.add_argument("--smooth-steps", type=int, default=10_000)
    parser.add_argument("--quick", action="store_true", help="one round, no mesh of a million triangles, nothing that takes long")
    arguments = parser.parse_args()
    if arguments.quick:
        arguments.rounds = 1
        arguments.seconds = min(arguments.seconds, 3)
    return arguments


def main():
    arguments = parsed()
    table = Table()
    try:
        pairs = pairs_of(arguments)
        if not pairs:
            raise Trouble("no pair of meshes: see --help")
        with tempfile.TemporaryDirectory() as name:
            run = Run(arguments, Path(name))
            for done in range(arguments.rounds):
                one_round(run, table, pairs)
                print(f"round {done + 1} of {arguments.rounds} done", file=sys.stderr)
    except Trouble as trouble:
        sys.exit(f"peers: {trouble}")
    print(table.text())


main()
