"""Recording from inside a running localiser."""

from __future__ import annotations

import contextlib
import heapq
import math
import os
import queue
import threading
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Dict, Iterator, List, Optional, Tuple, Type

import numpy as np

from . import _posescope
from ._errors import InputError
from ._localize import Right, diagnose, judged_by, localize
from ._neighbours import Triple, triple
from ._posescope import Query, Reference, Scene
from ._recording_folder import Folder, Judging, Logged, Settings
from ._result import Result
from ._run import Run

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

_HELD = 16
"""How many references are known by their object."""
_SPARE = 8
"""The memory of how many photos is used again."""
_UNSAFE = set('\\:*?"<>|\0,;')
_LATE = "verdict of {name}, since too many queries waited for theirs"
_LARGE = "verdict of {name}, since the photos that waited took too much memory"


def record(
    path: "str | os.PathLike[str]",
    scene: "Scene | str | os.PathLike[str] | None" = None,
    name: Optional[str] = None,
    keep: int = 5,
    waiting: int = 64,
    resume: bool = False,
    radius: Optional[float] = None,
    right: Optional[Right] = None,
    explain: "bool | int" = False,
    memory_mb: float = 256.0,
) -> "Recording":
    """Records what a running localiser answers, as a run folder with verdicts.

    Args:
        path: The run folder; it must not hold anything yet, unless ``resume`` says so.
        scene: Where references come from: the nearest frame with a cloud, unless one is named. Without a scene, each
            query brings its reference.
        name: What the localiser is called in results: lower-case letters, digits and ``-_.+``; by default ``live``.
        keep: Of how many of the worst queries to save recordings for Rerun.
        waiting: How many queries may wait for their verdict. Beyond that, the verdict is skipped.
        resume: Whether to go on with a recording that ended or was killed. What has no verdict yet gets one.
        radius: How far from the reference a search would have looked [m].
        right: The largest error of a right pose, such as ``(0.5, 2.0)`` for 0.5 m and 2 degrees.
        explain: Whether to try variations of what ``fb`` makes of matches where that is wrong, 12 or so many.
        memory_mb: How much the photos that wait may take [MB]. Beyond that, a photo is not kept, and the query gets no
            verdict.

    Returns:
        A context manager: ``with posescope.record("runs/live", scene) as log: log.query(...)``.

    Raises:
        ValueError: An argument is not possible, or another than that of the recording that is resumed.
        FileExistsError: The folder holds something, or another process records into it.
        InputError: A file of the recording that is resumed is damaged.
    """
    folder = Path(path)
    if scene is not None and not isinstance(scene, Scene):
        scene = Scene.open(scene)
    for argument, value in (("keep", keep), ("waiting", waiting)):
        if isinstance(value, bool) or not isinstance(value, int) or value < 0:
            raise ValueError(f"{argument}: a whole number from 0 on expected, {value!r} given")
    if not memory_mb > 0:
        raise ValueError(f"memory_mb: a number above 0 expected, {memory_mb!r} given")
    judging = judged_by(radius, right, explain)
    known = Settings.read(folder) if resume else None
    if known is None:
        if folder.exists() and any(folder.iterdir()):
            raise FileExistsError(f"{folder}: a new or empty folder expected; resume=True goes on with a recording")
        settings = Settings(name or "live", None if scene is None else scene.path, judging)
    else:
        settings = _same(known, name, scene, judging)
        if scene is None and settings.scene is not None:
            scene = Scene.open(settings.scene)
    if settings.name in _posescope.methods():
        raise ValueError(f"name: `{settings.name}` is a method of posescope")
    _posescope.check_judging(scene, settings.name, settings.judging[0], settings.judging[1])
    return Recording(Folder(folder, settings, scene), known is not None, keep, waiting, memory_mb)


