"""The line to a KUKA controller: every telegram is answered within its cycle, by the newest command or by braking."""

from __future__ import annotations

import socket
import threading
import time

import numpy as np

from kendama_cli.devices.robot.interface import JointCommand
from kendama_cli.devices.robot.limiter import braked, limit_command
from kendama_cli.errors import HardwareError, MissingPartError
from kendama_cli.plugins.kuka_rsi.settings import RsiHardware
from kendama_cli.plugins.kuka_rsi.telegram import LARGEST_BYTES, Telegram, ahead_ms, read_telegram, write_answer
from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.schema.arrays import Array

_LISTENED = 5
"""So many telegrams are listened to for the controller's cycle, before any is answered."""
_QUIET = 10
"""So many cycles without a telegram: RSI is not running, or has ended meanwhile and began anew."""
_PATIENCE = 150
"""So many cycles a running RSI is left unanswered, to end by its own timeout; usual are 10 to 100."""
_JUMP = 1.5
"""An arm that is said to have gone faster than its limits by this factor is misreported."""
_RESOLUTION_DEG = 0.05
_BRAKING_S = 2.0


class RsiLink:
    """Answers telegrams in a thread of its own, from ``start`` to ``close``; ``move`` gives it one command.

    Angles are the controller's, in degrees. A fault of the controller's (silence, a wrong time stamp, a jump, no
    number) is kept, and ends the answers: then the controller stops the arm by itself. ``late`` counts what it took
    too late, ``foreign`` the datagrams of others.
    """

    def __init__(self, settings: RsiHardware, limits: JointLimits) -> None:
        self._settings, self._limits = settings, limits
        self._line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._serve, name="rsi", daemon=True)
        self._wanted: JointCommand | None = None
        self._sent_at: int | None = None
        self._over, self._first_late = False, 0
        self.failure: str | None = None
        self.foreign = self.late = 0

    def start(self) -> None:
        """Wait for the controller, learn its cycle, answer from now on; raises MissingPartError, HardwareError."""
        settings = self._settings
        try:
            self._line.bind((settings.host, settings.port))
        except OSError as error:
            raise HardwareError(f"RSI cannot listen on {settings.host}:{settings.port}: {error}") from None
        first = self._beginning()
        more = (_in_time(self._receive(settings.silence_s), settings) for _ in range(_LISTENED - 1))
        stamps = [first.ipoc, *(one.ipoc for one in more)]
        cycle_s = 1e-3 * min(map(ahead_ms, stamps[1:], stamps))
        if abs(cycle_s - settings.control_period_s) > 1e-9:
            raise HardwareError(
                f"the controller's cycle is {1e3 * cycle_s:g} ms by its IPOC; set hardware.control_period_s={cycle_s:g}"
            )
        self.start_deg = first.position_deg
        self._last = JointCommand(first.position_deg, np.zeros(6), np.zeros(6))
        self._newest, self._first_late = first, first.late
        self._thread.start()

    def _beginning(self) -> Telegram:
        """Wait for the first telegram of RSI; raises MissingPartError if none comes, HardwareError if too late.

        Corrections count from where RSI began. One that runs already may have been corrected by a commander that has
        gone: it is left unanswered until it ends, and the next is waited for. A controller that neither ends nor counts
        what it lacks (a simulator) is taken as it stands.
        """
        settings, until_s = self._settings, time.monotonic() + self._settings.wait_s
        quiet_s = _QUIET * settings.control_period_s
        running = newest = self._receive(quiet_s)
        while running is not None and newest is not None:
            stands = time.monotonic() > until_s
            if stands or ahead_ms(newest.ipoc, running.ipoc) > 1e3 * _PATIENCE * settings.control_period_s:
                if newest.late == running.late and not stands:
                    return newest
                raise HardwareError(
                    f"the RSI of {settings.controller} was running before it was listened to, so where it began is not "
                    "known: end it, run this again, and start the RSI program on the controller then"
                )
            newest = self._receive(quiet_s)
        first = self._receive(until_s - time.monotonic())
        if first is None:
            raise MissingPartError(
                "rsi",
                f"no RSI telegram of {settings.controller} came to {settings.host}:{settings.port} within "
                f"{settings.wait_s:g} s: start the RSI program on the controller, and see docs/plugins/kuka_rsi.md",
            )
        return first

    def move(self, wanted: JointCommand) -> tuple[JointCommand, Telegram, Telegram]:
        """Return the last command (or braking since), the answer to ``wanted``, newest state; raises HardwareError."""
        with self._changed:
            self._wanted, self._sent_at = wanted, None
            self._changed.notify_all()
            if not self._changed.wait_for(self._is_over, 2 * self._settings.silence_s):
                raise self.fail(f"no command was answered for {2 * self._settings.silence_s:g} s")
            if self.failure is not None:
                raise HardwareError(self.failure)
            return self._carried_out, self._answered, self._newest

    def _is_over(self) -> bool:
        """Return True if the cycle after the one that the command was sent in has come, or none will."""
        sent_at, newest = self._sent_at, self._newest.ipoc
        return self.failure is not None or (sent_at is not None and ahead_ms(newest, sent_at) > 0)

    @property
    def newest(self) -> Telegram:
        """Return the controller's last telegram."""
        return self._newest

    def fail(self, problem: str) -> HardwareError:
        """Keep the first problem; the commander is told at its next command."""
        with self._changed:
            self.failure = self.failure or f"the controller at {self._settings.controller}: {problem}"
            self._changed.notify_all()
            return HardwareError(self.failure)

    def rest(self) -> None:
        """Wait until braking has brought the arm to rest; not for ever, and not where nothing is answered any more."""
        until_s = time.monotonic() + _BRAKING_S
        while self._thread.is_alive() and self._last.velocity_rad_s.any() and time.monotonic() < until_s:
            time.sleep(self._settings.control_period_s)

    def close(self) -> None:
        """Answer no more: the controller ends RSI when its time for answers is over."""
        self._over = True
        if self._thread.is_alive():
            self._thread.join()
        self._line.close()

    def _serve(self) -> None:
        try:
            while not self._over:
                telegram = _in_time(self._receive(self._settings.silence_s), self._settings)
                _check(telegram, self._newest, self._limits, self._settings.control_period_s)
                with self._changed:
                    self._newest, self._carried_out, self.late = telegram, self._last, telegram.late - self._first_late
                    self._changed.notify_all()
                    self._changed.wait_for(lambda: self._wanted is not None, self._settings.reply_s)
                    self._answer(telegram)
        except (HardwareError, OSError) as error:
            self.fail(f"{error}; it gets no more answers and stops the arm: start RSI anew there, and run again")

    def _answer(self, telegram: Telegram) -> None:
        """Send what is wanted, within the limits; where nothing is, or after a fault of the commander's, brake."""
        wanted, last, period_s = self._wanted, self._last, self._settings.control_period_s
        if wanted is None or self.failure is not None:
            wanted = braked(last, self._limits.acceleration_rad_s2, period_s)
        else:
            self._wanted, self._answered, self._sent_at = None, telegram, telegram.ipoc
        self._last = limit_command(last, wanted, self._limits, period_s)
        correction_deg = self._last.position_rad - self.start_deg
        self._line.sendto(write_answer(self._settings.sentype, correction_deg, telegram.ipoc), self._to)

    def _receive(self, timeout_s: float) -> Telegram | None:
        until_s, left_s = time.monotonic() + timeout_s, timeout_s
        while not self._over:
            # at least once: what came while this machine stalled is in time
            self._line.settimeout(min(max(left_s, 1e-4), 0.2))
            try:
                data, sender = self._line.recvfrom(LARGEST_BYTES + 1)
                if sender[0] == self._settings.controller:
                    self._to = sender
                    return read_telegram(data)
                self.foreign += 1
            except (TimeoutError, ConnectionError):
                pass
            left_s = until_s - time.monotonic()
            if left_s <= 0:
                break
        return None


