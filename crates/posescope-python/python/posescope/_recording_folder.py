"""The files of a recording: photos, frames, poses, matches, results. A killed process loses no line that was written."""

from __future__ import annotations

import importlib
import json
import os
import threading
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any, Dict, Iterator, List, Optional, Tuple

import numpy as np

from . import _posescope
from ._errors import InputError
from ._neighbours import Triple
from ._posescope import Camera, Query, Reference, Scene
from ._table import Parts

PHOTOS = "photo"
"""The name of the scene of the photos."""
ARRAYS = "arrays"
"""The name of the scene of references that come from no scene."""
_FRAMES = "frames.jsonl"
_FRAMES_SCHEMA = "posescope.frames/1"
_SCHEMA = "posescope.recording/1"
_POSES_HEADER = "name x y z qx qy qz qw\n"

Judging = Tuple[Optional[float], Optional[str], int]
"""The radius of the search [m], the tolerance of right, and how many variations of a wrong result are tried."""


@dataclass
class Logged:
    """A query on its way to its verdict."""

    name: str
    camera: Camera
    time_s: Optional[float]
    pose: Optional[Parts]
    truth: Optional[Parts]
    reference: Optional[str]
    """The name of the reference."""
    photo: "Optional[np.ndarray[Any, Any]]" = None
    """None once it is saved, where no verdict is to be made, and where it was not kept."""
    held: Optional[Reference] = None
    """The reference where it comes from no scene."""
    matches: Optional[Triple] = None
    has_matches: bool = False
    inliers: Optional[Triple] = None
    skipped: Optional[str] = None
    """Why it gets no verdict."""
    bytes: int = 0


@dataclass(frozen=True)
class Settings:
    """What a recording was started with."""

    name: str
    scene: Optional[str]
    judging: Judging

    @staticmethod
    def read(folder: Path) -> "Optional[Settings]":
        """Those of a folder that holds a recording."""
        file = folder / "recording.json"
        try:
            found = json.loads(file.read_text(encoding="utf-8"))
            radius, right, explain = found["judging"]
            return Settings(found["name"], found["scene"], (radius, right, explain))
        except FileNotFoundError:
            return None
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(str(file), "", f"the description of a recording expected, {error}") from error

    def write(self, folder: Path) -> None:
        """Stores them."""
        text = json.dumps({"schema": _SCHEMA, "name": self.name, "scene": self.scene, "judging": self.judging})
        write_whole(folder / "recording.json", text + "\n")


