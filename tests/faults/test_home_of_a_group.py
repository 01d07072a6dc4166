"""A home and a shared store that two users of one group work in: each goes on from what the other made."""

from __future__ import annotations

import os
import shutil
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from tests.toy_project import ToyProject

GROUP, USERS = 2000, (2001, 2002)
USER = ["setpriv", f"--regid={GROUP}", "--clear-groups"]
PYTHONS = (sys.executable, f"/usr/bin/python{sys.version_info.major}.{sys.version_info.minor}")


@pytest.fixture(scope="module")
def python() -> str:
    """An interpreter of this version that any user may run."""
    if not hasattr(os, "geteuid") or os.geteuid() != 0 or shutil.which("setpriv") is None:
        pytest.skip("two users can be played by the superuser alone")
    for one in PYTHONS:
        command = [*USER, f"--reuid={USERS[0]}", "sh", "-c", f"exec {one} -c 'import numpy, kendama_cli'"]
        if subprocess.run(command, env=environment(), capture_output=True, check=False).returncode == 0:
            return one
    pytest.skip("no interpreter here may be run by other users")


def environment(*folders: Path) -> dict[str, str]:
    found = [one for one in sys.path if "site-packages" in one or Path(one, "kendama_cli").is_dir()]
    return {"PATH": os.defpath, "PYTHONPATH": os.pathsep.join([*map(str, folders), *found])}


def as_user(python: str, toy: ToyProject, number: int, umask: str, *arguments: str) -> str:
    command = " ".join(map("'{}'".format, [python, *toy.command(*arguments)[1:]]))
    done = subprocess.run(
        [*USER, f"--reuid={USERS[number]}", "sh", "-c", f"umask {umask}; exec {command}"],
        cwd=toy.folder,
        env={**environment(toy.folder / "lib"), "HOME": str(toy.folder / str(number))},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, (arguments, done.stderr)
    return done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("umask", ["002", "077"])
def test_two_users_of_a_group_go_on_from_each_others_work(python: str, umask: str) -> None:
    with tempfile.TemporaryDirectory() as folder:  # pytest's own folders are closed to others
        os.chmod(folder, 0o755)
        share(ToyProject(Path(folder).resolve(), alone=True), python, umask)


def share(toy: ToyProject, python: str, umask: str) -> None:
    for name in ("home", "shared"):
        (toy.folder / name).mkdir()
        os.chown(toy.folder / name, 0, GROUP)
        (toy.folder / name).chmod(0o2775)
    for number, user in enumerate(USERS):
        (toy.folder / str(number)).mkdir()
        os.chown(toy.folder / str(number), user, GROUP)
    home, remote = ("--home", str(toy.folder / "home")), ("--remote", str(toy.folder / "shared"))
    for number in (0, 1, 0):
        as_user(python, toy, number, umask, "run", "-p", "toy", "--force", "roll", *home)
        as_user(python, toy, number, umask, "run", "-p", "toy", f"seed={number + 5}", *home)
        as_user(python, toy, number, umask, "cache", "push", *remote, *home)
        as_user(python, toy, number, umask, "runs", "tag", "1", f"of-{number}", *home)
        assert "every byte" in as_user(python, toy, number, umask, "cache", "verify", *home)
    assert " deleted" in as_user(python, toy, 1, umask, "cache", "gc", "--keep-runs", "0", *home)
    assert not list((toy.folder / "home/results").glob("*/*.json"))
    as_user(python, toy, 0, umask, "cache", "pull", *remote, *home)
    as_user(python, toy, 1, umask, "run", "-p", "toy", *home)
    for path in (toy.folder / "home").rglob("*"):
        mode = path.stat().st_mode
        assert path.stat().st_gid == GROUP
        assert mode & stat.S_IWGRP, path