def _in_time(telegram: Telegram | None, settings: RsiHardware) -> Telegram:
    if telegram is None:
        raise HardwareError(f"no telegram came for {settings.silence_s:g} s")
    return telegram


def in_degrees(limits: JointLimits, to_deg: Array, offset_deg: Array) -> JointLimits:
    """Return ``limits`` as the controller counts: its angle is ``offset_deg`` + ``to_deg`` times the description's."""
    lower, upper = np.sort([offset_deg + to_deg * limits.lower_rad, offset_deg + to_deg * limits.upper_rad], axis=0)
    size = np.abs(to_deg)
    speed, change = size * limits.velocity_rad_s, size * limits.acceleration_rad_s2
    return JointLimits(lower, upper, speed, change, limits.effort_nm)


def _check(telegram: Telegram, before: Telegram, limits: JointLimits, period_s: float) -> None:
    """Raise HardwareError where the time stamp or the place cannot follow those of ``before``."""
    ahead_s = 1e-3 * ahead_ms(telegram.ipoc, before.ipoc)
    cycles = ahead_s / period_s
    if cycles < 0.5 or abs(cycles - round(cycles)) > 1e-6:
        raise HardwareError(f"IPOC {telegram.ipoc} came after {before.ipoc}, which no clock of its cycle says")
    if cycles > _QUIET or telegram.late < before.late:
        raise HardwareError("RSI ended and began anew, from where is not known")
    moved = np.abs(telegram.position_deg - before.position_deg)
    over = moved - (_JUMP * limits.velocity_rad_s * ahead_s + _RESOLUTION_DEG)
    if (over > 0).any():
        axis = int(over.argmax())
        jump = f"jumped by {moved[axis]:.2f} deg in {1e3 * ahead_s:g} ms"
        raise HardwareError(f"axis A{axis + 1} is said to have {jump}")