@dataclass
class Folder:
    """The open files of a recording. What is called by two threads says so."""

    path: Path
    settings: Settings
    scene: Optional[Scene]
    names: List[Tuple[str, Camera, Optional[float]]] = field(default_factory=list)
    """The queries in the order of their results. One thread appends, another reads."""
    has_matches: bool = False
    _planned: int = 0
    """How many queries ``run.toml`` names."""
    _references: Dict[int, str] = field(default_factory=dict)
    """The names of saved references by their fingerprints."""
    _files: Dict[str, IO[bytes]] = field(default_factory=dict)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    @property
    def _frames(self) -> Path:
        return self.path / "queries" / _FRAMES

    @property
    def photos(self) -> Path:
        """The folder of the photos."""
        return self.path / "queries" / "photos"

    def start(self) -> None:
        """Makes the files of a new recording."""
        self.photos.mkdir(parents=True, exist_ok=True)
        self.settings.write(self.path)
        self._frames.write_bytes(_header(PHOTOS))
        (self.path / "poses.txt").write_text(_POSES_HEADER, encoding="utf-8")
        self._open()
        self.plan()

    def resume(self) -> "List[Logged]":
        """Opens the files of a recording that ended, and returns the queries that have no result yet."""
        self.photos.mkdir(parents=True, exist_ok=True)
        for name in ("results.jsonl", "timings.jsonl", "poses.txt", os.path.join("queries", _FRAMES)):
            _cut(self.path / name)
        frames = self._frames
        if not frames.exists() or frames.stat().st_size == 0:
            frames.write_bytes(_header(PHOTOS))
        logged = self.logged()
        results, timings = (_lines(self.path / name) for name in ("results.jsonl", "timings.jsonl"))
        self.has_matches = any(json.loads(line)["method"] == "fb" for line in results)
        per_query = 2 if self.has_matches else 1
        done = min(len(results), len(timings)) // per_query
        for name, lines in (("results.jsonl", results), ("timings.jsonl", timings)):
            if len(lines) != done * per_query:
                write_whole(self.path / name, "".join(line + "\n" for line in lines[: done * per_query]))
        poses = "".join(_pose_line(one.name, one.pose) for one in logged if one.pose is not None)
        write_whole(self.path / "poses.txt", _POSES_HEADER + poses)
        self.names += [(one.name, one.camera, one.time_s) for one in logged]
        for entry in _entries(self.path / "references" / _FRAMES):
            self._references[entry["fingerprint"]] = entry["name"]
        _cut(self.path / "references" / _FRAMES)
        self._open()
        self.plan()
        return logged[done:]

    def _open(self) -> None:
        names = ("results.jsonl", "timings.jsonl", "poses.txt", os.path.join("queries", _FRAMES))
        for name in names:
            # Not buffered: a line is in the file once it was written, whatever becomes of the process.
            self._files[name] = open(self.path / name, "ab", buffering=0)
        _lock_file(self._files["results.jsonl"], self.path)

    def _append(self, name: str, text: str) -> None:
        self._files[name].write(text.encode("utf-8"))

    def close(self) -> None:
        """Closes the files."""
        for file in self._files.values():
            file.close()

    def knows(self, fingerprint: int, name: str) -> bool:
        """Whether a reference of this name can be recorded: it is the known one, or the first of this name."""
        with self._lock:
            known = {name: number for number, name in self._references.items()}.get(name)
            if known is None:
                self._references[fingerprint] = name
            return known in (None, fingerprint)

    def saved_references(self) -> "set[str]":
        """The names of the references that are in the folder."""
        return {entry["name"] for entry in _entries(self.path / "references" / _FRAMES)}

    def save_reference(self, reference: Reference) -> None:
        """Writes a reference that comes from no scene."""
        folder, name = self.path / "references", reference.name
        (folder / "photos" / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / "clouds" / name).parent.mkdir(parents=True, exist_ok=True)
        file = folder / _FRAMES
        photo, cloud = f"photos/{name}.png", f"clouds/{name}.ply"
        _posescope.save_photo(reference.photo, os.fspath(folder / photo))
        _posescope.save_cloud(reference, os.fspath(folder / cloud))
        entry = {
            "name": name,
            "photo": photo,
            "camera": _camera_entry(reference.camera),
            "pose": _pose_entry(_posescope.reference_parts(reference)),
            "cloud": cloud,
            "fingerprint": _posescope.fingerprint(reference),
        }
        with open(file, "ab", buffering=0) as lines:
            header = _header(ARRAYS) if lines.tell() == 0 else b""
            lines.write(header + json.dumps(entry).encode("utf-8") + b"\n")

    def save(self, logged: Logged) -> None:
        """Writes what a query is: its photo, its matches, its pose, and last its line among the frames."""
        try:
            self._save(logged)
        finally:
            # Results follow in this order, whatever could be written.
            camera = self.names[-1][1] if self.names and self.names[-1][1] == logged.camera else logged.camera
            self.names.append((logged.name, camera, logged.time_s))

    def _save(self, logged: Logged) -> None:
        photo = self.photos / f"{logged.name}.png"
        if logged.photo is not None:
            photo.parent.mkdir(parents=True, exist_ok=True)
            _posescope.save_photo(logged.photo, os.fspath(photo))
        for folder, matches in (("matches", logged.matches), ("inliers", logged.inliers)):
            if matches is not None:
                into = os.fspath(self.path / folder)
                _posescope.save_matches(self.scene, into, logged.name, logged.reference or "", matches)
        if logged.pose is not None:
            self._append("poses.txt", _pose_line(logged.name, logged.pose))
        entry = {
            "name": logged.name,
            "photo": f"photos/{logged.name}.png",
            "camera": _camera_entry(logged.camera),
            "pose": _pose_entry(logged.truth),
            "time_s": logged.time_s,
            "estimate": _pose_entry(logged.pose),
            "reference": logged.reference,
            "matches": logged.has_matches,
            "skipped": logged.skipped,
        }
        self._append(os.path.join("queries", _FRAMES), json.dumps(entry) + "\n")

    def plan(self) -> None:
        """Writes ``run.toml`` with all queries until now."""
        queries = self.names[:]
        text = _posescope.run_text(
            self.scene,
            PHOTOS,
            os.fspath(self.path.resolve()),
            self.settings.name,
            self.settings.judging,
            self.has_matches,
            queries,
        )
        write_whole(self.path / "run.toml", text)
        self._planned = len(queries)

    def add(self, position: int, lines: List[str]) -> None:
        """Appends the results of the query at this position, which must be the next one."""
        # A result that the plan does not name yet would be one too many.
        if position >= self._planned:
            self.plan()
        name = self.names[position][0]
        methods = [json.loads(line)["method"] for line in lines]
        timings = [json.dumps({"query": name, "method": method}) for method in methods]
        # Results last: a query with results is complete.
        self._append("timings.jsonl", "".join(timing + "\n" for timing in timings))
        self._append("results.jsonl", "".join(line + "\n" for line in lines))

    def begin_matches(self) -> None:
        """From now on each query has a result of ``fb``, too. Those before get one that says that it had no matches."""
        if self.has_matches:
            return
        self.has_matches = True
        lines: List[str] = []
        timings: List[str] = []
        truths = {logged.name: logged.truth for logged in self.logged()}
        for (name, _, _), line in zip(self.names, _lines(self.path / "results.jsonl")):
            lines += [line, self.unjudged(name, "fb", None, truths.get(name))]
            for method in (self.settings.name, "fb"):
                timings.append(json.dumps({"query": name, "method": method}))
        for file, text in (("timings.jsonl", timings), ("results.jsonl", lines)):
            self._files[file].close()
            write_whole(self.path / file, "".join(one + "\n" for one in text))
            self._files[file] = open(self.path / file, "ab", buffering=0)
        _lock_file(self._files["results.jsonl"], self.path)
        self.plan()

    def unjudged(
        self, name: str, method: str, pose: Optional[Parts], truth: Optional[Parts], **why: Optional[str]
    ) -> str:
        """A result without verdicts."""
        right = self.settings.judging[1]
        return _posescope.unjudged(self.scene, (PHOTOS, name), method, pose, truth, right, **why)

    def logged(self) -> "List[Logged]":
        """All queries as they were saved, without their photos."""
        return [_logged(entry) for entry in _entries(self._frames)]

    def saved_query(self, logged: Logged) -> Query:
        """A query with its photo as it was saved."""
        photo = Scene.open(self.path / "queries").query(logged.name).photo
        truth = None if logged.truth is None else _posescope.pose_of(logged.truth)
        return Query(photo, logged.camera, logged.name, truth)

    def saved_reference(self, name: str) -> Reference:
        """A reference as it was saved, or of the scene."""
        if self.scene is not None:
            return self.scene.reference(name)
        saved = Scene.open(self.path / "references").reference(name)
        entries = _entries(self.path / "references" / _FRAMES)
        entry = next(entry for entry in entries if entry["name"] == name)
        # Without a digit less than it had: results have the same bytes.
        pose, camera = _of(_parts(entry["pose"])), Camera(**entry["camera"])
        ply = (self.path / "references" / entry["cloud"]).read_bytes()
        cloud = np.frombuffer(ply.partition(b"end_header\n")[2], "<f4").reshape(-1, 3)
        return _posescope.restored_reference(saved.photo, camera, pose, cloud, name)

    def saved_matches(self, query: str, reference: str) -> Triple:
        """The matches of a query as they were saved."""
        file = f"{query}_{reference}_matches.txt".replace("/", "-")
        lines = (self.path / "matches" / file).read_text(encoding="utf-8").split("\n")
        # numpy warns of a file without numbers, and a query without matches is nothing unusual.
        numbers = [line for line in lines if line and not line.startswith("#")]
        found = np.loadtxt(numbers, np.float32, ndmin=2).reshape(-1, 4) if numbers else np.empty((0, 4), np.float32)
        return found[:, :2], found[:, 2:], None

    def rows(self) -> Iterator[Dict[str, Any]]:
        """The results one after the other."""
        with open(self.path / "results.jsonl", encoding="utf-8") as lines:
            for line in lines:
                yield json.loads(line)


