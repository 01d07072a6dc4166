"""Motion capture of the cup, live, by OpenIGTLink or VRPN: the stream is kept as it comes, and read as a recording."""

from __future__ import annotations

import math
import socket
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from kendama_cli.devices.demonstrator.file import RecordedDemonstrator, hands_of
from kendama_cli.devices.demonstrator.live_figures import LiveFigures, Tell
from kendama_cli.devices.demonstrator.segments import checked_swings
from kendama_cli.devices.demonstrator.settings import MAX_DISTANCE_M
from kendama_cli.errors import ConfigError, HardwareError
from kendama_cli.motion.rotation import exponential, log_of
from kendama_cli.plugins.mocap.body import recording_of
from kendama_cli.plugins.mocap.settings import MocapCapture
from kendama_cli.plugins.shared.recordings.reader import read_bodies
from kendama_cli.plugins.shared.streams.openigtlink import TRANSFORM, MessageStream
from kendama_cli.plugins.shared.streams.stream_file import StreamFile
from kendama_cli.plugins.shared.streams.vrpn import COOKIE, VrpnStream, tracker_report
from kendama_cli.schema.units import METRES, count_of

TIMEOUT_S = 3.0
FEWEST = 20
CLOCK_SHARE = 0.02
"""Stamps that run so much faster or slower than our clock are warned of."""
CLOCK_APART_S = 1.0
"""So is a clock that differs from ours by more; a network's delay does not."""


@dataclass(frozen=True)
class StreamedPose:
    """A body by its name there, in the unit of the server; ``rotation_wxyz`` (4,) NaN where it is no rotation."""

    body: str
    stamp_s: float
    position: tuple[float, ...]
    rotation_wxyz: tuple[float, ...]


@dataclass(frozen=True)
class Protocol:
    """Protocol of a stream: its name, a client's first message, and the parser of poses."""

    name: str
    hello: bytes
    reader: Callable[[], Callable[[bytes], Iterator[StreamedPose]]]


def streamed_poses(protocol: Protocol, host: str, port: int) -> Iterator[StreamedPose]:
    """Yield every pose that comes, of any body.

    Ends where the server closes the line; raises HardwareError where it is not there, silent for 3 s, or speaks
    something else.
    """
    where = f"the {protocol.name} server at {host}:{port}"
    try:
        line = socket.create_connection((host, port), timeout=TIMEOUT_S)
    except OSError as wrong:
        raise HardwareError(
            f"{where} is not there ({wrong.strerror or wrong}); look at capture.host, capture.port and the server"
        ) from None
    read = protocol.reader()
    with line:
        line.sendall(protocol.hello)
        while data := _received(line, where):
            try:
                yield from read(data)
            except ValueError as wrong:
                raise HardwareError(f"{where} {wrong}; look at capture.protocol and capture.port") from None


def _received(line: socket.socket, where: str) -> bytes:
    """Return the bytes that have come; empty if the line was closed. Raises HardwareError after a silence."""
    try:
        return line.recv(1 << 16)
    except TimeoutError:
        raise HardwareError(f"{where} has been silent for {TIMEOUT_S:g} s; is it streaming?") from None
    except OSError:
        return b""


def _openigtlink() -> Callable[[bytes], Iterator[StreamedPose]]:
    stream = MessageStream()

    def read(data: bytes) -> Iterator[StreamedPose]:
        for message in stream.feed(data):
            if message.kind != "TRANSFORM" or len(message.content) < TRANSFORM.size:
                continue
            values = np.array(TRANSFORM.unpack_from(message.content), dtype=np.float64)
            matrix = values[:9].reshape(3, 3).T
            turns = np.isfinite(matrix).all() and np.linalg.det(matrix) > 0  # a mirror is no turn
            turned = exponential(log_of(matrix)) if turns else np.full(4, np.nan)
            yield StreamedPose(message.device, message.stamp_s, tuple(values[9:].tolist()), tuple(turned.tolist()))

    return read


def _vrpn() -> Callable[[bytes], Iterator[StreamedPose]]:
    stream = VrpnStream()

    def read(data: bytes) -> Iterator[StreamedPose]:
        for message in stream.feed(data):
            if (one := tracker_report(message)) is None:
                continue
            name = one.tracker if one.sensor == 0 else f"{one.tracker}:{one.sensor}"
            yield StreamedPose(name, one.stamp_s, one.position, one.rotation_wxyz)

    return read


PROTOCOLS: Mapping[str, Protocol] = {
    "openigtlink": Protocol("OpenIGTLink", b"", _openigtlink),
    "vrpn": Protocol("VRPN", COOKIE, _vrpn),
}
"""Readers by the value of ``capture.protocol``."""


def open_mocap(settings: MocapCapture, tell: Tell) -> Sequence[RecordedDemonstrator]:
    """Open a demonstrator for every swing in the stream of ``settings.seconds``; ``tell`` reports poses on arrival.

    Raises HardwareError where the server is not there, goes away or does not have the body, ConfigError for a unit that
    cannot be; what came is kept.
    """
    path = Path(settings.record)
    stream = _recorded(settings, path, tell)
    (body,) = read_bodies(str(path))
    recording = recording_of(str(path), body, None, settings)
    recording = replace(
        recording,
        warnings=(*(f"{path.name}: {one}" for one in stream.notes()), *recording.warnings),
        unit_remedy=f"look at capture.unit ({settings.spoken_unit})",
    )
    return hands_of(checked_swings(recording, settings.plausible, math.inf, settings.segments))


