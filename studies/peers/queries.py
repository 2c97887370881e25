#!/usr/bin/env python3
# /// script
# requires-python = ">=3.10"
# dependencies = ["numpy==2.4.6", "opencv-contrib-python-headless==4.13.0.92", "pycolmap==4.2.1"]
# ///
"""Localises the same queries with posescope's methods and in the manner of hloc, and prints time and accuracy.

    uv run studies/peers/queries.py         # or: pip install the packages named above, then python3 …
    … [--scene PATH [--truth POSES] | --street N --cells CELLS] [--radius M] [--seed N] [--method METHOD …]

In the manner of hloc: SIFT of both photos (OpenCV's, which turns, or ours, which is upright), descriptors' roots,
matches that are mutual and pass the ratio test of 0.8, the depth of the nearest visible point within 3 px as for FB,
and pycolmap's estimate_and_refine_absolute_pose with hloc's 12 px. Everything runs on one thread, and nothing that one
method computed serves another. Times are by the clock and include the features of both photos.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import cv2
import numpy as np
import pycolmap

from peers import studies

cv2.setNumThreads(1)
RATIO = 0.8
DEPTH_PX = 3.0
INLIER_PX = 12.0
KEYPOINTS = 4000


def opencv_features(folder, side, about):
    width, height = about[side]["size"]
    photo = np.fromfile(folder / f"{side}.u8", np.uint8).reshape(height, width)
    begun = time.perf_counter()
    keypoints, descriptors = cv2.SIFT_create(nfeatures=KEYPOINTS, contrastThreshold=0.036).detectAndCompute(photo, None)
    descriptors = np.sqrt(descriptors / descriptors.sum(1, keepdims=True))
    return np.array([keypoint.pt for keypoint in keypoints]), descriptors, time.perf_counter() - begun


def own_features(folder, side, about):
    numbers = np.fromfile(folder / f"{side}_sift.f32", np.float32).reshape(-1, 130)
    return numbers[:, :2].astype(float), numbers[:, 2:], about["sift_seconds"][side == "reference"]


def matched(query, reference):
    """Pairs that are mutual and distinct."""
    products = query @ reference.T
    best = np.argpartition(-products, 1, axis=1)[:, :2]
    distances = np.sqrt(np.maximum(2 - 2 * np.take_along_axis(products, best, 1), 0))
    first = np.argmin(distances, axis=1)
    rows = np.arange(len(query))
    nearest, least, second = best[rows, first], distances[rows, first], distances[rows, 1 - first]
    is_match = (least < RATIO * second) & (np.argmax(products, axis=0)[nearest] == rows)
    return rows[is_match], nearest[is_match]


def lifted(pixels, points, camera):
    """The points that pixels of the reference see, each at the depth of the nearest projection; and which have one."""
    fx, fy, cx, cy = camera
    projected = points[:, :2] / points[:, 2:] * [fx, fy] + [cx, cy]
    order = np.argsort(projected[:, 1])
    rows = projected[order, 1]
    depths = np.full(len(pixels), np.nan)
    for number, pixel in enumerate(pixels):
        near = order[np.searchsorted(rows, pixel[1] - DEPTH_PX) : np.searchsorted(rows, pixel[1] + DEPTH_PX)]
        if len(near):
            squares = ((projected[near] - pixel) ** 2).sum(1)
            closest = np.argmin(squares)
            if squares[closest] <= DEPTH_PX**2:
                depths[number] = points[near[closest], 2]
    rays = np.column_stack([(pixels - [cx, cy]) / [fx, fy], np.ones(len(pixels))])
    return rays * depths[:, None], np.isfinite(depths)


def localised(folder, about, features):
    """How far the pose is from the truth, None without one, and how long it took."""
    points = np.fromfile(folder / "points.f32", np.float32).reshape(-1, 3).astype(float)
    (at, of, first_s), (there, others, second_s) = [features(folder, side, about) for side in ("query", "reference")]
    begun = time.perf_counter()
    query, reference = matched(of, others)
    seen, has_depth = lifted(there[reference], points, about["reference"]["camera"])
    width, height = about["query"]["size"]
    fx, fy, cx, cy = about["query"]["camera"]
    # COLMAP's pixels have their corners, ours their centres at whole numbers.
    camera = pycolmap.Camera(model="PINHOLE", width=width, height=height, params=[fx, fy, cx + 0.5, cy + 0.5])
    options = pycolmap.AbsolutePoseEstimationOptions()
    options.ransac.max_error = INLIER_PX
    found = None
    if has_depth.sum() >= 4:
        found = pycolmap.estimate_and_refine_absolute_pose(at[query][has_depth] + 0.5, seen[has_depth], camera, options)
    seconds = first_s + second_s + time.perf_counter() - begun
    if not found:
        return None, seconds
    truth = np.array(about["reference_from_query"]).reshape(4, 4)
    pose = found["cam_from_world"].inverse().matrix()
    turn = pose[:, :3].T @ truth[:3, :3]
    degrees = np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1)))
    return (float(np.linalg.norm(pose[:, 3] - truth[:3, 3])), float(degrees)), seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scene")
    parser.add_argument("--truth")
    parser.add_argument("--street")
    parser.add_argument("--cells", default="overcast-overcast,overcast-night,overcast-snow")
    parser.add_argument("--from", dest="from_m")
    parser.add_argument("--radius", default="10")
    parser.add_argument("--seed", default="0")
    parser.add_argument("--method", action="append")
    arguments = parser.parse_args()
    command = [studies(), "methods", "--radius", arguments.radius, "--seed", arguments.seed]
    if arguments.scene:
        command += ["--scene", arguments.scene]
        command += ["--truth", arguments.truth] if arguments.truth else []
        command += ["--from", arguments.from_m] if arguments.from_m else []
    else:
        command += ["--street", arguments.street or "10", "--cells", arguments.cells]
    for method in arguments.method or ["fb", "fb2", "robust"]:
        command += ["--method", method]
    peers = {f"OpenCV {cv2.__version__} SIFT + pycolmap {pycolmap.__version__}": opencv_features, f"our SIFT + pycolmap {pycolmap.__version__}": own_features}
    rows = {}
    with tempfile.TemporaryDirectory() as folder:
        made = subprocess.run([*command, "--export", folder], env=os.environ | {"RAYON_NUM_THREADS": "1"}, stdout=subprocess.DEVNULL)
        if made.returncode != 0:
            sys.exit(made.returncode)
        for case in sorted(Path(folder).iterdir()):
            about = json.loads((case / "case.json").read_text())
            for answer in about["answers"]:
                rows.setdefault((about["row"], answer["method"]), []).append((answer["error"], answer["seconds"]))
            for name, features in peers.items():
                rows.setdefault((about["row"], name), []).append(localised(case, about, features))
    print("| | method | queries | a pose | < 0.25 m | < 1 m | median | | time |\n|---|---|--:|--:|--:|--:|--:|--:|--:|")
    for (row, method), answers in sorted(rows.items(), key=lambda row: row[0][0]):
        infinite = (float("inf"), float("inf"))
        errors = [error or infinite for error, _ in answers]
        share = lambda limit: f"{100 * sum(metres < limit for metres, _ in errors) / len(errors):.0f} %"
        metres, degrees = (statistics.median_high(error[part] for error in errors) for part in (0, 1))
        seconds = statistics.median(seconds for _, seconds in answers)
        shares = " | ".join(share(limit) for limit in (float("inf"), 0.25, 1))
        print(f"| {row} | {method} | {len(errors)} | {shares} | {metres:.3f} m | {degrees:.2f}° | {seconds:.3f} s |")


if __name__ == "__main__":
    main()
