#!/usr/bin/env python3
# /// script
# requires-python = ">=3.10"
# dependencies = ["numpy==2.4.6", "opencv-contrib-python-headless==4.13.0.92", "faiss-cpu==1.15.1", "poselib==2.0.5"]
# ///
"""Times posescope and others on the same inputs in one run, and prints the ratios.

    uv run studies/peers/peers.py           # or: pip install the packages named above, then python3 …
    … [--scene PATH --pair QUERY,REFERENCE] [--rounds N] [--only STAGE]

The inputs are exported by `studies peers`: a pair of the built-in street, or of any scene. With
POSESCOPE_DATA in the environment the KITTI pair 003823 <- 003814 in it is measured too. In each round ours and the
others run one after the other, each on one thread; what is printed is the median of processor times and of the
rounds' ratios, with the quality of both answers beside it. Nothing is asserted.

A C++ compiler times the plain loops of loops.cpp; with dlib's headers, its SURF. What is missing is said and left out.
"""

import argparse
import json
import os
import platform
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent


class Server:
    """A program that answers the name of a stage with what it took."""

    def __init__(self, command, environment=None):
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment)

    def __call__(self, stage):
        self.process.stdin.write(stage + "\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            sys.exit(f"error: {self.process.args[0]} ended at {stage}")
        answer = json.loads(line)
        return answer["seconds"], answer["items"], answer["outcome"]

    def close(self):
        self.process.stdin.close()
        self.process.wait()


def timed(work):
    begun = time.process_time()
    made = work()
    return time.process_time() - begun, made


def studies():
    """Builds posescope's side, optimised, and says where it is."""
    command = ["cargo", "build", "--release", "-p", "posescope-studies", "--message-format=json"]
    built = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    messages = map(json.loads, built.stdout.splitlines())
    return next(message["executable"] for message in messages if message.get("executable"))


def compiled(name, folder, *options):
    """The program made of one C++ file; None where that cannot be."""
    compiler = shutil.which("c++") or shutil.which("g++") or shutil.which("clang++")
    if compiler is None:
        print("left out: no C++ compiler")
        return None
    program = folder / name
    command = [compiler, "-O3", "-march=native", "-DNDEBUG", "-std=c++17", HERE / f"{name}.cpp", "-o", program, *options]
    made = subprocess.run(command, capture_output=True, text=True)
    if made.returncode != 0:
        print(f"left out: {name}.cpp does not compile here: {made.stderr.splitlines()[0]}")
        return None
    return program


def faiss_matching(folder):
    import faiss
    import numpy as np

    faiss.omp_set_num_threads(1)
    query, reference = (np.fromfile(folder / f"{name}_descriptors.f32", np.float32).reshape(-1, 64) for name in ("query", "reference"))

    def run():
        def search():
            index = faiss.IndexFlatL2(64)
            index.add(reference)
            return index.search(query, 2)[1]

        seconds, nearest = timed(search)
        return seconds, len(query) * len(reference), {"sum_of_nearest": int(nearest[:, 0].sum())}

    return {f"faiss {version('faiss-cpu')}": run}


def opencv_matching(folder):
    import cv2
    import numpy as np

    cv2.setNumThreads(1)
    query, reference = (np.fromfile(folder / f"{name}_descriptors.f32", np.float32).reshape(-1, 64) for name in ("query", "reference"))
    matcher = cv2.BFMatcher(cv2.NORM_L2)

    def run():
        seconds, found = timed(lambda: matcher.knnMatch(query, reference, 2))
        return seconds, len(query) * len(reference), {"sum_of_nearest": sum(best[0].trainIdx for best in found)}

    return {f"OpenCV {cv2.__version__} BFMatcher": run}


def opencv_sift(folder, meta):
    import cv2
    import numpy as np

    cv2.setNumThreads(1)
    count = len(sift_of(folder, "reference")[0])

    def detector(most):
        # OpenCV divides its threshold by the three scales of an octave: posescope's is 0.012.
        return cv2.SIFT_create(nfeatures=most, contrastThreshold=0.036)

    def image(name, width, height):
        return np.fromfile(folder / f"{name}.u8", np.uint8).reshape(height, width)

    reference, warped = image("reference", meta["width"], meta["height"]), image("warped", *meta["warped"])

    def features(photo):
        keypoints, descriptors = detector(0).detectAndCompute(photo, None)
        order = np.argsort([-keypoint.response for keypoint in keypoints], kind="stable")
        return np.array([keypoints[i].pt for i in order]), np.sqrt(descriptors / descriptors.sum(1, keepdims=True))[order]

    outcome = repeated(features(reference), features(warped), meta)

    def run():
        sift = detector(count)
        seconds, found = timed(lambda: sift.detectAndCompute(reference, None))
        return seconds, len(found[0]), outcome

    return {f"OpenCV {cv2.__version__} SIFT": run}


def sift_of(folder, name):
    """Positions and descriptors of ours, the strongest first."""
    import numpy as np

    numbers = np.fromfile(folder / f"{name}_sift.f32", np.float32).reshape(-1, 130)
    return numbers[:, :2], numbers[:, 2:]


def repeated(of_image, of_warped, meta, count=2000):
    """How many of the strongest are found again in the image turned by 15° and enlarged 1.3 times, and how many of the
    matches of ratio 0.8 are right."""
    import numpy as np

    (points, descriptors), (there, others) = [(points[:count], descriptors[:count]) for points, descriptors in (of_image, of_warped)]
    warp = np.array(meta["to_warped"]).reshape(2, 3)
    truth = points @ warp[:, :2].T + warp[:, 2]
    apart = np.sqrt(((truth[:, None] - there[None]) ** 2).sum(2))
    distances = 2 - 2 * descriptors @ others.T
    nearest = np.argsort(distances, axis=1)[:, :2]
    first, second = np.take_along_axis(distances, nearest, 1).T
    passed = first < 0.8**2 * second
    right = np.take_along_axis(apart, nearest[:, :1], 1)[:, 0] < 3
    return {"repeated": float((apart.min(1) < 2).mean()), "right": float(right[passed].mean()), "recall": float((right & passed).mean())}


def poses(folder, meta, case):
    import numpy as np

    correspondences = int(case.split("_")[2])
    numbers = np.fromfile(folder / f"{case}.f64").reshape(meta["trials"], 12 + 5 * correspondences)
    for row in numbers:
        truth, rest = row[:12].reshape(3, 4), row[12:].reshape(-1, 5)
        yield truth, np.ascontiguousarray(rest[:, :2]), np.ascontiguousarray(rest[:, 2:])


def judged(found, truths):
    """As posescope judges its own: how many are within 0.3 m, and the median distance."""
    import numpy as np

    distances = []
    for pose, truth in zip(found, truths):
        if pose is None:
            distances.append(float("inf"))
            continue
        rotation, translation = pose
        distances.append(float(np.linalg.norm(rotation.T @ translation - truth[:, :3].T @ truth[:, 3])))
    distances.sort()
    return {"found": sum(distance < 0.3 for distance in distances), "median_m": distances[len(distances) // 2]}


def poselib_poses(folder, meta, case):
    import poselib

    trials = list(poses(folder, meta, case))
    camera = {"model": "PINHOLE", "width": meta["width"], "height": meta["height"], "params": meta["camera"]}
    options = {
        "max_reproj_error": meta["inlier_px"],
        "success_prob": meta["confidence"],
        "max_iterations": meta["most_trials"],
        "min_iterations": 50,
    }

    def run():
        def solve():
            answers = []
            for _, pixels, points in trials:
                pose, _ = poselib.estimate_absolute_pose(pixels, points, camera, options, {})
                answers.append((pose.R, pose.t))
            return answers

        seconds, found = timed(solve)
        return seconds, len(trials), judged(found, [truth for truth, _, _ in trials])

    return {f"PoseLib {version('poselib')}": run}


def versions():
    def first_line(*command):
        return subprocess.run(command, capture_output=True, text=True).stdout.partition("\n")[0] if shutil.which(command[0]) else None

    model = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), platform.processor())
    commit = first_line("git", "-C", str(ROOT), "rev-parse", "--short", "HEAD")
    return {"processor": model, "cores": os.cpu_count(), "rust": first_line("rustc", "--version"), "c++": first_line("c++", "--version"), "commit": commit}


def measure(program, environment, folder, only, rounds):
    meta = json.loads((folder / "meta.json").read_text())
    width, height = str(meta["width"]), str(meta["height"])
    ours = Server([program, "peers"], environment)
    servers = [ours]
    loops = dlib = None
    if built := compiled("loops", folder):
        loops = Server([built, folder, width, height, *map(str, meta["camera"])])
        servers.append(loops)
    if built := compiled("dlib_surf", folder, "-ldlib", "-lblas"):
        dlib = Server([built, folder / "reference.u8", width, height, "30"])
        servers.append(dlib)

    def of(server, stage):
        return (lambda: server(stage)) if server else None

    # Stage, what it is counted by, ours, theirs.
    stages = [
        ("both costs, 1 px", "hypothesis", "both_1", {"C++ loop, no depth test": of(loops, "plain_1"), "C++ loop, depth test": of(loops, "depth_1")}),
        ("mutual information, 1 px", "hypothesis", "mi_1", {"C++ loop, both costs, no depth test": of(loops, "plain_1")}),
        ("photometric error, 1 px", "hypothesis", "pm_1", {"C++ loop, both costs, no depth test": of(loops, "plain_1")}),
        ("both costs, 3 px", "hypothesis", "both_3", {"C++ loop, depth test": of(loops, "depth_3")}),
        ("SURF, turning", "keypoint", "surf", {"dlib": of(dlib, "surf")}),
        ("SURF, upright", "keypoint", "surf_upright", {}),
        ("SIFT, turning", "keypoint", "sift", opencv_sift(folder, meta)),
        ("SIFT, upright", "keypoint", "sift_upright", {}),
        ("matching, one way", "pair", "match", faiss_matching(folder) | opencv_matching(folder)),
        ("P3P", "problem", "p3p", {}),
        *((f"robust pose, {case.split('_')[1]} % false of {case.split('_')[2]}", "problem", case, poselib_poses(folder, meta, case)) for case in meta["cases"]),
        ("FB, whole", "query", "fb", {}),
        ("PM, whole", "query", "pm", {}),
        ("MI, whole", "query", "mi", {}),
    ]
    known = {"sift": repeated(sift_of(folder, "reference"), sift_of(folder, "warped"), meta)}
    print(f"\n{meta['query']} <- {meta['reference']}, {meta['points']} coloured points, {meta['poses']} poses; medians of {rounds} rounds\n")
    print(f"| stage | posescope | peer | its time | ratio |\n|---|---|---|---|---|")
    for stage, unit, name, peers in stages:
        if only and only not in stage and only not in name:
            continue
        peers = {peer: run for peer, run in peers.items() if run}
        times, theirs, ratios, outcomes = [], {peer: [] for peer in peers}, {peer: [] for peer in peers}, {}
        for run in peers.values():
            run()
        ours(name)
        for _ in range(rounds):
            seconds, items, outcome = ours(name)
            times.append(seconds / items)
            outcomes["posescope"] = known.get(name, outcome)
            for peer, run in peers.items():
                seconds, items, outcome = run()
                theirs[peer].append(seconds / items)
                ratios[peer].append(theirs[peer][-1] / times[-1])
                outcomes[peer] = outcome
        mine = f"{readable(statistics.median(times))} a {unit}{quality(outcomes['posescope'])}"
        if not peers:
            print(f"| {stage} | {mine} | – | – | – |", flush=True)
        for peer in peers:
            time_s, ratio = statistics.median(theirs[peer]), statistics.median(ratios[peer])
            print(f"| {stage} | {mine} | {peer} | {readable(time_s)}{quality(outcomes[peer])} | {ratio:.2f} |", flush=True)
    for server in servers:
        server.close()


def quality(outcome):
    match outcome:
        case {"found": found, "median_m": median}:
            return f" ({found} found, {100 * median:.1f} cm)"
        case {"repeated": repeated, "right": right, "recall": recall}:
            return f" (repeated {repeated:.3f}, right {right:.3f}, recall {recall:.3f})"
        case _:
            return ""


def readable(seconds):
    for unit, size in (("s", 1), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scene", help="a scene, as the commands take it; the street unless said otherwise")
    parser.add_argument("--pair", help="indices of query and reference frame, as 70,62")
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--only", help="stages whose name has this in it")
    arguments = parser.parse_args()
    pairs = [(arguments.scene or "street", arguments.pair or "70,62")]
    kitti = Path(os.environ.get("POSESCOPE_DATA", "")) / "kitti" / "sequences" / "00"
    if arguments.scene is None and "POSESCOPE_DATA" in os.environ:
        if kitti.is_dir():
            pairs.append((str(kitti), "1,0"))
        else:
            print(f"left out: {kitti} is not there")
    program = studies()
    about = versions()
    print(", ".join(f"{what}: {value}" for what, value in about.items()))
    for scene, pair in pairs:
        environment = os.environ | {"POSESCOPE_SCENE": scene, "POSESCOPE_PAIR": pair}
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([program, "peers", "--export", folder], env=environment, check=True)
            measure(program, environment, Path(folder), arguments.only, arguments.rounds)


if __name__ == "__main__":
    main()
