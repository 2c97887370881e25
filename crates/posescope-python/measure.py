"""What the package costs: import, overhead of a call, threads, memory, Ctrl-C, live logging.

    python crates/posescope-python/measure.py [WHEEL]

Run it on an idle machine, with the optimised wheel installed.
"""

from __future__ import annotations

import os
import resource
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Callable, List

import numpy as np

import posescope


def seconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def say(what: str, value: float, unit: str, limit: str) -> None:
    print(f"{what:<58} {value:9.3f} {unit:<4} at most {limit}")


def import_time() -> None:
    code = "import time; start = time.perf_counter(); import posescope; print(time.perf_counter() - start)"
    took = [float(subprocess.check_output([sys.executable, "-c", code])) for _ in range(5)]
    say("import, with numpy", statistics.median(took), "s", "0.3 s")


def large_pair() -> "tuple[np.ndarray, posescope.Camera, np.ndarray, np.ndarray]":
    random = np.random.default_rng(0)
    photo = random.integers(0, 256, (376, 1241), np.uint8)
    camera = posescope.Camera(718.9, 718.9, 607.2, 185.2, 1241, 376)
    cloud = random.uniform([-20, -2, 4], [20, 2, 60], (120_000, 3)).astype(np.float32)
    return photo, camera, np.eye(4), cloud


def overhead() -> None:
    """The whole call from arrays to an answer, less the time of the work in Rust."""
    photo, camera, pose, cloud = large_pair()
    took: List[float] = []
    for _ in range(30):
        start = time.perf_counter()
        query = posescope.Query(photo, camera)
        reference = posescope.Reference(photo, camera, pose, cloud)
        # One hypothesis: the work itself is short.
        result = posescope.localize(
            query, reference, method="fb", matches=(np.zeros((0, 2)), np.zeros((0, 2))), threads=1
        )
        took.append(time.perf_counter() - start - result.seconds)
    say("overhead of a call, 1241 x 376 px, 120,000 points, median", 1e3 * statistics.median(took), "ms", "2 ms")
    say("the same, worst of 30", 1e3 * max(took), "ms", "")


def two_threads(street: posescope.Scene) -> None:
    query, reference = street.query("70"), street.reference("62")

    def work() -> None:
        for _ in range(10):
            posescope.localize(query, reference, method="mi", threads=1)

    work()
    alone = min(seconds(work) for _ in range(3))
    both: List[float] = []
    for _ in range(3):
        threads = [threading.Thread(target=lambda: both.append(seconds(work))) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    best = min(max(pair) for pair in zip(both[::2], both[1::2]))
    say("two Python threads with threads=1, to one", best / alone, "x", "1.15")


def memory() -> None:
    random = np.random.default_rng(1)
    camera = posescope.Camera(150, 150, 119.5, 79.5, 240, 160)
    photo = random.integers(0, 256, (160, 240), np.uint8)
    cloud = random.uniform([-9, -2, 4], [9, 2, 30], (5_000, 3)).astype(np.float32)

    def work() -> None:
        query = posescope.Query(photo, camera)
        posescope.localize(query, posescope.Reference(photo, camera, np.eye(4), cloud), method="fb").to_dict()

    def resident() -> float:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        return pages * resource.getpagesize() / 2**20

    for _ in range(100):
        work()
    before = resident()
    for _ in range(1000):
        work()
    say("memory after 1,000 calls, less before", resident() - before, "MB", "flat")


def ctrl_c(street: posescope.Scene) -> None:
    query, reference = street.query("70"), street.reference("62")
    late: List[float] = []
    for wait in np.linspace(0.05, 0.5, 10):
        sent: List[float] = []

        def press(wait: float = float(wait), sent: List[float] = sent) -> None:
            time.sleep(wait)
            sent.append(time.perf_counter())
            os.kill(os.getpid(), signal.SIGINT)

        thread = threading.Thread(target=press)
        try:
            thread.start()
            posescope.localize(query, reference, method="mi", radius=200)
        except KeyboardInterrupt:
            late.append(time.perf_counter() - sent[0])
        thread.join()
    say("from Ctrl-C to the exception, worst of 10", 1e3 * max(late), "ms", "50 ms")


def live(street: posescope.Scene) -> None:
    random = np.random.default_rng(0)
    small = random.integers(0, 256, (376, 1241), np.uint8)
    large = random.integers(0, 256, (1080, 1920, 3), np.uint8)
    pose = street.query("70").truth
    for photo in (small, large):
        height, width = photo.shape[:2]
        camera = posescope.Camera(700, 700, (width - 1) / 2, (height - 1) / 2, width, height)
        took: List[float] = []
        with tempfile.TemporaryDirectory() as folder:
            with posescope.record(Path(folder) / "live", street, keep=0, waiting=4) as log:
                for _ in range(100):
                    took.append(seconds(lambda: log.query(photo, camera, pose)))
                    time.sleep(1 / 30)
        size = f"{width} x {height} px{', colour' if photo.ndim == 3 else ''}"
        say(f"log.query at 30 Hz, {size}, median", 1e3 * statistics.median(took), "ms", "1 ms")
        say(f"log.query at 30 Hz, {size}, 99 of 100", 1e3 * sorted(took)[98], "ms", "")


def queue() -> None:
    """What 150 photos of noise at 30 Hz take, which no verdict can follow."""
    random = np.random.default_rng(0)
    photos = random.integers(0, 256, (3, 1080, 1920, 3), np.uint8)
    camera = posescope.Camera(700, 700, 959.5, 539.5, 1920, 1080)
    reference = posescope.Reference(photos[0], camera, np.eye(4), np.ones((9, 3)))
    resident = lambda: int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 2**20  # noqa: E731
    before = most = resident()
    with tempfile.TemporaryDirectory() as folder:
        with posescope.record(Path(folder) / "live", keep=0, waiting=8, memory_mb=64) as log:
            for number in range(150):
                log.query(photos[number % 3], camera, np.eye(4), reference=reference)
                time.sleep(1 / 30)
                most = max(most, resident())
    say("memory of 150 photos of 6 MB at 30 Hz, memory_mb=64", most - before, "MB", "64 MB and a verdict's own")


def main() -> None:
    for wheel in sys.argv[1:]:
        say("wheel", os.path.getsize(wheel) / 2**20, "MB", "60 MB")
    import_time()
    street = posescope.Scene.street()
    overhead()
    two_threads(street)
    ctrl_c(street)
    live(street)
    queue()
    memory()


if __name__ == "__main__":
    main()
