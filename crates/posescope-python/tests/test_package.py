"""The package itself: completed names, no circles of imports, short representations, pictures."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path
from typing import Dict, Set

import numpy as np
import pytest

import posescope

PACKAGE = Path(__file__).parents[1] / "python" / "posescope"


def test_completed_names_are_those_of_the_package() -> None:
    assert dir(posescope) == sorted(posescope.__all__)
    # A completer that reads the file alone finds no others either.
    of_file = {name for name in vars(posescope) if not name.startswith("_")}
    assert of_file <= set(posescope.__all__), of_file - set(posescope.__all__)


def imported(file: Path) -> Set[str]:
    """The files of the package that one imports, also for types alone, and those that it names to import."""
    names: Set[str] = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level == 1:
            names |= {node.module} if node.module else {alias.name for alias in node.names}
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.startswith("posescope._"):
            names.add(node.value.split(".")[1])
    return {name for name in names if (PACKAGE / f"{name}.py").exists()}


def test_no_files_import_each_other_in_a_circle() -> None:
    imports: Dict[str, Set[str]] = {file.stem: imported(file) for file in PACKAGE.glob("*.py")}
    assert len(imports) > 10 and imports["_record"]
    done: Set[str] = set()
    while True:
        ready = {name for name, needs in imports.items() if name not in done and needs <= done}
        if not ready:
            break
        done |= ready
    assert done == set(imports), f"a circle among {sorted(set(imports) - done)}"


def test_representations_are_short_and_notebooks_show_pictures(street: posescope.Scene) -> None:
    examined = posescope.doctor(street)
    assert len(repr(examined)) < 200 and "fits" in repr(examined)
    shown = examined._repr_html_()
    assert "data:image/png;base64," in shown and "<pre>" in shown
    values = [street, street.query("70"), street.reference("62"), street.query("70").camera]
    values += [posescope.localize(street.query("70"), street.reference("62"), method="fb")]
    assert all(len(repr(value)) < 300 for value in values)


def test_a_wrong_pose_of_others_has_a_picture_and_its_distance(street: posescope.Scene) -> None:
    query, reference = street.query("70"), street.reference("62")
    truth = np.array(query.truth)
    seen = set()
    for right, down, forward in ((3, 0, 0), (0, 0, 4), (6, 0, 0), (0, 2, 0), (40, 0, 0), (0, 0, -30)):
        moved = truth.copy()
        moved[:3, 3] += moved[:3, :3] @ [right, down, forward]
        result = posescope.diagnose(query, reference, moved, name="mine")
        assert result.grade == "wrong" and result.verdicts
        proof = result.proof()
        assert proof is not None and proof[0].startswith("data:image/jpeg;base64,")
        first = result.verdicts[0]
        seen.add(first.code)
        off = (right**2 + down**2 + forward**2) ** 0.5
        assert result.opinion is not None and abs(float(np.linalg.norm(result.opinion.offset_m)) - off) < 0.2
    # The other system did not search, so no verdict is about a search.
    assert seen == {"E3"}, seen
    lost = posescope.localize(query, reference, matches=(np.zeros((0, 2)), np.zeros((0, 2))))
    assert lost.proof() is not None


def test_the_report_of_a_recording_has_pictures_and_speaks_of_the_localiser(
    street: posescope.Scene, tmp_path: Path
) -> None:
    query, reference = street.query("70"), street.reference("62")
    points = np.zeros((0, 2))
    with posescope.record(tmp_path / "live", street, name="mine", keep=0) as log:
        for off in (3.0, 4.0, 5.0):
            moved = np.array(query.truth)
            moved[:3, 3] += moved[:3, :3] @ [off, 0, 0]
            log.query(
                query.photo, query.camera, moved, truth=query.truth, reference=reference, matches=(points, points)
            )
    report = (tmp_path / "live" / "report.html").read_text()
    assert "mine is right for none of 3 queries." in report
    # Three thumbnails, and a proof for each of six failures.
    assert report.count("data:image/jpeg;base64,") >= 9, report.count("data:image/jpeg;base64,")


def test_the_import_is_quick_and_light() -> None:
    code = (
        "import sys, numpy; before = set(sys.modules); import posescope; "
        "print(sorted(name for name in set(sys.modules) - before if name.split('.')[0] in "
        "('pandas', 'polars', 'pyarrow', 'tqdm', 'rerun', 'cv2', 'multiprocessing', 'asyncio')))"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[]"


@pytest.mark.parametrize("gate", ["right@fb >= 2", "recall@1m,5deg@fb > 1.5"])
def test_a_gate_that_cannot_hold_is_refused_before_the_first_query(gate: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="from 0 to 1 expected"):
        posescope.evaluate("street", tmp_path / "run", limit=1, method="fb", gate=[gate], progress=False)
    assert not (tmp_path / "run").exists()
