"""Speed of encoding, and of movement_primitives beside it where it is installed (``pip install '.[benchmarks]'``).

``OPENBLAS_NUM_THREADS=1 python -m tests.benchmarks.encoding`` prints name, value, unit and ratio; seeded, the
best CPU time of many: on a busy machine threads wait for each other, which is nobody's fault. Ten demonstrations
of three coordinates and 1500 samples, 20 functions. Everything is warmed up but the last row: the first encoding
of a fresh process, where nothing is kept from before, beside the peer's first ten in that process. One primitive of
300 samples by the Python interface is timed with its configuration and, in a fresh process, with all imports.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence

import numpy as np

import kendama_cli as kendama
from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.motion.dmp.averaging import encode, encode_demonstrations, prepare
from kendama_cli.motion.dmp.position_fit import even_operator
from kendama_cli.motion.dmp.primitive import play
from kendama_cli.motion.dmp.settings import EncodeSettings
from tests.motion.swings import path, settings

COUNT, SAMPLES, RATE_HZ, SEED = 10, 1500, 1000.0, 7
ONE_S = np.arange(300) / 100.0
"""Times of the samples of one small primitive [s]."""


def demonstrations(spread_samples: int = 0) -> list[Demonstration]:
    """Swings of one kind with 0.1 mm of noise; ``spread_samples`` makes their lengths differ."""
    rng = np.random.default_rng(SEED)
    made = []
    for i in range(COUNT):
        t = np.arange(SAMPLES + i * spread_samples) / RATE_HZ
        place = (1 + 0.05 * rng.standard_normal()) * path(t, t[-1])
        made.append(Demonstration(f"swing-{i}", t, place + rng.normal(0, 1e-4, place.shape)))
    return made


def best_ms(work: Callable[[], object], repeats: int) -> float:
    """Milliseconds of the fastest of ``repeats``, after one that does not count."""
    work()
    spent = []
    for _ in range(repeats):
        began = time.thread_time()
        work()
        spent.append(time.thread_time() - began)
    return 1e3 * min(spent)


def with_new_lengths(swings: Sequence[Demonstration], chosen: EncodeSettings) -> Callable[[], object]:
    """The same when no demonstration of these lengths was encoded before, but others were."""

    def work() -> object:
        even_operator.cache_clear()
        return encode_demonstrations(swings, chosen)

    return work


def first_ms(work: Callable[[], object]) -> float:
    """Milliseconds of the only call."""
    began = time.thread_time()
    work()
    return 1e3 * (time.thread_time() - began)


def from_nothing(repeats: int) -> tuple[float, float | None]:
    """The best milliseconds, over fresh processes, of a first encoding of ten lengths and of the peer's first ten."""
    command = [sys.executable, "-m", "tests.benchmarks.encoding", "first"]
    rows = [subprocess.run(command, capture_output=True, text=True, check=True).stdout.split() for _ in range(repeats)]
    peers = [float(row[1]) for row in rows if len(row) > 1]
    return min(float(row[0]) for row in rows), min(peers, default=None)


def one_primitive() -> None:
    """Encode one swing of 300 samples by the Python interface."""
    kendama.encode([Demonstration("one", ONE_S, path(ONE_S, ONE_S[-1]))])


def one_from_nothing(repeats: int) -> float:
    """Milliseconds of CPU of the fastest fresh process that encodes one primitive."""
    spent = []
    for _ in range(repeats):
        process = subprocess.Popen([sys.executable, "-m", "tests.benchmarks.encoding", "one"])
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        spent.append(1e3 * (used.ru_utime + used.ru_stime))
    return min(spent)


def print_first() -> None:
    """Print the milliseconds of this process's first encoding, and of the peer's first ten where it is installed."""
    uneven, chosen = demonstrations(spread_samples=7), settings()
    ours = first_ms(lambda: encode_demonstrations(uneven, chosen))
    works = [peer_imitation(one) for one in uneven]
    print(ours, *([] if works[0] is None else [sum(first_ms(work) for work in works if work is not None)]))


def peer_imitation(swing: Demonstration) -> Callable[[], object] | None:
    """The peer's ``imitate`` for one demonstration; None where it is not installed."""
    try:
        from movement_primitives.dmp import DMP  # noqa: PLC0415 - optional
    except ImportError:
        return None
    dt = 1 / RATE_HZ

    def work() -> object:
        primitive = DMP(n_dims=3, execution_time=swing.t_s[-1], dt=dt, n_weights_per_dim=20)
        return primitive.imitate(swing.t_s, swing.position_m)

    return work


def main() -> None:
    """Print the table."""
    if sys.argv[1:] == ["first"]:
        print_first()
        return
    if sys.argv[1:] == ["one"]:
        one_primitive()
        return
    chosen, swings, uneven = settings(), demonstrations(), demonstrations(spread_samples=7)
    prepared = prepare(swings, chosen)
    plan = encode_demonstrations(swings, chosen)
    rows = {
        "encode 10: weights, end velocities, width": best_ms(lambda: encode(prepared, chosen), 200),
        "encode 10: the same, aligned and averaged": best_ms(lambda: encode_demonstrations(swings, chosen), 200),
        "encode 10 of ten lengths": best_ms(lambda: encode_demonstrations(uneven, chosen), 100),
        "encode 10 of ten lengths, none seen before": best_ms(with_new_lengths(uneven, chosen), 20),
        "kendama.encode, one of 300 samples": best_ms(one_primitive, 20),
        "play 1500 instants": best_ms(lambda: play(plan, swings[0].t_s), 100),
    }
    imitate = peer_imitation(swings[0])
    peer = None if imitate is None else best_ms(imitate, 50)
    if peer is None:
        print("movement_primitives is not installed: no peer")
    else:
        print(f"{'movement_primitives, imitate 1':44s} {peer:8.3f} ms")
    for name, value in rows.items():
        ratio = (
            ""
            if peer is None or not name.startswith("encode")
            else f"{COUNT * peer / value:7.1f} x movement_primitives, each"
        )
        print(f"{name:44s} {value:8.3f} ms {ratio}")
    print(f"{'kendama.encode, fresh process with imports':44s} {one_from_nothing(5):8.0f} ms")
    first, peers = from_nothing(5)
    ratio = "" if peers is None else f"{peers / first:7.1f} x movement_primitives, its first ten"
    print(f"{'encode 10 of ten lengths, fresh process':44s} {first:8.3f} ms {ratio}")


if __name__ == "__main__":
    main()
