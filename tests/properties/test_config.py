"""An override means what an edited YAML file means."""

from __future__ import annotations

import functools
import math
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from kendama_cli.config.compose import composed
from kendama_cli.config.site import Site, bundled_root


def site(root: Path) -> Site:
    return Site(root / "home", (root / "conf",), (bundled_root() / "pipelines",), (bundled_root(),))


@functools.cache
def numbers() -> tuple[tuple[str, float], ...]:
    """Every number of the files that the default configuration is made of, by its dotted key."""
    with tempfile.TemporaryDirectory() as home:
        whole = composed(Site(Path(home), (bundled_root() / "conf",), (), ()), [])

    def leaves(node: Any, prefix: str) -> list[tuple[str, float]]:
        if isinstance(node, Mapping):
            return [leaf for name, value in node.items() for leaf in leaves(value, f"{prefix}.{name}".lstrip("."))]
        return [(prefix, node)] if isinstance(node, int | float) and not isinstance(node, bool) else []

    chosen = {"game": "game/kendama", "encode": "encode/dmp", "adapt": "adapt/catch", "learn": "learn/sarsa"}
    found = []
    for key, value in leaves(whole, ""):
        node, _, rest = key.partition(".")
        if node in chosen:
            document = yaml.safe_load((bundled_root() / "conf" / f"{chosen[node]}.yaml").read_text())
            if _get(document, rest) == value:
                found.append((key, value))
    return tuple(found)


def _get(document: Any, key: str) -> Any:
    for part in key.split("."):
        document = document.get(part) if isinstance(document, Mapping) else None
    return document


@settings(max_examples=4, deadline=None)  # each composes twice, half a second
@given(st.data())
def test_an_override_is_the_same_as_the_file_edited(data: st.DataObject) -> None:
    known = numbers()
    assert len(known) > 50
    key, _ = data.draw(st.sampled_from(known))
    value = data.draw(st.one_of(st.integers(-(10**6), 10**6), st.floats(-1e6, 1e6).filter(math.isfinite)))
    node, _, rest = key.partition(".")
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        shutil.copytree(bundled_root() / "conf", root / "conf")
        overridden = composed(site(root), [f"{key}={value!r}"])
        choice = {"game": "kendama", "encode": "dmp", "adapt": "catch", "learn": "sarsa"}[node]
        file = root / "conf" / node / f"{choice}.yaml"
        # comments at the head (@package, say) count for Hydra; the values below them are written anew
        head = [line for line in file.read_text().splitlines() if line.startswith("#")]
        document = yaml.safe_load(file.read_text())
        *parents, last = rest.split(".")
        target = document
        for part in parents:
            target = target[part]
        target[last] = value
        file.write_text("\n".join([*head, yaml.safe_dump(document)]))
        edited = composed(site(root), [])
    assert overridden == edited