def write_whole(path: Path, text: str) -> None:
    """Writes a file so that nobody sees a part of it."""
    temporary = path.with_name(f"tmp-posescope-{path.name}")
    temporary.write_text(text, encoding="utf-8")
    os.replace(temporary, path)


def _header(scene: str) -> bytes:
    return json.dumps({"schema": _FRAMES_SCHEMA, "scene": scene}).encode("utf-8") + b"\n"


def _camera_entry(camera: Camera) -> Dict[str, float]:
    shift = camera.pixel_center
    sides = {"width": camera.width, "height": camera.height}
    return {**sides, "fx": camera.fx, "fy": camera.fy, "cx": camera.cx - shift, "cy": camera.cy - shift}


def _pose_entry(parts: Optional[Parts]) -> Optional[Dict[str, List[float]]]:
    if parts is None:
        return None
    return {"position_m": list(parts[:3]), "quaternion_xyzw": list(parts[3:])}


def _parts(entry: Optional[Dict[str, List[float]]]) -> Optional[Parts]:
    if entry is None:
        return None
    x, y, z = entry["position_m"]
    qx, qy, qz, qw = entry["quaternion_xyzw"]
    return x, y, z, qx, qy, qz, qw


def _of(parts: Optional[Parts]) -> Parts:
    assert parts is not None
    return parts


