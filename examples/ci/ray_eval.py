#!/usr/bin/env python3
"""An experiment on a Ray cluster: its parts are spread over the workers and merged.

    pip install ray
    examples/ci/ray_eval.py --parts 32 --out runs/multi -- street --preset multi

What stands behind `--` goes to `posescope eval` as it is. The scene, the program and the folder have to
be the same on all machines, as on a cluster with a common disk. A part whose worker was lost is given to
another one, which goes on where it was; asked again, the whole goes on where it was. The merged run has
the bytes of one that was made in one piece.

Without a cluster (RAY_ADDRESS, or --address) the workers are processes of this machine.
"""

import argparse
import ctypes
import pathlib
import shutil
import signal
import subprocess
import sys

import ray


class PartFailed(Exception):
    """The program ended a part with an error of its own; another worker would come to the same."""


def end_with_parent():
    """Asks Linux to end the program with its worker: two must not write one folder."""
    if sys.platform == "linux":
        PR_SET_PDEATHSIG = 1
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def run_part(program, arguments, part, parts, folder, threads):
    """One part of the experiment, from where it was."""
    command = [program, "eval", *arguments, "--quiet", "--shard", f"{part}/{parts}"]
    command += ["--threads", str(threads), "--out", folder, "--resume"]
    done = subprocess.run(
        command, preexec_fn=end_with_parent, stderr=subprocess.PIPE, text=True, check=False
    )
    if done.returncode < 0:
        # Somebody killed it, for its memory say: that is worth another try.
        raise RuntimeError(f"part {part} was ended by signal {-done.returncode}")
    if done.returncode != 0:
        raise PartFailed(f"part {part}: {done.stderr.strip()} (exit code {done.returncode})")
    return part


def parsed():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--parts", type=int, required=True, help="how many parts to make of it")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder of parts and whole")
    parser.add_argument("--cpus", type=int, default=1, help="processors of a part [default: 1]")
    parser.add_argument("--retries", type=int, default=5, help="lost workers of a part, at most")
    parser.add_argument("--address", help="the cluster [default: RAY_ADDRESS, or this machine]")
    parser.add_argument("--program", default="posescope", help="the program [default: posescope]")
    parser.add_argument("eval", nargs="+", metavar="ARGUMENT", help="what `posescope eval` is given")
    return parser.parse_args()


def main():
    asked = parsed()
    program = shutil.which(asked.program)
    if program is None:
        sys.exit(f"ray_eval.py: no program {asked.program}")
    asked.out.mkdir(parents=True, exist_ok=True)
    folders = [asked.out.resolve() / f"part-{part}" for part in range(1, asked.parts + 1)]

    ray.init(address=asked.address, log_to_driver=False)
    remote = ray.remote(run_part).options(
        num_cpus=asked.cpus, max_retries=asked.retries, retry_exceptions=[RuntimeError]
    )
    waiting = [
        remote.remote(program, asked.eval, part, asked.parts, str(folder), asked.cpus)
        for part, folder in enumerate(folders, start=1)
    ]
    while waiting:
        done, waiting = ray.wait(waiting)
        try:
            part = ray.get(done[0])
        except ray.exceptions.RayTaskError as error:
            sys.exit(f"ray_eval.py: {error.cause or error}")
        except ray.exceptions.WorkerCrashedError:
            sys.exit(f"ray_eval.py: workers were lost more than {asked.retries} times")
        print(f"part {part} of {asked.parts} is done", flush=True)

    whole = asked.out / "whole"
    shutil.rmtree(whole, ignore_errors=True)
    merge = [program, "eval", "merge", *map(str, folders), "--out", str(whole)]
    sys.exit(subprocess.run(merge, check=False).returncode)


if __name__ == "__main__":
    main()
