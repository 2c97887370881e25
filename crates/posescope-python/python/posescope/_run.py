"""Run folders: what `posescope eval` and `posescope.record` write."""

from __future__ import annotations

import html
import importlib
import importlib.util
import json
import os
from collections import Counter
from pathlib import Path
from typing import Any, Dict, List, Optional

from . import _posescope
from ._errors import InputError

_RESULTS = "results.jsonl"
_LIBRARIES = ("polars", "pandas", "pyarrow")


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
            lines = file.read_text(encoding="utf-8").splitlines()
        except OSError as error:
            raise InputError(str(file), "", error.strerror or str(error)) from error
        for number, line in enumerate(lines, 1):
            try:
                rows.append(json.loads(line))
            except ValueError as error:
                raise InputError(str(file), f"line {number}", f"a result expected, {error}") from error
        return rows

    def results(self, library: Optional[str] = None) -> Any:
        """The results as a table, one row each, with columns such as ``error.translation_m``.

        Args:
            library: ``polars``, ``pandas``, ``pyarrow`` or ``list``. By default the first that is installed; without
                any, a list of flat dicts.

        Raises:
            ValueError: There is no such library.
            ImportError: The library is not installed.
            InputError: A line is damaged.
        """
        if library not in (None, "list", *_LIBRARIES):
            raise ValueError(f"library: polars, pandas, pyarrow or list expected, `{library}` given")
        flat = [_flat(row) for row in self.rows()]
        installed = (name for name in _LIBRARIES if importlib.util.find_spec(name))
        chosen = library or next(installed, "list")
        if chosen == "list":
            return flat
        # All rows have all columns: a missing value is None.
        names = list(dict.fromkeys(name for row in flat for name in row))
        columns = {name: [row.get(name) for row in flat] for name in names}
        module: Any = importlib.import_module(chosen)
        if chosen == "pyarrow":
            return module.table(columns)
        if chosen == "polars":
            return module.DataFrame(columns, strict=False)
        return module.DataFrame(columns)

    def summary(self) -> Dict[str, Any]:
        """Figures by group and method, gates and findings: ``summary.json``.

        Raises:
            InputError: The run has no summary, or a damaged one.
        """
        file = self._path / "summary.json"
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
        names = ["right", "wrong", "no pose", "unmeasured"]
        head = "".join(f"<th>{name}</th>" for name in ["method", *names])
        rows = "".join(
            f"<tr><td>{html.escape(method)}</td>"
            + "".join(f"<td>{counts.get(name, 0)}</td>" for name in names)
            + "</tr>"
            for method, counts in grades.items()
        )
        return f"<div>{html.escape(str(self._path))}</div><table><tr>{head}</tr>{rows}</table>"


def _flat(row: Dict[str, Any], prefix: str = "") -> Dict[str, Any]:
    """Nested objects as columns with dots; lists of objects as JSON, but for the codes of the verdicts."""
    flat: Dict[str, Any] = {}
    for key, value in row.items():
        name = prefix + key
        if isinstance(value, dict):
            flat.update(_flat(value, f"{name}."))
        elif name == "diagnosis":
            flat["verdicts"] = [one["code"] for one in value]
            flat["verdict"] = value[0]["text"] if value else None
        elif isinstance(value, list) and any(isinstance(one, dict) for one in value):
            flat[name] = json.dumps(value)
        else:
            flat[name] = value
    return flat
