"""Records 5,000 queries, and kills the recorder ten times on the way: memory stays flat, and no result is lost.

    python crates/posescope-python/soak.py [QUERIES]

It takes about a quarter of an hour. The test of kills, with less, is in tests/test_recordings.py.
"""

from __future__ import annotations

import json
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import List

import numpy as np

import posescope

KILLS = 10
MEMORY_EVERY = 250


def resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 2**20


def record(folder: Path, queries: int) -> None:
    """The recorder: goes on until there are so many queries, and prints its memory."""
    camera = posescope.Camera(150, 150, 119.5, 79.5, 240, 160)
    numbers = np.random.default_rng(1)
    cloud = numbers.uniform([-9, -2, 4], [9, 2, 30], (5_000, 3)).astype(np.float32)
    photos = numbers.integers(0, 256, (8, 160, 240), np.uint8)
    reference = posescope.Reference(photos[0], camera, np.eye(4), cloud)
    log = posescope.record(folder, resume=True, keep=3, waiting=10_000)
    frames = folder / "queries" / "frames.jsonl"
    results = folder / "results.jsonl"
    done = max(0, frames.read_bytes().count(b"\n") - 1)
    print("recording", flush=True)
    for number in range(done, queries):
        pose = np.eye(4)
        pose[0, 3] = 0.001 * number
        log.query(photos[number % 8], camera, pose, truth=np.eye(4), reference=reference, time=float(number))
        # As fast as verdicts are made, so that memory shows what grows and not what waits.
        while number - results.read_bytes().count(b"\n") > 50:
            time.sleep(0.02)
        if number % MEMORY_EVERY == 0:
            print(f"{number} {resident_mb():.0f}", flush=True)
    log.close()
    print(f"closed {resident_mb():.0f}", flush=True)


def lines(file: Path) -> List[bytes]:
    content = file.read_bytes()
    return content[: content.rfind(b"\n") + 1].splitlines()


def main(queries: int) -> None:
    chance = random.Random(0)
    with tempfile.TemporaryDirectory() as root:
        folder = Path(root) / "live"
        before: List[bytes] = []
        for kill in range(KILLS + 1):
            process = subprocess.Popen(
                [sys.executable, __file__, str(folder), str(queries)], stdout=subprocess.PIPE, text=True
            )
            assert process.stdout is not None
            assert process.stdout.readline() == "recording\n"
            if kill < KILLS:
                time.sleep(chance.uniform(1.0, 8.0))
                process.send_signal(signal.SIGKILL)
            said = process.stdout.read().split("\n")
            process.wait()
            found = lines(folder / "results.jsonl")
            assert found[: len(before)] == before, "a result was lost"
            assert len(posescope.Run.open(folder).rows()) == len(found)
            before = found
            print(f"run {kill + 1}: {len(found)} results; queries and memory [MB]: {'; '.join(filter(None, said))}")
        names = [json.loads(line)["query"] for line in before]
        assert names == [f"{number:06}" for number in range(queries)], "a query is missing"
        print(f"{queries} queries, {KILLS} kills: all results are there")


if __name__ == "__main__":
    if len(sys.argv) == 3:
        record(Path(sys.argv[1]), int(sys.argv[2]))
    else:
        main(int(sys.argv[1]) if len(sys.argv) == 2 else 5_000)
