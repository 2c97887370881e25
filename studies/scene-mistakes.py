#!/usr/bin/env python3
"""Plants mistakes of a whole scene, and asks whether a run names each as a finding.

    studies/scene-mistakes.py PROGRAM [OUT] [-- OPTIONS OF EVAL]
    studies/scene-mistakes.py --aside PROGRAM [OUT] [-- OPTIONS OF EVAL]   # the mistakes and the scene that were set aside

Writes the street with exact poses into OUT, plants one mistake in a copy, evaluates it, and prints the findings in
`summary.json`. Needs Python 3.9 with numpy and Pillow.
"""
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

METHODS = "fb,mi"
QUERIES = 20
KEPT = 101  # frames, so that queries have neighbours


def points_of(path):
    """The header of a PLY as bytes, and its points with their intensities."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    return data[:end], np.frombuffer(data[end:], np.float32).reshape(-1, 4).copy()


def for_clouds(scene, change):
    for path in sorted((scene / "scans").iterdir()):
        header, points = points_of(path)
        points[:, :3] = change(points[:, :3].astype(float))
        path.write_bytes(header + points.astype(np.float32).tobytes())


def for_poses(scene, change):
    rows = np.loadtxt(scene / "poses.txt").reshape(-1, 3, 4)
    whole = [np.vstack([row, [0, 0, 0, 1]]) for row in rows]
    changed = [change(pose)[:3].reshape(-1) for pose in whole]
    np.savetxt(scene / "poses.txt", changed, fmt="%.12g")


def for_camera(scene, **changes):
    lines = []
    for line in (scene / "scene.toml").read_text().splitlines():
        key = line.split(" =")[0]
        if key in changes:
            line = f"{key} = {changes[key](float(line.split('=')[1]))!r}"
        lines.append(line)
    (scene / "scene.toml").write_text("\n".join(lines) + "\n")


def turned(axis, degrees):
    turn = np.eye(3)
    (i, j), angle = {"y": (0, 2), "x": (1, 2)}[axis], np.radians(degrees)
    turn[i, i] = turn[j, j] = np.cos(angle)
    turn[i, j], turn[j, i] = np.sin(angle), -np.sin(angle)
    return lambda points: points @ turn.T


def transposed(scene, how):
    for path in (scene / "photos").iterdir():
        Image.open(path).transpose(how).save(path)


def of_other_frames(scene, kind, step):
    paths = sorted((scene / kind).iterdir())
    files = [path.read_bytes() for path in paths]
    for at, path in enumerate(paths):
        path.write_bytes(files[(at + step) % len(paths)])


def half_size(value):
    return (value + 0.5) / 2 - 0.5


Y_UP = np.diag([1.0, -1.0, -1.0, 1.0])
# x stays, the camera's y is z, and its z is -y.
Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
MISTAKES = {
    "focal length × 0.8": lambda s: for_camera(s, fx=lambda f: 0.8 * f, fy=lambda f: 0.8 * f),
    "focal length × 1.3": lambda s: for_camera(s, fx=lambda f: 1.3 * f, fy=lambda f: 1.3 * f),
    "camera of half the size": lambda s: for_camera(
        s, fx=lambda f: f / 2, fy=lambda f: f / 2, cx=half_size, cy=half_size
    ),
    "centre 90 px to the right": lambda s: for_camera(s, cx=lambda c: c + 90),
    "inverse poses": lambda s: for_poses(s, np.linalg.inv),
    "poses of a camera with y up": lambda s: for_poses(s, lambda pose: pose @ Y_UP),
    "poses in millimetres": lambda s: for_poses(
        s, lambda pose: np.block([[pose[:3, :3], 1000 * pose[:3, 3:]], [pose[3:]]])
    ),
    "clouds in millimetres": lambda s: for_clouds(s, lambda points: 1000 * points),
    "mirrored photos": lambda s: transposed(s, Image.Transpose.FLIP_LEFT_RIGHT),
    "clouds turned by 4° about y": lambda s: for_clouds(s, turned("y", 4)),
    "clouds turned by 4° about x": lambda s: for_clouds(s, turned("x", 4)),
    "clouds shifted by 1 m": lambda s: for_clouds(s, lambda points: points + [0, 1, 0]),
    "clouds of the next frame but one": lambda s: of_other_frames(s, "scans", 2),
}
# Written down before any of them was planted; the scene is the street in sun.
ASIDE = {
    "focal length × 0.87": lambda s: for_camera(s, fx=lambda f: 0.87 * f, fy=lambda f: 0.87 * f),
    "focal length × 1.5": lambda s: for_camera(s, fx=lambda f: 1.5 * f, fy=lambda f: 1.5 * f),
    "camera of twice the size": lambda s: for_camera(
        s, fx=lambda f: 2 * f, fy=lambda f: 2 * f, cx=lambda c: 2 * c + 0.5, cy=lambda c: 2 * c + 0.5
    ),
    "centre 50 px down": lambda s: for_camera(s, cy=lambda c: c + 50),
    "rotations inverted": lambda s: for_poses(
        s, lambda pose: np.block([[pose[:3, :3].T, pose[:3, 3:]], [pose[3:]]])
    ),
    "poses of a camera with z up": lambda s: for_poses(s, lambda pose: pose @ Z_UP),
    "poses in feet": lambda s: for_poses(
        s, lambda pose: np.block([[pose[:3, :3], pose[:3, 3:] / 0.3048], [pose[3:]]])
    ),
    "clouds in feet": lambda s: for_clouds(s, lambda points: points / 0.3048),
    "photos upside down": lambda s: transposed(s, Image.Transpose.ROTATE_180),
    "clouds turned by 3° about x": lambda s: for_clouds(s, turned("x", 3)),
    "clouds shifted by 0.8 m to the right": lambda s: for_clouds(s, lambda points: points + [0.8, 0, 0]),
    "photos of the next frame but two": lambda s: of_other_frames(s, "photos", 3),
}


def findings(program, scene, out, options):
    command = [program, "eval", scene, "--out", out, "--method", METHODS, "--limit", QUERIES, "--keep-failures", "0", "--quiet"]
    subprocess.run([str(word) for word in [*command, *options]], check=True)
    return json.loads((out / "summary.json").read_text()).get("findings", [])


def main(program, out, options, condition="overcast", mistakes=MISTAKES):
    sound = out / "street"
    if not sound.exists():
        written = out / "written"
        layout = ["--layout", "toml", "--condition", condition]
        subprocess.run([program, "synth", str(written), *layout], check=True)
        shutil.move(written / condition, sound)
        for kind in ("photos", "scans"):
            for path in sorted((sound / kind).iterdir())[KEPT:]:
                path.unlink()
        rows = (sound / "poses.txt").read_text().splitlines()[:KEPT]
        (sound / "poses.txt").write_text("\n".join(rows) + "\n")
    found = 0
    cases = {"nothing": lambda scene: None, **mistakes}
    for name, plant in cases.items():
        scene, run = out / "planted", out / "run"
        for old in (scene, run):
            shutil.rmtree(old, ignore_errors=True)
        shutil.copytree(sound, scene)
        plant(scene)
        texts = [one["text"] for one in findings(program, scene, run, options)]
        print(f"{name}: {' | '.join(texts) or '–'}", flush=True)
        found += bool(texts) and name != "nothing"
    print(f"{found} of {len(mistakes)} have a finding; whether it is the right one is for you to read")


if __name__ == "__main__":
    own, _, options = "\0".join(sys.argv[1:]).partition("\0--\0")
    own = own.split("\0")
    aside = own[0] == "--aside"
    own = own[aside:]
    if not own or not own[0]:
        sys.exit(__doc__)
    arguments = {"condition": "sun", "mistakes": ASIDE} if aside else {}
    options = options.split("\0") if options else []
    if len(own) > 1:
        main(own[0], Path(own[1]), options, **arguments)
    else:
        with tempfile.TemporaryDirectory() as folder:
            main(own[0], Path(folder), options, **arguments)
