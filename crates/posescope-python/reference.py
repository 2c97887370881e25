"""Writes the reference of the Python package from its docstrings: prints Markdown.

UPDATE_DOCS=1 pytest crates/posescope-python/tests/test_docs.py stores it in docs/python-reference.md.
"""

from __future__ import annotations

import ast
import dataclasses
import inspect
import re
import textwrap
from typing import Any, List

import posescope

ORDER = [
    "localize",
    "diagnose",
    "evaluate",
    "doctor",
    "calibration",
    "record",
    "Camera",
    "Query",
    "Reference",
    "Scene",
    "Result",
    "Failure",
    "Verdict",
    "PoseError",
    "Confidence",
    "Opinion",
    "Run",
    "Examination",
    "Calibration",
    "Recording",
    "InputError",
    "GateError",
    "InternalError",
    "methods",
    "main",
]
MADE_BY_CALLERS = {"Camera", "Query", "Reference"}
SECTION = re.compile(r"^(Args|Returns|Raises|Attributes):$")


def signature(thing: Any) -> str:
    try:
        found = inspect.signature(thing)
    except (TypeError, ValueError):
        return ""
    bare = [one.replace(annotation=inspect.Parameter.empty) for one in found.parameters.values() if one.name != "self"]
    return str(found.replace(parameters=bare, return_annotation=inspect.Signature.empty))


def text(thing: Any) -> List[str]:
    """A docstring with its sections as lists."""
    lines: List[str] = []
    in_section = has_entries = False
    for line in (inspect.getdoc(thing) or "").splitlines():
        section = SECTION.match(line)
        entry = re.match(r"^    (\S[^:]*): (.*)$", line)
        if section:
            in_section, has_entries = True, section.group(1) != "Returns"
            lines += [f"*{section.group(1)}*", ""]
        elif has_entries and entry:
            lines.append(f"- `{entry.group(1)}`: {entry.group(2)}")
        else:
            lines.append("  " + line.strip() if in_section and line.strip() else line.strip())
    return [line.replace("``", "`").replace(":func:", "").rstrip() for line in lines]


def fields(thing: Any) -> List[str]:
    """The fields of a dataclass, each with the string below it."""
    body: List[ast.stmt] = []
    for node in ast.parse(textwrap.dedent(inspect.getsource(thing))).body:
        body = node.body if isinstance(node, ast.ClassDef) else body
    lines: List[str] = []
    for field, note in zip(body, body[1:]):
        if isinstance(field, ast.AnnAssign) and isinstance(note, ast.Expr) and isinstance(note.value, ast.Constant):
            words = " ".join(str(note.value.value).split()).replace("``", "`")
            lines.append(f"- `{ast.unparse(field.target)}`: {words}")
    return lines


def members(thing: Any) -> List[str]:
    lines: List[str] = fields(thing) if dataclasses.is_dataclass(thing) else []
    public = [(name, value) for name, value in vars(thing).items() if not name.startswith("_")]
    of_rust = [(name, value) for name, value in public if inspect.isgetsetdescriptor(value)]
    if of_rust:
        # They have no order.
        public.sort(key=lambda one: one[0])
    for name, value in public:
        if isinstance(value, property) or inspect.isgetsetdescriptor(value):
            lines.append(f"- `{name}`: {' '.join(text(value)).strip()}")
    for name, value in public:
        if callable(value) or isinstance(value, staticmethod):
            function = value.__func__ if isinstance(value, staticmethod) else value
            lines += ["", f"#### `{thing.__name__}.{name}{signature(function)}`", "", *text(function)]
    return lines


def page() -> str:
    missing = set(posescope.__all__) - set(ORDER) - {"__version__"}
    assert not missing, missing
    lines = ["# Python reference", "", "Made from the docstrings. [How to use it](python.md)."]
    for name in ORDER:
        thing = getattr(posescope, name)
        shows_call = not inspect.isclass(thing) or name in MADE_BY_CALLERS
        call = signature(thing) if shows_call else ""
        lines += ["", f"## `{name}{call}`", "", *text(thing)]
        if inspect.isclass(thing) and not issubclass(thing, Exception):
            lines += ["", *members(thing)]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines)) + "\n"


if __name__ == "__main__":
    print(page(), end="")
