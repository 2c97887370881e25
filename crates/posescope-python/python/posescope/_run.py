"""Run folders: what `posescope eval` and `posescope.record` write."""

from __future__ import annotations

import html
import json
import os
from collections import Counter
from pathlib import Path
from typing import Any, Dict, List, Optional

from . import _posescope
from ._errors import InputError
from ._table import error_vector, table

_RESULTS = "results.jsonl"
_GRADES = ("right", "wrong", "no pose", "unmeasured")


class GateError(Exception):
    """A gate of an evaluation failed.

    Attributes:
        run: The run, which is complete.
    """

    def __init__(self, message: str, run: "Run") -> None:
        # With both, the error can be pickled: a pool of processes passes it on.
        super().__init__(message, run)
        self.run = run

    def __str__(self) -> str:
        return str(self.args[0])


class Run:
    """A run folder. In a notebook it shows how many queries were right, by method."""

    def __init__(self, path: Path) -> None:
        self._path = path

    @staticmethod
    def open(path: "str | os.PathLike[str]") -> "Run":
        """Opens a run folder.

        Args:
            path: The folder that `posescope eval --out`, `evaluate` or `record` wrote.

        Raises:
            InputError: There is no run.
        """
        folder = Path(path)
        if not (folder / "run.toml").is_file():
            raise InputError(str(folder), "", "the folder of a run expected, with a run.toml")
        return Run(folder)

    @property
    def path(self) -> Path:
        """The folder."""
        return self._path

    def rows(self) -> List[Dict[str, Any]]:
        """The results as dicts; docs/results.md explains their fields.

        Raises:
            InputError: A line is damaged.
        """
        file = self._path / _RESULTS
        rows: List[Dict[str, Any]] = []
        try:
            text = file.read_text(encoding="utf-8")
        except OSError as error:
            raise InputError(str(file), "", error.strerror or str(error)) from error
        # What a killed process wrote last has no end.
        for number, line in enumerate(text[: text.rfind("\n") + 1].splitlines(), 1):
            try:
                rows.append(json.loads(line))
            except ValueError as error:
                raise InputError(str(file), f"line {number}", f"a result expected, {error}") from error
        return rows

    def results(
        self, library: Optional[str] = None, method: Optional[str] = None, grade: Optional[str] = None
    ) -> Any:
        """The results as a table, one row each. Columns and their types are the same for every run.

        Args:
            library: ``polars``, ``pandas``, ``pyarrow`` or ``list``. By default the first that is installed; without
                any, a list of dicts.
            method: Only those of this method.
            grade: Only those of this grade: ``right``, ``wrong``, ``no pose`` or ``unmeasured``.

        ``error.right_m``, ``error.down_m`` and ``error.forward_m`` are in the frame of the true camera. They and
        ``time_s`` need the scene of the queries.

        Raises:
            ValueError: There is no such library or grade.
            ImportError: The library is not installed.
            InputError: A line is damaged.
        """
        if grade not in (None, *_GRADES):
            raise ValueError(f"grade: {', '.join(_GRADES)} expected, `{grade}` given")
        rows = [
            row
            for row in self.rows()
            if method in (None, row["method"]) and grade in (None, row["grade"])
        ]
        facts = _posescope.query_facts(os.fspath(self._path))
        for row in rows:
            truth, row["time_s"] = facts.get((row.get("query_scene") or row["scene"], row["query"]), (None, None))
            if truth is not None and row["pose"] is not None and row["error"] is not None:
                row["error_vector"] = error_vector(row["pose"]["position_m"], truth)
        return table(rows, library)

    def to_tum(
        self, path: "str | os.PathLike[str]", method: Optional[str] = None, grade: Optional[str] = None
    ) -> Path:
        """Writes the poses as TUM RGB-D and evo read them: ``time x y z qx qy qz qw``, and returns the path.

        Args:
            path: The file.
            method: The method, where the run has several.
            grade: Only the poses of this grade.

        Raises:
            ValueError: Queries have no time, or several results are left of one.
            InputError: The run cannot be read.
        """
        return self._exported("tum", Path(path), method, grade)

    def to_vloc(
        self, path: "str | os.PathLike[str]", method: Optional[str] = None, grade: Optional[str] = None
    ) -> Path:
        """Writes the poses as visuallocalization.net and hloc do: ``name qw qx qy qz x y z``, world to camera.

        The arguments and exceptions are those of :func:`Run.to_tum`.
        """
        return self._exported("vloc", Path(path), method, grade)

    def to_colmap(
        self, path: "str | os.PathLike[str]", method: Optional[str] = None, grade: Optional[str] = None
    ) -> Path:
        """Writes the poses as a text model of COLMAP without points, into a folder.

        The arguments and exceptions are those of :func:`Run.to_tum`.
        """
        return self._exported("colmap", Path(path), method, grade)

    def _exported(self, format: str, path: Path, method: Optional[str], grade: Optional[str]) -> Path:
        if grade not in (None, *_GRADES):
            raise ValueError(f"grade: {', '.join(_GRADES)} expected, `{grade}` given")
        for name, text in _posescope.exported(os.fspath(self._path), format, method, grade):
            file = path / name if name else path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, encoding="utf-8")
        return path

    def gate(self, *gates: str) -> None:
        """Checks gates as ``posescope eval --gate`` does, also of a recorded run, and writes them into the summary.

        Args:
            gates: Conditions such as ``right@mine >= 0.9`` or ``share(D3)@mine <= 0.05``.

        Raises:
            GateError: A gate failed.
            ValueError: A gate is not possible.
        """
        failed = _posescope.summarise(os.fspath(self._path), list(gates))
        if failed is not None:
            raise GateError(failed, self)

    def summary(self) -> Dict[str, Any]:
        """Figures by group and method, gates and findings: ``summary.json``, which is made where a process was killed
        before.

        Raises:
            InputError: The summary is damaged.
            OSError: The run cannot be read.
        """
        file = self._path / "summary.json"
        if not file.exists():
            _posescope.summarise(os.fspath(self._path), [])
        try:
            found: Dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise InputError(str(file), "", f"a summary expected, {error}") from error
        return found

    def report(self) -> Path:
        """Writes ``report.html`` with the pictures that prove the worst failures, and returns its path.

        Raises:
            OSError: The run cannot be read, or the file cannot be written.
        """
        return Path(_posescope.write_report(os.fspath(self._path)))

    def grades(self) -> Dict[str, Dict[str, int]]:
        """How many queries got each grade, by method."""
        counted: Dict[str, Counter[str]] = {}
        for row in self.rows():
            counted.setdefault(row["method"], Counter())[row["grade"]] += 1
        return {method: dict(grades) for method, grades in counted.items()}

    def __repr__(self) -> str:
        return f"<Run {self._path}>"

    def _repr_html_(self) -> str:
        grades = self.grades()
        head = "".join(f"<th>{name}</th>" for name in ["method", *_GRADES])
        rows = "".join(
            f"<tr><td>{html.escape(method)}</td>"
            + "".join(f"<td>{counts.get(name, 0)}</td>" for name in _GRADES)
            + "</tr>"
            for method, counts in grades.items()
        )
        return f"<div>{html.escape(str(self._path))}</div><table><tr>{head}</tr>{rows}</table>"
