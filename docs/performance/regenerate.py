#!/usr/bin/env python3
"""Measures the tables and plots of docs/performance.md anew, and the times of contact in docs/effects.md.

    python3 docs/performance/regenerate.py [arguments of tests/others/peers.py]

Takes some 20 minutes with the other libraries and large meshes, 6 without; the machine should have nothing else to do. With
`--quick` two minutes, for a look at whether all runs.
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
SCALING = ["cargo", "run", "--quiet", "--release", "-p", "collided-tests", "--bin", "scaling", "--"]
PEERS = [sys.executable, "tests/others/peers.py"]


def output(command):
    return subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout.strip()


def replace(document, name, text):
    """What stands between two comments of a document."""
    path = ROOT / "docs" / document
    start, end = f"<!-- {name}, as measured -->\n", f"<!-- end of {name} -->"
    replaced, count = re.subn(f"{start}.*?{end}", lambda _: f"{start}{text}\n{end}", path.read_text(), flags=re.DOTALL)
    if count != 1:
        sys.exit(f"{path}: the comments around {name} are missing")
    path.write_text(replaced)


def only(table, work):
    lines = table.splitlines()
    return "\n".join(lines[:2] + [line for line in lines if line.startswith(f"| {work}")])


def main():
    quick = ["--quick"] if "--quick" in sys.argv else []
    machine, bodies, triangles, orders, stages = output(SCALING + quick).split("\n\n")
    table = output(PEERS + sys.argv[1:])
    found = {"the machine": machine, "peers": table, "bodies": bodies, "triangles": triangles, "orders": orders, "stages": stages}
    for name, text in found.items():
        replace("performance.md", name, text)
    replace("effects.md", "times of contact", only(table, "time of contact"))


main()
