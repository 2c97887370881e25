"""Recording from inside a running localiser."""

from __future__ import annotations

import heapq
import itertools
import json
import os
import queue
import threading
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, List, Optional, Tuple, Type

import numpy as np

from . import _posescope
from ._localize import Triple, diagnose, localize, triple
from ._posescope import Camera, Query, Reference, Scene
from ._result import Result
from ._run import Run

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

_PHOTOS = "photo"
"""The name of the scene of the photos."""
_SAVED_EVERY = 50
"""After so many queries, run.toml is written again, so that a killed process leaves a run."""
_UNSAFE = set('/\\:*?"<>|\0')


@dataclass
class _Logged:
    """A query on its way to its verdict."""

    name: str
    line: str
    world_from_camera: "Optional[NDArray[np.float64]]"
    truth: "Optional[NDArray[np.float64]]"
    photo: "Optional[NDArray[np.uint8]]"
    reference: "Optional[str | Reference]"
    matches: Optional[Triple]
    inliers: Optional[Triple]

    @property
    def reference_name(self) -> Optional[str]:
        """The name of the reference, where one is named."""
        return self.reference.name if isinstance(self.reference, Reference) else self.reference


def record(
    path: "str | os.PathLike[str]",
    scene: Scene,
    name: str = "live",
    keep: int = 5,
    waiting: int = 64,
) -> "Recording":
    """Records what a running localiser answers, as a run folder with verdicts.

    Args:
        path: The run folder; it must not hold anything yet.
        scene: Where references come from: the nearest frame with a cloud, unless one is named.
        name: What the localiser is called in results: lower-case letters, digits and ``-_.+``.
        keep: Of how many of the worst queries to save recordings for Rerun.
        waiting: How many queries may wait for their verdict. Beyond that, the verdict is skipped.

    Returns:
        A context manager: ``with posescope.record("runs/live", scene) as log: log.query(...)``.

    Raises:
        ValueError: The name is not possible.
        FileExistsError: The folder holds something.
    """
    return Recording(Path(path), scene, name, keep, waiting)


