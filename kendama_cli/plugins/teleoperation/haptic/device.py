"""The hand of ``capture=haptic``: a swing lasts from the grip on the stylus to the catch, or until it is let go."""

from __future__ import annotations

import gc
import socket
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from kendama_cli.devices.demonstrator.axes import to_ours
from kendama_cli.devices.demonstrator.interface import DemonstratorSample
from kendama_cli.errors import ConfigError, HardwareError, KendamaError
from kendama_cli.plugins.shared.streams.stream_file import StreamFile
from kendama_cli.plugins.teleoperation.haptic.coupling import Coupling
from kendama_cli.plugins.teleoperation.haptic.device_protocols import DEVICES, Grip, HapticLine, Told, Trouble
from kendama_cli.plugins.teleoperation.haptic.period import DeviceWay, Lateness, Period
from kendama_cli.plugins.teleoperation.haptic.settings import HapticCapture
from kendama_cli.plugins.teleoperation.play.conditions import Conditions
from kendama_cli.plugins.teleoperation.play.try_record import TryRecord
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.units import METRES, count_of
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.dart.hand_world import PLACE, HandWorld
from kendama_cli.simulation.dart.world import STEP_S

LOOK_EVERY = 4
REACH_M = 5.0
"""No haptic device reaches farther; one that says so counts in another unit."""
FROZEN_S = 10.0
"""A hand trembles by a tenth of a millimetre: a device that says the very same place for longer is frozen."""
LEAST_MOVED_M = 1e-3
"""A stylus that is gripped for a swing moves farther, even a virtual hand a hundred times larger."""
LOOSE = 3.0
"""A cup that is farther from the hand than the coupling's largest force stretches its spring, so many times."""


