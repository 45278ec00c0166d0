"""Run the tests: `python3 scripts/test.py [arguments of pytest]`.

Without arguments: ruff (check and format), mypy, import-linter, then all tests. With arguments: pytest alone, with
them.
The exit code is 0 when everything passed, 1 when something failed, 2 when the environment cannot be made.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import _environment

CHECKS: tuple[tuple[str, ...], ...] = (
    ("ruff", "check", "."),
    ("ruff", "format", "--check", "."),
    ("mypy",),
    ("lint-imports",),
)
# What `test` installs besides. Named, since else the first script that a test starts would install the project again.
OF_SCRIPTS = ("batch", "bridge", "mujoco", "ray", "report", "sdf", "tune", "view")
NO_TESTS = 5  # pytest's exit code when nothing matched


def main() -> int:
    """Run the checks and the tests; return the exit code."""
    variables = test_variables()
    arguments = sys.argv[1:]
    failed = []
    for check in () if arguments else CHECKS:
        print(f"== {' '.join(check)}", flush=True)
        program = os.path.join(sys.prefix, "bin", check[0])
        if subprocess.run([program, *check[1:]], cwd=_environment.ROOT, env=variables).returncode != 0:
            failed.append(" ".join(check))
    if not arguments:
        print("== pytest", flush=True)
        # Tests that run nodes follow each other in one process (tests/conftest.py), all others meanwhile in another.
        arguments = ["-n", "2", "--dist", "loadgroup"]
    if failed:
        print(f"failed before the tests: {', '.join(failed)}", flush=True)
    code = subprocess.run(
        [sys.executable, "-m", "pytest", "-rfEs", "--durations=25", *arguments], cwd=_environment.ROOT, env=variables
    ).returncode
    if code == NO_TESTS:
        print("pytest ran no test", file=sys.stderr)
    return 1 if failed or code != 0 else 0


def test_variables() -> dict[str, str]:
    """Return the environment variables for tests: ROS traffic stays on this machine, apart from other runs."""
    variables = dict(os.environ)
    variables["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    variables["ROS_DOMAIN_ID"] = str(os.getpid() % 102)  # above 101 the ports collide with the system's own
    variables.setdefault("ROS_LOG_DIR", str(_environment.ROOT / "build" / "ros_log"))
    for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        variables.setdefault(threads, "1")  # small matrices: more threads only wait for each other
    return variables


if __name__ == "__main__":
    browser = ("browser",) if any(map(shutil.which, _environment.BROWSERS)) else ()
    _environment.prepare(extras=("test", *OF_SCRIPTS, *browser))
    raise SystemExit(main())