def _same(known: Settings, name: Optional[str], scene: Optional[Scene], judging: Judging) -> Settings:
    """The settings of a recording that is resumed; what is given must be the same."""
    def named(name: Optional[str], scene: Optional[str], judging: Judging) -> Dict[str, Optional[str]]:
        radius, right, _ = judging
        return {"name": name, "scene": scene, "radius": None if radius is None else str(radius), "right": right}

    given = named(name, None if scene is None else scene.path, judging)
    before = named(known.name, known.scene, known.judging)
    for key, value in given.items():
        if value not in (None, before[key]):
            raise ValueError(f"{key}: `{before[key]}` expected, as the recording has, `{value}` given")
    return known


class Recording:
    """A recording that is being written. ``query`` adds a query; ``close``, or the end of ``with``, completes it."""

    def __init__(self, folder: Folder, is_resumed: bool, keep: int, waiting: int, memory_mb: float) -> None:
        self._folder = folder
        self._keep, self._waiting, self._bytes_allowed = keep, waiting, memory_mb * 1e6
        self._pending = 0
        self._bytes = 0
        self._skipped = 0
        self._closing = self._closed = False
        self._broken: Optional[BaseException] = None
        self._lock = threading.Lock()
        # The references used last, each with itself on its own: the same object again need not be compared.
        self._held_last: Dict[int, Tuple[Reference, Reference]] = {}
        # The memory of the last photos that are done.
        self._spare: "List[np.ndarray[Any, Any]]" = []
        self._to_save: "queue.SimpleQueue[Optional[Logged]]" = queue.SimpleQueue()
        self._to_judge: "queue.SimpleQueue[Optional[Logged]]" = queue.SimpleQueue()
        left: List[Logged] = []
        if is_resumed:
            left = folder.resume()
        else:
            folder.start()
        self._names = {name for name, _, _ in folder.names}
        self._judged = len(folder.names) - len(left)
        self._is_stopped = False
        for logged in left:
            self._to_judge.put(logged)
        self._threads = [
            threading.Thread(target=target, name=f"posescope-{target.__name__}", daemon=True)
            for target in (self._save_all, self._judge_all)
        ]
        for thread in self._threads:
            thread.start()

    @property
    def path(self) -> Path:
        """The run folder."""
        return self._folder.path

    @property
    def skipped(self) -> int:
        """How many queries got no verdict because too many were waiting, or their photos took too much memory."""
        return self._skipped

    def query(
        self,
        photo: "ArrayLike",
        camera: Any,
        world_from_camera: Any,
        matches: Any = None,
        inliers: "Optional[ArrayLike]" = None,
        reference: "str | int | Reference | None" = None,
        truth: Any = None,
        name: Optional[str] = None,
        time: Optional[float] = None,
    ) -> None:
        """Adds a query. Returns at once: photo and pose are written, and the verdict is made, on other threads.

        All arguments are checked before anything of the query is recorded.

        Args:
            photo: uint8, H x W or H x W x 3. It is copied.
            camera: The camera, also one of pycolmap without distortion. Queries may have different ones.
            world_from_camera: The pose that the localiser found, 4 x 4 [m], or what has a ``cam_from_world``, such as
                the answer of an estimator of pycolmap; None if it found none.
            matches: Query points and reference points (N x 2 [px]) and perhaps scores, or a list of ``DMatch``, as in
                :func:`localize`; ``reference`` says of which frame. The run then has ``fb`` beside the localiser: what
                it makes of the same matches, with verdicts.
            inliers: Which of the matches are inliers: N booleans, or their positions. Matches and inliers are stored
                in ``matches`` and ``inliers`` of the folder, as ``--matches`` reads them.
            reference: The frame of the scene, or the reference, that the localiser used. By default the nearest frame.
                Without a scene, a :class:`Reference`, which is stored with the recording.
            truth: The true pose, 4 x 4, where it is known. It is stored with the query.
            name: The name of the query, with ``/`` between folders. By default its number.
            time: When the photo was taken [s].

        Raises:
            TypeError: An argument is of another type.
            ValueError: An array has another dtype or shape than documented, or a name is used twice.
            InputError: The scene has no frame ``reference`` with a pose and a cloud.
            RuntimeError: The recording is closed.
        """
        if self._closing:
            raise RuntimeError("the recording is closed")
        camera = _posescope.camera_of(camera)
        _posescope.check_photo(photo, camera)
        pose = None if world_from_camera is None else _posescope.pose_parts("world_from_camera", world_from_camera)
        true_pose = None if truth is None else _posescope.pose_parts("truth", truth)
        if time is not None and not math.isfinite(time):
            raise ValueError(f"time: a finite number of seconds expected, {time!r} given")
        given, chosen = _given(matches, inliers)
        if given is not None and reference is None:
            raise ValueError("reference: the frame that the matches belong to expected")
        held = self._held(reference)
        if held is not None:
            used: Optional[str] = held.name
        else:
            used = None if reference is None else _posescope.reference_name(_of(self._folder.scene), reference)
        array = np.asarray(photo, np.uint8)
        with self._lock:
            name = f"{len(self._names):06}" if name is None else name
            _check_name(name, self._names)
            self._names.add(name)
            logged = Logged(name, camera, None if time is None else float(time), pose, true_pose, used)
            if self._bytes + array.nbytes > self._bytes_allowed:
                logged.skipped = _LARGE.format(name=name)
            else:
                logged.bytes = array.nbytes
                self._bytes += array.nbytes
                if self._pending >= self._waiting:
                    logged.skipped = _LATE.format(name=name)
            if logged.skipped is None:
                self._pending += 1
            else:
                self._skipped += 1
            logged.held = held
            logged.matches, logged.inliers, logged.has_matches = given, chosen, given is not None
            if logged.bytes:
                logged.photo = self._copied(array)
            self._to_save.put(logged)

    def _copied(self, photo: "np.ndarray[Any, Any]") -> "np.ndarray[Any, Any]":
        """A copy, into the memory of a photo that is done where one has the same shape: new memory takes longer."""
        for at, spare in enumerate(self._spare):
            if spare.shape == photo.shape:
                np.copyto(self._spare.pop(at), photo)
                return spare
        self._spare.clear()
        return np.array(photo, order="C")

    def close(self) -> Run:
        """Waits for the verdicts that are due, saves the worst recordings and the report, and returns the run.

        Whatever cannot be written, the rest is.

        Raises:
            OSError: A file could not be written.
        """
        if not self._closed:
            self._closing = True
            self._to_save.put(None)
            for thread in self._threads:
                thread.join()
            self._closed = True
            self._folder.close()
            for work in (self._folder.plan, self._save_worst, self._summarise):
                with self._remembered():
                    work()
        if self._broken is not None:
            raise OSError(f"{self.path}: the recording is not complete: {self._broken}") from self._broken
        return Run(self.path)

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

    @contextlib.contextmanager
    def _remembered(self) -> Iterator[None]:
        """Keeps the first error for the end."""
        try:
            yield
        except Exception as error:  # noqa: BLE001
            self._broken = self._broken or error

    def _held(self, reference: Any) -> Optional[Reference]:
        """The reference on its own, where the recording has no scene, with its name and files."""
        if self._folder.scene is not None or reference is None:
            return None
        if not isinstance(reference, Reference):
            given = type(reference).__name__
            raise TypeError(f"reference: posescope.Reference expected, as the recording has no scene, {given} given")
        last = self._held_last.get(id(reference))
        if last is not None:
            return last[1]
        _check_name(reference.name, set(), "reference")
        if not self._folder.knows(_posescope.fingerprint(reference), reference.name):
            raise ValueError(f"reference: another one is called `{reference.name}`; give each a name of its own")
        if len(self._held_last) >= _HELD:
            self._held_last.pop(next(iter(self._held_last)))
        alone = _posescope.alone(reference)
        self._held_last[id(reference)] = reference, alone
        return alone

    def _save_all(self) -> None:
        """Writes photos, references, poses and matches."""
        saved = self._folder.saved_references()
        while True:
            logged = self._to_save.get()
            if logged is not None:
                with self._remembered():
                    if logged.held is not None and logged.held.name not in saved:
                        self._folder.save_reference(logged.held)
                        saved.add(logged.held.name)
                with self._remembered():
                    self._folder.save(logged)
                if logged.skipped is not None:
                    self._release(logged)
            self._to_judge.put(logged)
            if logged is None:
                return

    def _release(self, logged: Logged) -> None:
        """Gives the memory of a photo back."""
        with self._lock:
            self._bytes -= logged.bytes
            if logged.photo is not None and len(self._spare) < _SPARE:
                held = self._bytes + sum(spare.nbytes for spare in self._spare)
                if held + logged.photo.nbytes <= self._bytes_allowed:
                    self._spare.append(logged.photo)
        logged.photo, logged.bytes = None, 0

    def _judge_all(self) -> None:
        """Makes the verdicts, in the order of the queries."""
        while True:
            logged = self._to_judge.get()
            if logged is None:
                return
            is_counted = logged.skipped is None and logged.bytes > 0
            # After a result that could not be written none is: they stand in the order of the queries.
            if not self._is_stopped:
                self._is_stopped = True
                with self._remembered():
                    if logged.has_matches:
                        self._folder.begin_matches()
                    self._folder.add(self._judged, self._lines(logged))
                    self._judged += 1
                    self._is_stopped = False
            self._release(logged)
            if is_counted:
                with self._lock:
                    self._pending -= 1

    def _lines(self, logged: Logged) -> List[str]:
        """The results of a query: the localiser's, and that of ``fb`` where the run has matches."""
        methods = [self._folder.settings.name, "fb"] if self._folder.has_matches else [self._folder.settings.name]
        return [self._line(logged, method) for method in methods]

    def _line(self, logged: Logged, method: str) -> str:
        """The result of a method. What cannot be judged has none but its pose."""
        pose = logged.pose if method != "fb" else None
        why: Dict[str, Optional[str]] = {"missing": logged.skipped if method == "fb" else None}
        if logged.skipped is None:
            try:
                result = self._result(logged, method)
                if result is not None:
                    return result.to_json()
            except InputError as error:
                why = {"unreadable": str(error)}
            except Exception as error:  # noqa: BLE001
                why = {"bug": str(error) or type(error).__name__}
        return self._folder.unjudged(logged.name, method, pose, logged.truth, **why)

    def _result(self, logged: Logged, method: str) -> Optional[Result]:
        """The verdict on a query; None where there is nothing to judge."""
        if (logged.pose is None) if method != "fb" else not logged.has_matches:
            return None
        reference = logged.held
        if reference is None:
            name = logged.reference
            if name is None and self._folder.scene is not None and logged.pose is not None:
                name = _posescope.nearest(self._folder.scene, logged.pose)
            if name is None:
                return None
            reference = self._folder.saved_reference(name)
        if logged.photo is None:
            query = self._folder.saved_query(logged)
        else:
            truth = None if logged.truth is None else _posescope.pose_of(logged.truth)
            query = Query(logged.photo, logged.camera, logged.name, truth)
        radius, right, explain = self._folder.settings.judging
        # One thread, so that the caller keeps the others.
        if method == "fb":
            matches = logged.matches or self._folder.saved_matches(logged.name, reference.name)
            return localize(
                query, reference, matches=matches, threads=1, radius=radius, right=right, explain=explain
            )
        pose = _posescope.pose_of(_of(logged.pose))
        return diagnose(query, reference, pose, name=method, threads=1, radius=radius, right=right)

    def _save_worst(self) -> None:
        """Saves recordings of the worst queries."""
        if self._keep == 0:
            return
        worst: List[Tuple[Tuple[float, ...], int, str]] = []
        for at, row in enumerate(self._folder.rows()):
            if row["method"] != self._folder.settings.name or not row["references"] and row["pose"] is not None:
                continue
            entry = (_badness(row), -at, str(row["query"]))
            if len(worst) < self._keep:
                heapq.heappush(worst, entry)
            else:
                heapq.heappushpop(worst, entry)
        queries = {query for _, _, query in worst}
        again = [logged for logged in self._folder.logged() if logged.name in queries and logged.skipped is None]
        methods = [self._folder.settings.name, *(["fb"] if self._folder.has_matches else [])]
        wanted = [(logged, method) for logged in again for method in methods]
        files = _posescope.recording_files(
            os.fspath(self.path), [(logged.name, method) for logged, method in wanted]
        )
        folder = self.path / "failures"
        folder.mkdir(exist_ok=True)
        # Those of a recording that is resumed may not be the worst any more.
        for old in folder.glob("*.rrd"):
            if old.name not in files:
                old.unlink()
        for (logged, method), file in zip(wanted, files):
            with self._remembered():
                result = self._result(logged, method)
                if result is not None and file is not None:
                    result.save(folder / file)

    def _summarise(self) -> None:
        """Writes summary, report and JUnit."""
        _posescope.summarise(os.fspath(self.path), [])