def _pose_line(name: str, parts: Parts) -> str:
    return f"{name} {' '.join(map(repr, parts))}\n"


def _logged(entry: Dict[str, Any]) -> Logged:
    """A query of its line among the frames."""
    return Logged(
        name=entry["name"],
        camera=Camera(**entry["camera"]),
        time_s=entry["time_s"],
        pose=_parts(entry["estimate"]),
        truth=_parts(entry["pose"]),
        reference=entry["reference"],
        has_matches=entry["matches"],
        skipped=entry["skipped"],
    )


def _lines(path: Path) -> List[str]:
    """The whole lines of a file; none where there is no file."""
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return []
    return text[: text.rfind("\n") + 1].splitlines()


def _entries(path: Path) -> List[Dict[str, Any]]:
    """The lines of a list of frames but for the first."""
    entries: List[Dict[str, Any]] = []
    for number, line in enumerate(_lines(path)[1:], 2):
        try:
            entries.append(json.loads(line))
        except ValueError as error:
            raise InputError(str(path), f"line {number}", f"a frame expected, {error}") from error
    return entries


def _cut(path: Path) -> None:
    """Removes a last line without an end, which a killed process left."""
    if path.exists():
        with open(path, "r+b") as file:
            content = file.read()
            file.truncate(content.rfind(b"\n") + 1)


def _lock_file(file: IO[bytes], path: Path) -> None:
    """Refuses a folder that another process records into, where the system can tell."""
    try:
        fcntl: Any = importlib.import_module("fcntl")
    except ImportError:
        return
    try:
        fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        raise FileExistsError(f"{path}: another process records into this folder") from error