class Recording:
    """A recording that is being written. ``query`` adds a query; ``close``, or the end of ``with``, completes it."""

    def __init__(self, path: Path, scene: Scene, name: str, keep: int, waiting: int) -> None:
        if name in _posescope.methods():
            raise ValueError(f"name: `{name}` is a method of posescope")
        _posescope.unjudged(scene, _PHOTOS, "", name, None, None)
        if path.exists() and any(path.iterdir()):
            raise FileExistsError(f"{path}: a new or empty folder expected")
        self._path, self._scene, self._name = path, scene, name
        self._keep, self._waiting = keep, waiting
        self._photos = path / "queries" / "photos"
        self._photos.mkdir(parents=True, exist_ok=True)
        self._camera: Optional[Camera] = None
        self._names: set[str] = set()
        self._pending = 0
        self._skipped = 0
        self._closed = False
        self._broken: Optional[BaseException] = None
        self._lock = threading.Lock()
        self._has_matches = False
        self._worst: List[Tuple[Tuple[float, ...], int, List[Result]]] = []
        self._order = itertools.count()
        self._files = [open(path / file, "w", encoding="utf-8") for file in ("results.jsonl", "timings.jsonl")]
        self._poses = open(path / "poses.txt", "w", encoding="utf-8")
        self._poses.write("name x y z qx qy qz qw\n")
        self._to_save: "queue.SimpleQueue[Optional[Tuple[_Logged, NDArray[np.uint8]]]]" = queue.SimpleQueue()
        self._to_judge: "queue.SimpleQueue[Optional[_Logged]]" = queue.SimpleQueue()
        self._threads = [
            threading.Thread(target=target, name=f"posescope-{target.__name__}", daemon=True)
            for target in (self._save_all, self._judge_all)
        ]
        for thread in self._threads:
            thread.start()

    @property
    def path(self) -> Path:
        """The run folder."""
        return self._path

    @property
    def skipped(self) -> int:
        """How many queries got no verdict because too many were waiting."""
        return self._skipped

    def query(
        self,
        photo: "ArrayLike",
        camera: Camera,
        world_from_camera: "Optional[ArrayLike]",
        matches: "Optional[Tuple[ArrayLike, ...]]" = None,
        inliers: "Optional[ArrayLike]" = None,
        reference: "Optional[str | Reference]" = None,
        truth: "Optional[ArrayLike]" = None,
        name: Optional[str] = None,
    ) -> None:
        """Adds a query. Returns at once: photo and pose are written, and the verdict is made, on other threads.

        Args:
            photo: uint8, H x W or H x W x 3. It is copied.
            camera: The camera; the same for all queries.
            world_from_camera: The pose that the localiser found, 4 x 4 [m]; None if it found none.
            matches: Query points and reference points (N x 2 [px]) and perhaps scores; ``reference`` says of which
                frame. The run then has ``fb`` beside the localiser: what it makes of the same matches, with verdicts.
            inliers: Which of the matches are inliers: N booleans, or their positions. Matches and inliers are stored
                in ``matches`` and ``inliers`` of the folder, as ``--matches`` reads them.
            reference: The frame of the scene, or the reference, that the localiser used. By default the nearest frame.
            truth: The true pose, 4 x 4, where it is known.
            name: The name of the query. By default its number.

        Raises:
            ValueError: An array has another dtype or shape than documented, the camera has changed, or a name is
                used twice.
            InputError: The scene has no frame ``reference``.
            RuntimeError: The recording is closed.
        """
        if self._closed:
            raise RuntimeError("the recording is closed")
        if self._camera is not None and camera != self._camera:
            raise ValueError("camera: the same for all queries of a recording expected")
        if matches is not None and reference is None:
            raise ValueError("reference: the frame that the matches belong to expected")
        if matches is None and inliers is not None:
            raise ValueError("matches: the matches that the inliers are among expected")
        given = None if matches is None else _copied(triple(matches))
        if given is not None:
            _posescope.check_matches(given)
        chosen = None if given is None or inliers is None else _inliers_of(given, inliers)
        _posescope.check_photo(photo, camera)
        name = f"{len(self._names):06}" if name is None else name
        if not name or name in self._names or _UNSAFE & set(name):
            raise ValueError(f"name: a new name that a file can have expected, `{name}` given")
        line = _posescope.unjudged(self._scene, _PHOTOS, name, self._name, world_from_camera, truth)
        copied = np.array(photo, np.uint8)
        if isinstance(reference, str):
            reference = _posescope.frame_name(self._scene, reference)
        logged = _Logged(name, line, _copy(world_from_camera), _copy(truth), None, reference, given, chosen)
        self._has_matches |= given is not None
        self._camera = camera
        self._names.add(name)
        with self._lock:
            if self._pending < self._waiting:
                self._pending += 1
                logged.photo = copied
            else:
                self._skipped += 1
        self._to_save.put((logged, copied))
        self._to_judge.put(logged)

    def close(self) -> Run:
        """Waits for the verdicts that are due, saves the worst recordings and the report, and returns the run.

        Raises:
            OSError: A file could not be written.
        """
        if not self._closed:
            self._closed = True
            self._to_save.put(None)
            self._to_judge.put(None)
            for thread in self._threads:
                thread.join()
            for file in (*self._files, self._poses):
                file.close()
            self._save_run()
            if self._broken is None and self._names:
                self._save_worst()
                _posescope.summarise(os.fspath(self._path))
        if self._broken is not None:
            raise OSError(f"{self._path}: the recording is not complete: {self._broken}") from self._broken
        return Run(self._path)

    def __enter__(self) -> "Recording":
        return self

    def __exit__(
        self,
        kind: Optional[Type[BaseException]],
        error: Optional[BaseException],
        traceback: Optional[TracebackType],
    ) -> None:
        try:
            self.close()
        except OSError:
            # The caller's own exception says more.
            if error is None:
                raise

    def _save_all(self) -> None:
        """Writes photos, poses and matches."""
        while True:
            item = self._to_save.get()
            if item is None:
                return
            logged, photo = item
            try:
                _posescope.save_photo(photo, os.fspath(self._photos / f"{logged.name}.png"))
                pose = json.loads(logged.line)["pose"]
                if pose is not None:
                    numbers = (*pose["position_m"], *pose["quaternion_xyzw"])
                    self._poses.write(f"{logged.name} {' '.join(map(repr, numbers))}\n")
                    self._poses.flush()
                for folder, matches in (("matches", logged.matches), ("inliers", logged.inliers)):
                    if matches is not None:
                        into = os.fspath(self._path / folder)
                        reference = logged.reference_name or ""
                        _posescope.save_matches(self._scene, into, logged.name, reference, matches)
            except Exception as error:  # noqa: BLE001
                self._broken = self._broken or error

    def _judge_all(self) -> None:
        """Makes the verdicts, in the order of the queries."""
        names: List[str] = []
        while True:
            logged = self._to_judge.get()
            if logged is None:
                return
            try:
                lines = [logged.line] if logged.photo is None else self._judged(logged)
                for line in lines:
                    timing = json.dumps({"query": logged.name, "method": json.loads(line)["method"]})
                    for file, text in zip(reversed(self._files), (timing, line)):
                        file.write(text + "\n")
                        file.flush()
                names.append(logged.name)
                if len(names) % _SAVED_EVERY == 1:
                    self._save_run(names)
            except Exception as error:  # noqa: BLE001
                self._broken = self._broken or error
            finally:
                if logged.photo is not None:
                    with self._lock:
                        self._pending -= 1

    def _judged(self, logged: _Logged) -> List[str]:
        """The lines of a query with their verdicts: the localiser's, and that of ``fb`` where it gave matches."""
        pose = logged.world_from_camera
        reference = logged.reference
        if reference is None and pose is not None:
            reference = _posescope.nearest(self._scene, pose)
        if reference is None or self._camera is None or logged.photo is None:
            return [logged.line]
        if not isinstance(reference, Reference):
            reference = self._scene.reference(reference)
        query = Query(logged.photo, self._camera, logged.name, logged.truth)
        results: List[Result] = []
        # One thread, so that the caller keeps the others.
        if pose is not None:
            results.append(diagnose(query, reference, pose, name=self._name, threads=1))
        lines = [result.to_json() for result in results] or [logged.line]
        if logged.matches is not None:
            results.append(localize(query, reference, matches=logged.matches, threads=1))
            lines.append(results[-1].to_json())
        if self._keep > 0 and results:
            entry = (_badness(results[0]), next(self._order), results)
            if len(self._worst) < self._keep:
                heapq.heappush(self._worst, entry)
            else:
                heapq.heappushpop(self._worst, entry)
        return lines

    def _save_run(self, names: Optional[List[str]] = None) -> None:
        """Writes run.toml and the scene of the photos."""
        if self._camera is None:
            return
        if names is None:
            lines = (self._path / "results.jsonl").read_text(encoding="utf-8").splitlines()
            # Once each: a query with matches has two lines.
            names = list(dict.fromkeys(json.loads(line)["query"] for line in lines))
        camera = self._camera
        text = _posescope.run_text(
            self._scene,
            _PHOTOS,
            os.fspath(self._path / "queries"),
            self._name,
            os.fspath(self._path / "poses.txt"),
            os.fspath(self._path / "matches") if self._has_matches else None,
            camera,
            names,
        )
        _write_whole(self._path / "run.toml", text)
        shift = camera.pixel_center
        scene = (
            f'name = "{_PHOTOS}"\nimages = "photos/*.png"\n\n[camera]\n'
            f"fx = {camera.fx!r}\nfy = {camera.fy!r}\ncx = {camera.cx - shift!r}\ncy = {camera.cy - shift!r}\n"
        )
        _write_whole(self._path / "queries" / "scene.toml", scene)

    def _save_worst(self) -> None:
        """Saves recordings of the worst queries."""
        folder = self._path / "failures"
        folder.mkdir(exist_ok=True)
        for _, _, results in self._worst:
            for result in results:
                result.save(folder / f"{result.query}-{result.method}.rrd")