def _of(value: Any) -> Any:
    """A value that is there."""
    assert value is not None
    return value


def _check_name(name: Any, used: "set[str]", what: str = "name") -> None:
    """Refuses what no file can be called, and what is used already."""
    if not isinstance(name, str):
        raise TypeError(f"{what}: a name expected, {type(name).__name__} given")
    parts = name.split("/")
    is_safe = not _UNSAFE & set(name) and not any(letter.isspace() or not letter.isprintable() for letter in name)
    if not is_safe or any(part in ("", ".", "..") for part in parts):
        raise ValueError(f"{what}: a name that a file can have expected, without white space, `{name}` given")
    if name in used:
        raise ValueError(f"{what}: a new name expected, `{name}` is recorded already")


def _given(matches: Any, inliers: "Optional[ArrayLike]") -> Tuple[Optional[Triple], Optional[Triple]]:
    """Copies of the matches and of those that are inliers."""
    if matches is None:
        if inliers is not None:
            raise ValueError("matches: the matches that the inliers are among expected")
        return None, None
    queries, references, scores = triple(matches)
    # Checked before they are copied: an array may say that it is of any size.
    _posescope.check_matches((queries, references, scores))
    given = np.array(queries), np.array(references), None if scores is None else np.array(scores)
    return given, None if inliers is None else _inliers_of(given, inliers)


def _inliers_of(matches: Triple, inliers: "ArrayLike") -> Triple:
    """The matches that are inliers."""
    chosen = np.asarray(inliers)
    if chosen.size == 0 and chosen.ndim == 1:
        chosen = chosen.astype(np.int64)
    if chosen.dtype.kind not in "biu" or chosen.ndim != 1:
        raise ValueError(f"inliers: booleans or positions expected, {chosen.dtype} of shape {chosen.shape} given")
    queries, references, scores = matches
    try:
        return queries[chosen], references[chosen], None if scores is None else scores[chosen]
    except IndexError as error:
        raise ValueError(f"inliers: {error}") from error


def _badness(row: Dict[str, Any]) -> Tuple[float, ...]:
    """Greater for a result that is more worth looking at."""
    grades = {"wrong": 3, "no pose": 2, "unmeasured": 1, "right": 0}
    known, error = row["confidence"], row["error"]
    return (
        grades.get(row["grade"], 0),
        len(row["diagnosis"]),
        0.0 if error is None else error["translation_m"],
        0.0 if known is None else 1.0 - known["probability"],
    )