class HapticLink:
    """The device across the network, and the latched stop: after any fault it feels no force any more.

    ``late_s`` has how late each period of the loop began.
    """

    def __init__(self, settings: HapticCapture, clock: Callable[[], float] = time.perf_counter) -> None:
        """Connect; raises HardwareError where nothing answers."""
        self.settings, self.clock = settings, clock
        self._speaks = DEVICES[settings.protocol](settings)
        where = f"{settings.host}:{settings.spoken_port}"
        try:
            connected = socket.create_connection((settings.host, settings.spoken_port), timeout=5)
            connected.sendall(self._speaks.hello)
        except OSError as error:
            raise HardwareError(
                f"no {self._speaks.name} server of a haptic device at {where} ({error.strerror or error}); start it, "
                "or set capture.host and capture.port; without a device use capture=play or capture=file"
            ) from None
        self._line: HapticLine[Told] = HapticLine(connected, self._speaks.feed)
        self._turn, self._at = np.array(to_ours(settings.spoken_axes)), (0.0, 0.0, 0.0)
        self.device_m: Array | None = None
        self.heard_m = list[Array]()
        """The places that the last ``listen`` took, the newest last."""
        self.gripped, self.late_s = False, list[float]()
        self.moved_m: float | None = None
        """How far the stylus moved at most in a grip that was no swing."""
        self._heard_s, self._stopped = clock(), ""
        self._moved_s = self._heard_s

    def listen(self) -> None:
        """Take what has come; raises HardwareError, and stops for good, for a device that lies or is silent."""
        try:
            self._take(self.clock())
        except HardwareError as error:
            self.stop(str(error))
            raise

    def feel(self, force_n: Array) -> None:
        """Let the hand feel its share of the virtual hand's force [N]; none after a stop, or without a grip.

        Raises HardwareError, and stops for good, where the line is closed.

        One share for all forces keeps the energy's sign, which a limit on the stylus alone would not.
        """
        force = np.asarray(force_n) * self.settings.scale * self.settings.felt_fraction
        alive = self.gripped and not self._stopped and bool(np.isfinite(force).all())
        x, y, z = (self._turn.T @ force).tolist() if alive else (0.0, 0.0, 0.0)
        try:
            self._line.send(self._speaks.force((x, y, z), self._at))
        except HardwareError as error:
            self._stopped = self._stopped or str(error)
            raise

    def stop(self, why: str) -> None:
        """Stop every force, whatever comes."""
        self._stopped = self._stopped or why
        try:
            self.feel(np.zeros(3))
        except HardwareError:  # it is gone anyway
            return

    def close(self) -> None:
        """Stop and close; idempotent."""
        self.stop("closed")
        self._line.close()

    def _take(self, now_s: float) -> None:
        if self._stopped:
            raise HardwareError(f"the haptic device stopped ({self._stopped}) and stays so: run it anew")
        own, self.heard_m = self.settings, []
        # several that come at once were sent at any time since the last that came before them
        silent_s = now_s - self._heard_s
        for told in self._line.receive():
            if isinstance(told, Grip):
                self.gripped = told.held
            elif isinstance(told, Trouble):
                raise HardwareError(f"the haptic device tells of a fault: {told.words}; look at the device")
            else:
                place = own.scale * METRES[own.spoken_unit] * (self._turn @ told.position)
                self._check(place, now_s, silent_s)
                self.device_m, self._at, self._heard_s = place, told.position, now_s
                self.heard_m.append(place)
        if now_s - self._heard_s > own.watchdog_s and (self.gripped or self.device_m is None):
            raise HardwareError(
                f"no {self._speaks.pose} of the haptic device for {now_s - self._heard_s:.2f} s; look at "
                "capture.device and its server"
            )

    def _check(self, place: Array, now_s: float, silent_s: float) -> None:
        if not np.isfinite(place).all():
            raise HardwareError(
                f"the haptic device says that it is at {place.tolist()} m, which is no place: look at the device"
            )
        unit = f"look at capture.unit ({self.settings.spoken_unit})"
        reach_m = float(np.linalg.norm(place)) / self.settings.scale
        if reach_m > REACH_M:
            raise HardwareError(f"the haptic device says that it is {reach_m:.4g} m from its origin, too far: {unit}")
        if self.device_m is None or not self.gripped or (place != self.device_m).any():
            self._moved_s = now_s
        if self.device_m is None or not self.gripped:
            return
        if now_s - self._moved_s > FROZEN_S:
            raise HardwareError(f"the haptic device was gripped, but frozen at the very same place for {FROZEN_S:g} s")
        far = float(np.linalg.norm(place - self.device_m))
        if far > self.settings.max_speed_m_s * (silent_s + 5 * STEP_S):
            raise HardwareError(
                f"the haptic device jumped by {far:.3f} m within {silent_s:.4f} s; look at its cable, or {unit}"
            )


class HapticDemonstrator:
    """One swing at the device, kept in ``folder`` before anything else happens."""

    rate_hz = 1 / (LOOK_EVERY * STEP_S)

    def __init__(self, name: str, link: HapticLink, folder: Path) -> None:
        self.name, self._link, self._folder = name, link, folder

    def samples(self) -> Iterator[DemonstratorSample]:
        """Record a swing; raises HardwareError, which says where the swings before this one are."""
        rows = None
        gc.disable()  # a full collection takes 0.2 s
        try:
            while rows is None:  # a grip without a swing is none
                rows = swing(self._link)
        except KendamaError as wrong:
            self._link.stop(str(wrong))
            kept = len(list(self._folder.glob("*.csv")))
            again = (
                f"; {count_of(kept, 'swing')} kept: capture=body 'capture.path={self._folder}/*.csv'" if kept else ""
            )
            raise HardwareError(f"{wrong}{again}") from None
        finally:
            gc.enable()
        with StreamFile(self._folder / f"{self.name}.csv", self.name) as file:
            for row in rows.tolist():
                file.write(tuple(row[:8]))
        for row in rows:
            yield DemonstratorSample(float(row[0]), row[1:4], row[4:8], tracked=True)

    def render_force(self, force_n: Array) -> None:
        """Let the hand feel a force until the next one."""
        self._link.feel(force_n)

    def close(self) -> None:
        """Stop the force between two swings."""
        self._link.feel(np.zeros(3))