def _copy(pose: "Optional[ArrayLike]") -> "Optional[NDArray[np.float64]]":
    return None if pose is None else np.array(pose, np.float64)


def _copied(matches: Triple) -> Triple:
    queries, references, scores = matches
    return np.array(queries), np.array(references), None if scores is None else np.array(scores)


def _inliers_of(matches: Triple, inliers: "ArrayLike") -> Triple:
    """The matches that are inliers."""
    chosen = np.asarray(inliers)
    if chosen.dtype.kind not in "biu" or chosen.ndim != 1:
        raise ValueError(f"inliers: booleans or positions expected, {chosen.dtype} of shape {chosen.shape} given")
    queries, references, scores = matches
    try:
        return queries[chosen], references[chosen], None if scores is None else scores[chosen]
    except IndexError as error:
        raise ValueError(f"inliers: {error}") from error


def _badness(result: Result) -> Tuple[float, ...]:
    """Greater for a result that is more worth looking at."""
    grades = {"wrong": 3, "no pose": 2, "unmeasured": 1, "right": 0}
    known = result.confidence
    error = result.error
    return (
        grades.get(result.grade, 0),
        len(result.verdicts),
        0.0 if error is None else error.translation_m,
        0.0 if known is None else 1.0 - known.probability,
    )


def _write_whole(path: Path, text: str) -> None:
    """Writes a file so that nobody sees a part of it."""
    temporary = path.with_name(f"tmp-{path.name}")
    temporary.write_text(text, encoding="utf-8")
    os.replace(temporary, path)
