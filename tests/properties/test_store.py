"""Artifacts put into the store are found there, byte for byte, and damage is never served."""

from __future__ import annotations

import tempfile
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from kendama_cli.store.garbage import verify
from kendama_cli.store.store import Store

names = st.from_regex(r"[a-z][a-z0-9_]{0,8}\.(json|npz|mcap)", fullmatch=True)
contents = st.dictionaries(names, st.binary(max_size=300), min_size=1, max_size=4)
metrics = st.dictionaries(
    st.text(min_size=1, max_size=8),
    st.one_of(st.integers(), st.floats(allow_nan=False, allow_infinity=False), st.text(max_size=5)),
    max_size=3,
)
keys = st.from_regex(r"[0-9a-f]{40}", fullmatch=True)


def put(store: Store, files: dict[str, bytes], stage: str, key: str, figures: dict[str, object]) -> None:
    with store.scratch_folder() as folder:
        for name, data in files.items():
            (folder / name).write_bytes(data)
        store.put(folder, stage, key, figures, {"why": key})


@settings(deadline=None)  # every write is synchronised with the disk
@given(st.lists(st.tuples(st.sampled_from("ab"), keys, contents, metrics), min_size=1, max_size=4))
def test_what_was_put_last_under_a_key_is_found_whole(
    made: list[tuple[str, str, dict[str, bytes], dict[str, object]]],
) -> None:
    with tempfile.TemporaryDirectory() as home:
        store = Store(Path(home))
        for stage, key, files, figures in made:
            put(store, files, stage, key, figures)
        for stage, key, files, figures in {(stage, key): one for one in made for stage, key in [one[:2]]}.values():
            found = store.find(stage, key)
            assert found is not None
            assert found.metrics == figures
            assert {file: (found.artifact / file).read_bytes() for file in files} == files
        assert verify(store) == []
        assert store.find("a", "0" * 39) is None


@settings(deadline=None)
@given(keys, contents, st.data())
def test_one_changed_byte_anywhere_in_an_artifact_is_not_served(
    key: str, files: dict[str, bytes], data: st.DataObject
) -> None:
    with tempfile.TemporaryDirectory() as home:
        store = Store(Path(home))
        put(store, files, "a", key, {})
        stored = store.find("a", key)
        assert stored is not None
        file = data.draw(st.sampled_from(sorted(path.name for path in stored.artifact.iterdir())))
        whole = bytearray((stored.artifact / file).read_bytes())
        if whole:
            place = data.draw(st.integers(0, len(whole) - 1))
            whole[place] ^= data.draw(st.integers(1, 255))
        else:
            whole = bytearray(b"x")
        (stored.artifact / file).chmod(0o644)
        (stored.artifact / file).write_bytes(bytes(whole))
        assert store.find("a", key) is None
        assert verify(store)