def swing(link: HapticLink) -> Array | None:
    """Return the samples of a try (n, columns) from grip to catch or release; None if it is hardly a swing."""
    own, period = link.settings, Period(link.clock, link.late_s)
    until_s = link.clock() + own.wait_s
    while not link.gripped or link.device_m is None:
        period.wait()
        link.listen()
        if link.clock() > until_s:
            raise HardwareError(_nobody(link))
    cup, record = MovedCup(own.game), TryRecord(own.caught_s)
    coupling, lateness = Coupling(own.coupling, STEP_S, own.game.cup.mass_kg), Lateness(own.watchdog_s, link.clock())
    origin_m = link.device_m.copy()
    way = DeviceWay(link.clock(), np.zeros(3))
    loose_m, reached_m = LOOSE * own.coupling.max_force_n / own.coupling.stiffness_n_m, 0.0
    while link.gripped and not record.caught:
        due = period.wait()
        link.listen()
        now_s = link.clock()
        lateness.look(now_s, heard=bool(link.heard_m))
        way.heard(now_s, [place_m - origin_m for place_m in link.heard_m])
        for left in range(due - 1, -1, -1):
            hand_m, cup_m = way.at(period.began_s - left * STEP_S), cup.place[:3].copy()
            force_n = coupling.force(hand_m, cup_m, cup.free_m(), held=left > 0)
            if left == 0:  # in a stall the hand feels the last force all the while, and the cup is where the hand was
                link.feel(-force_n)
            cup.step(force_n, record)
        reached_m = max(reached_m, float(np.linalg.norm(hand_m)))
        if (apart_m := float(np.linalg.norm(hand_m - cup_m))) > loose_m:
            raise HardwareError(
                f"the cup came off the hand by {apart_m:.2f} m, allowed is {loose_m:.2g}: "
                + (lateness.words() or "move the stylus less suddenly, or take a stiffer capture.coupling")
            )
    link.feel(np.zeros(3))
    link.moved_m = max(link.moved_m or 0.0, reached_m / own.scale)
    return record.samples(Conditions())


def _nobody(link: HapticLink) -> str:
    own = link.settings
    waited = f"nobody has gripped the stylus for {own.wait_s:g} s (capture.wait_s)"
    if link.moved_m is None or link.moved_m >= LEAST_MOVED_M:
        return waited
    return (
        f"{waited}; when it was, it moved by {1e3 * link.moved_m:.2g} mm only: look at capture.unit ({own.spoken_unit})"
    )


class MovedCup:
    """The cup as a light body, moved by the coupling's force, rope and ball; its own weight is not felt."""

    def __init__(self, game: GameSettings) -> None:
        self.world, self.place = HandWorld(game), np.zeros(PLACE)
        self._speed_m_s, self._per_kg, self._steps = np.zeros(3), STEP_S / game.cup.mass_kg, 0

    def free_m(self) -> Array:
        """Return the displacement in the next step without the coupling."""
        return np.asarray((self._speed_m_s + self._per_kg * self.world.force_n) * STEP_S)

    def step(self, force_n: Array, record: TryRecord) -> None:
        """Move for a step under this force, and let ``record`` look now and then."""
        self._speed_m_s = self._speed_m_s + self._per_kg * (self.world.force_n + force_n)
        self.place[:3] += self._speed_m_s * STEP_S
        self.world.step(self.place)
        self._steps += 1
        if self._steps % LOOK_EVERY == 0 and not record.caught:
            record.look(self.world)


def open_haptic(settings: HapticCapture) -> Sequence[HapticDemonstrator]:
    """Open a demonstrator for every swing that is asked for, all at one device.

    Raises HardwareError where none answers, ConfigError where the folder to keep them in holds swings already.
    """
    folder = Path(settings.record)
    if folder.exists() and (not folder.is_dir() or any(folder.glob("*.csv"))):
        raise ConfigError(
            "capture.record",
            f"'capture.record' is {folder}, which holds something; a recording is never overwritten: name another",
        )
    link = HapticLink(settings)
    folder.mkdir(parents=True, exist_ok=True)
    return tuple(HapticDemonstrator(f"swing-{number + 1}", link, folder) for number in range(settings.swings))