class _Stream:
    """Stream so far: the body's stamps and arrival times, what else is streamed, and how it ended."""

    def __init__(self, clock: Callable[[], float] = time.time) -> None:
        self._clock = clock
        self.stamps_s: list[float] = []
        self.arrivals_s: list[float] = []
        self.others: set[str] = set()
        self.not_finite, self.not_rising, self.without_time, self.ended = 0, 0, 0, ""

    def record(self, settings: MocapCapture, kept: StreamFile, figures: LiveFigures) -> None:
        """Take poses for ``settings.seconds`` from the first on, which must come within as long.

        Raises HardwareError where the line fails, ConfigError for places that are in another unit.
        """
        began, metres = self._clock(), METRES[settings.spoken_unit]
        for pose in streamed_poses(PROTOCOLS[settings.protocol], settings.host, settings.spoken_port):
            now = self._clock()
            place_m, stamp_s = [metres * value for value in pose.position], pose.stamp_s or now
            if pose.body != settings.body:
                self.others.add(pose.body)
            elif not all(map(math.isfinite, (*place_m, *pose.rotation_wxyz))):
                self.not_finite += 1
            elif self.stamps_s and stamp_s <= self.stamps_s[-1]:
                self.not_rising += 1
            elif (far_m := math.hypot(*place_m)) > MAX_DISTANCE_M:
                raise ConfigError(
                    "capture.unit",
                    f"'{settings.body}' is {far_m:.4g} m from the tracker's origin, where no hand is; 'capture.unit' "
                    f"is {settings.spoken_unit}: look at what the server sends",
                )
            else:
                self.without_time += not pose.stamp_s
                self.stamps_s.append(stamp_s)
                self.arrivals_s.append(now)
                figures.add(now, pose.stamp_s or None)
                kept.write((stamp_s - self.stamps_s[0], *place_m, *pose.rotation_wxyz))
            if now - (self.arrivals_s[0] if self.arrivals_s else began) >= settings.seconds:
                return
        self.ended = f"the server closed the line after {count_of(kept.count, 'pose')}"

    def notes(self) -> list[str]:
        """Return notes on rate, gaps, delay, and suspicious findings."""
        stamps, arrivals = np.array(self.stamps_s), np.array(self.arrivals_s)
        steps = np.diff(stamps)
        usual = float(np.median(steps))
        delay_ms = 1e3 * (arrivals - stamps)
        warnings = [
            f"{len(stamps)} poses at {1 / usual:.1f} Hz, {int((steps > 1.5 * usual).sum())} gaps (the longest step "
            f"{1e3 * float(steps.max()):.0f} ms), delay {np.median(delay_ms):.0f} ms by both clocks, varying by "
            f"{float(np.ptp(np.quantile(delay_ms, [0.05, 0.95]))):.1f} ms"
        ]
        if self.not_finite:
            warnings.append(f"{self.not_finite} poses were not finite numbers and are left out")
        if self.not_rising:
            warnings.append(f"{self.not_rising} poses had a stamp that does not rise and are left out")
        if self.without_time:
            warnings.append("the server sends no times: those of arrival are taken")
        apart_s = 1e-3 * float(np.median(delay_ms))
        if abs(apart_s) > CLOCK_APART_S:
            warnings.append(f"the tracker's clock differs from ours by {-apart_s:.1f} s; only its differences are used")
        lasted_s = float(arrivals[-1] - arrivals[0])
        ratio = float(stamps[-1] - stamps[0]) / max(lasted_s, 1e-9)
        if abs(ratio - 1) > CLOCK_SHARE and lasted_s > 1.0:
            warnings.append(f"the tracker's clock runs {ratio:.3f} times as fast as ours; durations are its own")
        if self.ended:
            warnings.append(f"{self.ended}; what came before is kept")
        return warnings

    def shortage(self, settings: MocapCapture) -> str:
        """Return the reason for too few poses, one sentence."""
        if self.not_rising > len(self.stamps_s):
            why = (
                f"the stamps of '{settings.body}' stand still ({self.not_rising} poses do not rise): the tracker is "
                "frozen, or the server's clock is"
            )
        elif self.not_finite:
            why = f"'{settings.body}' is never seen: {self.not_finite} poses are not finite numbers"
        elif self.ended:
            why = f"{count_of(len(self.stamps_s), 'pose')} of '{settings.body}' came: {self.ended}"
        else:
            where = f"{settings.host}:{settings.spoken_port}"
            why = f"'{settings.body}' does not come from {where}; look at capture.body"
        return why + (f"; it streams {', '.join(sorted(self.others))}" if self.others else "")


def _recorded(settings: MocapCapture, path: Path, tell: Tell) -> _Stream:
    """Keep the stream in ``path``; what came. Raises HardwareError where too little came, which is not kept."""
    stream, kept = _Stream(), StreamFile(path, settings.body)
    try:
        with kept:
            stream.record(settings, kept, LiveFigures(tell, settings.seconds))
    except HardwareError as wrong:
        stream.ended = str(wrong)
    finally:
        if kept.count < FEWEST:
            path.unlink()
    if kept.count < FEWEST:
        raise HardwareError(stream.shortage(settings))
    return stream
