"""A store that several homes share: what comes from it is what was written, or is not used."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from kendama_cli.errors import ConfigError, MissingPartError, OfflineError, RemoteError
from kendama_cli.plugins.cluster.remote import SMALL_BYTES, FolderRemote, Remote, open_remote
from kendama_cli.plugins.cluster.shared import SharedStore, open_shared, pull, push, send, verify_remote
from kendama_cli.schema.settings import build
from kendama_cli.settings.store import StoreSettings
from kendama_cli.store.store import Store, StoredResult, key_of
from tests.toy_project import ToyProject, artifact_bytes, statuses

BUCKET = "kendama-tests"


@pytest.fixture(scope="session")
def s3_server() -> Iterator[str]:
    """The address of an S3 server on loopback with one bucket."""
    boto3 = pytest.importorskip("boto3")
    server_module = pytest.importorskip("moto.server")
    server = server_module.ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    endpoint = f"http://{host}:{port}"
    with pytest.MonkeyPatch.context() as patch:
        for name, value in SECRET.items():
            patch.setenv(name, value)
        boto3.client("s3", endpoint_url=endpoint).create_bucket(Bucket=BUCKET)
    yield endpoint
    server.stop()


SECRET = {"AWS_ACCESS_KEY_ID": "tests", "AWS_SECRET_ACCESS_KEY": "tests", "AWS_REGION": "us-east-1"}


@pytest.fixture
def bucket(s3_server: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> StoreSettings:
    for name, value in SECRET.items():
        monkeypatch.setenv(name, value)
    return StoreSettings(f"s3://{BUCKET}/{tmp_path.name}", s3_server, 5.0)


@pytest.fixture(params=["folder", "bucket"])
def settings(request: pytest.FixtureRequest, tmp_path: Path) -> StoreSettings:
    """A shared store that is empty, of each kind in turn."""
    if request.param == "bucket":
        return request.getfixturevalue("bucket")
    (tmp_path / "shared").mkdir()
    return StoreSettings(str(tmp_path / "shared"), None, 5.0)


@pytest.fixture
def remote(settings: StoreSettings) -> Remote:
    made = open_remote(settings)
    assert made is not None
    return made


def made_in(store: Store, text: str = "{}", name: str = "learn", log: bytes = bytes(range(250)) * 120) -> StoredResult:
    """A result that this home computed."""
    parts = {"config": {"text": text}}
    with store.scratch_folder() as folder:
        (folder / "artifact.json").write_text(text)
        (folder / "log.mcap").write_bytes(log)
        return store.put(folder, name, key_of(parts), {"n": 1}, parts, made_with={"numpy": "2.0"})


def joined(home: Path, remote: Remote, told: list[str] | None = None) -> Store:
    return Store(home, SharedStore(remote, (told if told is not None else []).append))


def files_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


@pytest.mark.parametrize("log_bytes", [30_000, 3 * SMALL_BYTES])
def test_what_one_home_shares_another_has_to_the_byte(tmp_path: Path, remote: Remote, log_bytes: int) -> None:
    one, other = joined(tmp_path / "one", remote), joined(tmp_path / "other", remote)
    made = made_in(one, log=os.urandom(log_bytes))
    assert other.find(made.stage, made.key) is None
    assert one.share(made)
    found = joined(tmp_path / "third", remote).find(made.stage, made.key)
    assert found is not None
    assert files_of(found.artifact) == files_of(made.artifact)
    assert [list((tmp_path / home).glob("scratch/*")) for home in ("one", "third")] == [[], []]
    assert (found.metrics, found.parts, found.made_with) == (made.metrics, made.parts, made.made_with)
    record = Store.result_path
    assert (
        record(one, made.stage, made.key).read_bytes()
        == (tmp_path / "third/results/learn" / f"{made.key}.json").read_bytes()
    )


def test_push_and_pull_carry_a_whole_home_and_do_nothing_twice(tmp_path: Path, remote: Remote) -> None:
    one, other = Store(tmp_path / "one"), Store(tmp_path / "other")
    made = [made_in(one, f"[{i}]", f"stage{i % 2}") for i in range(5)]
    assert push(one, remote) == (5, 5)
    assert push(one, remote) == (5, 0)
    assert pull(other, remote) == (5, [])
    assert pull(other, remote) == (0, [])
    assert {(one.stage, one.key) for one in other.entries()} == {(one.stage, one.key) for one in made}
    assert verify_remote(other, remote) == (10, [])
    assert list(other.scratch.iterdir()) == []


def test_every_byte_that_is_changed_on_the_way_is_found_and_nothing_of_it_is_used(
    tmp_path: Path, remote: Remote
) -> None:
    one = Store(tmp_path / "one")
    made = made_in(one)
    send(remote, one, made)
    names = [*remote.names("results"), *remote.names("objects")]
    assert len(names) == 2
    for name in names:
        sound = remote.read(name)
        assert sound is not None
        # every 997th byte, and the file cut short: headers, manifest, contents; but no padding of the tar
        used = len(sound) if name.endswith("json") else 33_000
        for number, place in enumerate([*range(0, used, 997), -1]):
            broken = (
                sound[: len(sound) // 2]
                if place < 0
                else bytes(byte ^ 1 if i == place else byte for i, byte in enumerate(sound))
            )
            (tmp_path / "broken").write_bytes(broken)
            remote.put(name, tmp_path / "broken")
            told: list[str] = []
            found = joined(tmp_path / f"{Path(name).name}{number}", remote, told).find(made.stage, made.key)
            if found is not None:  # a byte of the archive that says nothing: an owner, padding
                assert files_of(found.artifact) == files_of(made.artifact)
                continue
            assert len(told) == 1, place
            assert "is damaged" in told[0]
            assert [one.name for one in verify_remote(one, remote)[1]] == [name]
        (tmp_path / "broken").write_bytes(sound)
        remote.put(name, tmp_path / "broken")
    assert verify_remote(one, remote) == (2, [])


def test_a_large_artifact_that_is_damaged_there_leaves_nothing_behind(tmp_path: Path, remote: Remote) -> None:
    one = Store(tmp_path / "one")
    made = made_in(one, log=os.urandom(2 * SMALL_BYTES))
    send(remote, one, made)
    (name,) = remote.names("objects")
    sound = remote.read(name)
    assert sound is not None
    remote.put(name, sound[:SMALL_BYTES] + bytes([sound[SMALL_BYTES] ^ 1]) + sound[SMALL_BYTES + 1 :])
    told: list[str] = []
    other = joined(tmp_path / "other", remote, told)
    assert other.find(made.stage, made.key) is None
    assert "is damaged (the bytes of 'log.mcap' are not those written)" in told[0]
    assert list(other.scratch.iterdir()) == []


def test_what_is_damaged_there_is_made_again_and_replaced(tmp_path: Path, remote: Remote) -> None:
    one = Store(tmp_path / "one")
    made = made_in(one)
    send(remote, one, made)
    name = next(remote.names("objects"))
    (tmp_path / "broken").write_bytes(bytes(len(remote.read(name) or b"")))
    remote.put(name, tmp_path / "broken")
    other = joined(tmp_path / "other", remote)
    assert other.find(made.stage, made.key) is None
    assert other.share(made_in(other))
    assert verify_remote(one, remote) == (2, [])


def test_a_result_under_the_name_of_another_key_is_not_used(tmp_path: Path, remote: Remote) -> None:
    one = Store(tmp_path / "one")
    made, another = made_in(one), made_in(one, "[]")
    send(remote, one, made)
    remote.put(f"results/learn/{another.key}.json", one.result_path("learn", made.key))
    told: list[str] = []
    assert joined(tmp_path / "other", remote, told).find("learn", another.key) is None
    assert "the result of another key" in told[0]


def test_many_writers_of_one_result_do_no_harm(tmp_path: Path, remote: Remote) -> None:
    stores = [Store(tmp_path / f"home{i}") for i in range(6)]
    made = [made_in(store, log=os.urandom(3000)) for store in stores]  # logs that differ
    threads = [
        threading.Thread(target=send, args=(remote, store, one)) for store, one in zip(stores, made, strict=True)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    count, damage = verify_remote(stores[0], remote)
    assert (count, damage) == (7, [])
    found = joined(tmp_path / "reader", remote).find("learn", made[0].key)
    assert found is not None
    assert found.artifact.name in {one.artifact.name for one in made}


@pytest.mark.parametrize(
    ("place", "endpoint", "words"),
    [
        ("nowhere", None, "there is no such folder (is it mounted?)"),
        ("s3://b/c", "http://127.0.0.1:9", "it cannot be reached"),
    ],
)
def test_out_of_reach_is_told_once_and_the_home_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str, endpoint: str | None, words: str
) -> None:
    for name, value in SECRET.items():
        monkeypatch.setenv(name, value)
    monkeypatch.chdir(tmp_path)
    told: list[str] = []
    store = Store(tmp_path / "home", open_shared(StoreSettings(place, endpoint, 0.5), told.append))
    made = made_in(store)
    assert store.find("learn", "0" * 40) is None
    assert store.find(made.stage, made.key) == made
    assert not store.share(made)
    assert len(told) == 1
    assert words in told[0]
    assert "the work goes on with the home alone" in told[0]


def test_a_bucket_that_is_not_there_and_a_secret_that_is_missing_are_told(
    tmp_path: Path, bucket: StoreSettings, monkeypatch: pytest.MonkeyPatch
) -> None:
    absent = open_remote(StoreSettings("s3://no-such-bucket/x", bucket.endpoint, 5.0))
    assert absent is not None
    for ask in (lambda: absent.read("results/a"), lambda: list(absent.names("results"))):
        with pytest.raises(RemoteError, match="there is no such bucket; make it, or name another"):
            ask()
    (tmp_path / "x").touch()
    with pytest.raises(RemoteError, match="there is no such bucket"):
        absent.put("results/a", tmp_path / "x")
    for name in SECRET:
        monkeypatch.delenv(name)
    monkeypatch.setenv("AWS_METADATA_ENDPOINT", "http://127.0.0.1:9")
    secretless = open_remote(bucket)
    assert secretless is not None
    with pytest.raises((RemoteError, OfflineError)):
        secretless.read("results/a")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"remote": "ftp://host/x"}, "'store.remote' is 'ftp://host/x'; allowed: a folder, or a URL with a bucket"),
        ({"remote": "s3://"}, "allowed: a folder, or a URL with a bucket"),
        ({"endpoint": "host:9000"}, "'store.endpoint' is 'host:9000'; allowed: an address like http://host:9000"),
    ],
)
def test_a_place_that_is_none_is_refused(values: dict[str, str], message: str) -> None:
    with pytest.raises(ConfigError, match=message.replace("(", r"\(")):
        build(StoreSettings, {"remote": None, "endpoint": None, "timeout_s": 1.0, **values}, "store")


def test_a_run_takes_from_the_shared_store_what_another_computed(toy: ToyProject) -> None:
    (toy.folder / "shared").mkdir()
    first = toy.run_json("store.remote=shared", "--home", "one")
    second = toy.run_json("store.remote=shared", "--home", "two")
    assert statuses(first) == {"roll": "ran", "total": "ran"}
    assert statuses(second) == {"roll": "cached", "total": "cached"}
    assert artifact_bytes(first) == artifact_bytes(second)
    assert [stage["key"] for stage in first["stages"]] == [stage["key"] for stage in toy.run_json()["stages"]]
    assert first["overrides"] == []


def test_commands_push_pull_and_verify_a_shared_store(toy: ToyProject) -> None:
    toy.run_json()
    refused = toy.kendama("cache", "push", expect=2)
    assert refused.stderr.startswith("kendama: no shared store is named; add --remote")
    missing = toy.kendama("cache", "push", "--remote", "shared", expect=1)
    assert missing.stderr == "kendama: store.remote=shared: there is no such folder (is it mounted?)\n"
    (toy.folder / "shared").mkdir()
    assert toy.kendama("cache", "push", "--remote", "shared").stdout == "2 results, 2 of them new in shared\n"
    assert toy.kendama("cache", "verify", "--remote", "shared").stdout.startswith("every byte of 4 results and")
    pulled = toy.kendama("cache", "pull", "--remote", "shared", "--home", "other")
    assert pulled.stdout == "2 new results from shared\n"
    assert statuses(toy.run_json("--home", "other")) == {"roll": "cached", "total": "cached"}
    broken = next((toy.folder / "shared/objects").glob("*/*.tar"))
    broken.write_bytes(b"not a tar")
    told = toy.kendama("cache", "verify", "--remote", "shared", expect=1)
    assert told.stdout.startswith(f"objects/{broken.parent.name}/{broken.name}: it is no pack of an artifact")
    assert told.stderr.startswith("kendama: 1 damaged in shared; none is used")


def test_a_home_without_the_library_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "obstore", None)
    monkeypatch.delitem(__import__("sys").modules, "kendama_cli.plugins.cluster.remote_bucket", raising=False)
    with pytest.raises(MissingPartError, match=r"pip install '\.\[remote\]'"):
        open_remote(StoreSettings("s3://bucket/x", None, 1.0))


def test_a_folder_with_a_file_in_its_way_is_out_of_reach(tmp_path: Path) -> None:
    remote = FolderRemote(str(tmp_path))
    (tmp_path / "results").write_text("a file where a folder should be")
    (tmp_path / "x").touch()
    with pytest.raises(OfflineError, match=r"store\.remote=.*: (Not a directory|File exists)"):
        remote.put("results/a/b", tmp_path / "x")


def test_a_folder_of_somebody_else_is_no_shared_store(toy: ToyProject) -> None:
    toy.run_json()
    (toy.folder / "mine/results").mkdir(parents=True)
    (toy.folder / "mine/results/metrics.json").write_text("{}")
    for command in (("run", "-p", "toy", "store.remote=mine"), ("cache", "push", "--remote", "mine")):
        message = toy.kendama(*command, expect=2).stderr
        assert message.splitlines()[-1].endswith("name an empty or a new folder with --remote or store.remote")
    assert [path.name for path in (toy.folder / "mine").rglob("*")] == ["results", "metrics.json"]


ODD = ("results//x.json", "results/a b/../x.json", "results/roll/../x.json", "results/roll/./x.json", "results/roll//x",
       "results/roll/zz//x", "results/roll/\x01.json")  # fmt: skip
PLAIN = ("results/roll/mine.json", "results/roll/", f"results/{'a' * 300}/{'b' * 40}.json", "results/ro:ll/\u00fc.json",
         f"results/../{'b' * 40}", "objects/readme.txt", "objects/ab/mine.tar")  # fmt: skip


@pytest.mark.parametrize("names", [*((one,) for one in (*ODD, *PLAIN)), PLAIN[:4], ODD[1:5]])
def test_objects_of_odd_names_in_a_bucket_stop_nothing(
    tmp_path: Path, bucket: StoreSettings, s3_server: str, names: tuple[str, ...]
) -> None:
    import boto3  # noqa: PLC0415 - where it is installed

    remote = open_remote(bucket)
    assert remote is not None
    home = Store(tmp_path / "home")
    results = [made_in(home, f"[{number}]", "roll") for number in range(2)]
    push(home, remote)
    client = boto3.client("s3", endpoint_url=s3_server)
    for name in names:
        client.put_object(Bucket=BUCKET, Key=f"{tmp_path.name}/{name}", Body=b"of somebody else")
    other = Store(tmp_path / "other")
    assert pull(other, remote) == (2, [])
    assert {one.key for one in other.entries()} == {one.key for one in results}
    assert verify_remote(other, remote) == (4, [])
