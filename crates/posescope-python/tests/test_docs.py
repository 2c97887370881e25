"""The Python code of README and docs runs, and everything public is documented."""

from __future__ import annotations

import importlib
import inspect
import os
import re
from pathlib import Path

import pytest

import posescope

ROOT = Path(__file__).parents[3]
BLOCK = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)
PAGES = [ROOT / "README.md", ROOT / "docs" / "python.md"]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_the_code_of_a_page_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocks = BLOCK.findall(page.read_text(encoding="utf-8"))
    assert blocks, page
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    for block in blocks:
        exec(compile(block, str(page), "exec"), names)  # noqa: S102


def test_everything_public_has_a_docstring() -> None:
    missing = []
    for name in posescope.__all__:
        thing = getattr(posescope, name)
        if name == "__version__":
            continue
        if not inspect.getdoc(thing):
            missing.append(name)
        if inspect.isclass(thing) and not issubclass(thing, Exception):
            for member, value in vars(thing).items():
                is_documented = isinstance(value, property) or callable(value) or inspect.isdatadescriptor(value)
                if not member.startswith("_") and is_documented and not inspect.getdoc(value):
                    missing.append(f"{name}.{member}")
    assert missing == []


def test_the_reference_is_made_from_the_docstrings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parents[1]))
    reference = importlib.import_module("reference")
    stored = ROOT / "docs" / "python-reference.md"
    if os.environ.get("UPDATE_DOCS"):
        stored.write_text(reference.page(), encoding="utf-8")
    hint = "run: UPDATE_DOCS=1 pytest crates/posescope-python/tests/test_docs.py"
    assert reference.page() == stored.read_text(encoding="utf-8"), hint
