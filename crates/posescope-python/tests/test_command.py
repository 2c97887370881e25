"""The functions give the bytes of the command."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

import posescope

MAIN = "import sys, posescope; sys.exit(posescope.main())"


def command(*arguments: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run([sys.executable, "-c", MAIN, *arguments], capture_output=True, text=True, check=False)


def without_setting(line: str) -> str:
    """What `eval` adds to each result: the radius and the number of references that it varies."""
    return re.sub(r'"setting":\{[^}]*\},', "", line)


@pytest.mark.parametrize("method", ["fb", "mi", "robust"])
def test_localize_gives_the_bytes_of_a_results_file(
    method: str, street: posescope.Scene, tmp_path: Path
) -> None:
    run = posescope.evaluate(
        street, tmp_path / "run", limit=2, method=method, keep_failures=0, progress=False
    )
    lines = (run.path / "results.jsonl").read_text().splitlines()
    assert len(lines) == 2
    for line in lines:
        row = json.loads(line)
        query = street.query(row["query"])
        reference = street.reference(row["references"][0])
        for threads in (1, 2):
            result = posescope.localize(query, reference, method=method, threads=threads)
            assert result.to_json() == without_setting(line)


def test_queries_of_another_scene_give_the_same_bytes_too(tmp_path: Path) -> None:
    night, snow = posescope.Scene.street("night"), posescope.Scene.street("snow")
    out = tmp_path / "night.jsonl"
    words = "run street:snow --query-scene street:night --query 450 --reference 450 --method fb2".split()
    ran = command(*words, "--json", str(out), "--quiet")
    assert ran.returncode == 0, ran.stderr
    result = posescope.localize(night.query("450"), snow.reference("450"), method="fb2")
    assert result.to_json() + "\n" == out.read_text()


def test_a_saved_recording_holds_what_that_of_the_command_holds(street: posescope.Scene, tmp_path: Path) -> None:
    theirs, ours = tmp_path / "theirs.rrd", tmp_path / "ours.rrd"
    words = "run street --query 70 --reference 62 --method fb --quiet".split()
    assert command(*words, "--save", str(theirs)).returncode == 0
    posescope.localize(street.query("70"), street.reference("62"), method="fb").save(ours)
    # Rows have ids of their own, so that two recordings of one run differ by some bytes.
    assert ours.stat().st_size == pytest.approx(theirs.stat().st_size, rel=0.01)


def test_the_command_is_the_program() -> None:
    ran = command("--version")
    assert (ran.returncode, ran.stdout) == (0, f"posescope {posescope.__version__}\n")
    assert command("--nonsense").returncode == 2
    wrong = command("run", "nowhere", "--query", "1")
    assert wrong.returncode == 3 and wrong.stderr.startswith("posescope: nowhere: no such file")


def test_an_evaluation_is_a_run(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "run"
    run = posescope.evaluate("street", out, limit=2, method=["fb"], keep_failures=1, progress=False)
    assert capfd.readouterr() == ("", "")
    assert {row["method"] for row in run.rows()} == {"fb"} and len(run.rows()) == 2
    assert sum(run.grades()["fb"].values()) == 2
    flat = run.results("list")
    assert "confidence.probability" in flat[0] and "codes" in flat[0]
    assert run.report().read_text().startswith("<!DOCTYPE html>")
    assert run.summary()["groups"]
    assert "<table>" in run._repr_html_()
    with pytest.raises(ValueError, match="parquet"):
        run.results("parquet")
    with pytest.raises(ValueError, match="is not empty|holds|empty"):
        posescope.evaluate("street", out, limit=2, method="fb", progress=False)
    with pytest.raises(ValueError, match="sift"):
        posescope.evaluate("street", tmp_path / "a", method="sift", progress=False)
    with pytest.raises(ValueError, match="nonsense"):
        posescope.evaluate("street", tmp_path / "b", nonsense=1, progress=False)
    with pytest.raises(posescope.InputError):
        posescope.evaluate(tmp_path / "nowhere", tmp_path / "c", progress=False)
    with pytest.raises(posescope.InputError, match="run.toml"):
        posescope.Run.open(tmp_path)


def test_a_failed_gate_is_an_exception_with_the_run(tmp_path: Path) -> None:
    with pytest.raises(posescope.GateError, match="gate") as raised:
        posescope.evaluate(
            "street", tmp_path / "run", limit=1, method="fb", gate=["right@fb > 1"], progress=False
        )
    assert len(raised.value.run.rows()) == 1


def test_damaged_lines_are_named(tmp_path: Path) -> None:
    (tmp_path / "run.toml").write_text("")
    (tmp_path / "results.jsonl").write_text('{"a": 1}\n{"a"\n')
    with pytest.raises(posescope.InputError) as raised:
        posescope.Run.open(tmp_path).rows()
    assert raised.value.place == "line 2"


def test_the_doctor_says_what_the_command_prints(tmp_path: Path) -> None:
    found = posescope.doctor("street")
    assert not found.is_broken and found.mistake is None
    assert (found.answer, found.write) == ("fits", None)
    assert found.agreement is not None and found.agreement[0] is not None and found.agreement[0] > 0.5
    assert found.picture is not None and found.picture.ndim == 3
    ran = command("doctor", "street")
    assert ran.stdout.split() == found.text.split()
    with pytest.raises(posescope.InputError):
        posescope.doctor(tmp_path / "nowhere")


def test_a_calibration_is_data(tmp_path: Path) -> None:
    command("synth", str(tmp_path), "--size", "half", "--every", "40", "--condition", "overcast", "-q")
    found = posescope.calibration(tmp_path / "sequences" / "overcast")
    assert found.answer == "consistent" and found.delay_s is None
    assert found.turn_deg is not None and found.shift_m is not None
    for value, half in found.turn_deg + found.shift_m:
        assert abs(value) < 3 * half < 1
    assert found.camera_from_stated is not None and found.camera_from_stated.shape == (4, 4)
    assert found.picture is not None and found.picture.shape[2] == 3
    assert "consistent" in found.text


def test_each_error_has_its_class_file_and_place(tmp_path: Path) -> None:
    known = tmp_path / "known.txt"
    known.write_text("70 fb\n70 fb D3 too many words\n")
    with pytest.raises(posescope.InputError) as raised:
        posescope.evaluate("street", tmp_path / "a", known_failures=known, progress=False)
    assert (raised.value.file, raised.value.place) == (str(known), "line 2")
    with pytest.raises(posescope.InputError, match="nothing") as raised:
        posescope.evaluate("street", tmp_path / "b", baseline=tmp_path / "nothing", progress=False)
    assert raised.value.file == str(tmp_path / "nothing")
    for options in (
        {"gate": "right@mi >= 0.5", "method": "fb"},
        {"radius": -1},
        {"limit": "many"},
        {"reference": ["70", "nearest:2"]},
        {"set": "fb.ratio=7"},
        {"sweep": "gamma=0.2:1:0.1"},
        {"compute": "abacus"},
    ):
        with pytest.raises(ValueError):
            posescope.evaluate("street", tmp_path / "c", progress=False, **options)  # type: ignore[arg-type]
    assert not (tmp_path / "c").exists()
    run = posescope.evaluate(
        "street", tmp_path / "d", limit=1, method="fb", radius=[10, 12.5], explain=False, keep_failures=0, progress=False
    )
    assert len(run.rows()) == 2
