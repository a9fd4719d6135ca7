"""Lock the master's cycle to the bus clock: pure arithmetic on times, ns.

The bus clock is read in every cycle; the moment of reading is only bounded by the send and answer
times. A proportional-integral filter maps host to bus time; its slope is the drift. A reading
outside these bounds indicates a jump of the bus clock.
"""

from __future__ import annotations

_GAIN = 0.02
"""Phase gain per reading once settled; averages about 50 readings."""
_RATE_GAIN = _GAIN * _GAIN / 4.0
"""Slope gain: critically damped."""
_SETTLED = 50
"""Readings with a larger gain after a start."""
_ERROR_LIMIT_NS = 50_000.0
"""A larger error is a stall of this computer; it must not wind up the integral."""
_CERTAIN_NS = 100_000
"""Longer round trips have proportionally less weight."""
_RATE_LIMIT = 1e-3
"""Crystals are a hundred times better."""
_MARGIN_NS = 250_000.0
_UNSETTLED_MARGIN_NS = 2_000_000.0
_MARGIN_RATE = 5e-4
_SLEW_NS = 20_000
"""Limit of the shift of one cycle towards the bus clock."""
_REPORT_GAIN = 1.0 / 500.0


class BusClock:
    """Bus clock as observed by this computer."""

    def __init__(self, period_ns: int) -> None:
        self._period_ns = period_ns
        self._readings = 0
        self._host_ns = self._bus_ns = 0
        self._fraction_ns = 0.0
        self._rate = self._slow_rate = 0.0

    @property
    def known(self) -> bool:
        """Return whether there was a reading since the start."""
        return self._readings > 0

    @property
    def drift_ppm(self) -> float:
        """Return the bus clock's rate minus this computer's, smoothed over seconds."""
        return self._slow_rate * 1e6

    def restart(self) -> None:
        """Forget the time but not the drift, after the clocks were set."""
        self._readings = 0

    def bus_time(self, host_ns: int) -> int:
        since = host_ns - self._host_ns
        return self._bus_ns + since + round(since * self._rate + self._fraction_ns)

    def host_time(self, bus_ns: int) -> int:
        since = bus_ns - self._bus_ns - self._fraction_ns
        return self._host_ns + round(since - since * self._rate / (1.0 + self._rate))

    def observe(self, sent_ns: int, answered_ns: int, bus_ns: int) -> bool:
        """Record a clock reading between two host times; return False if implausible."""
        middle = (sent_ns + answered_ns) // 2
        if not self._readings:
            self._host_ns, self._bus_ns, self._fraction_ns = middle, bus_ns, 0.0
            self._readings = 1
            return True
        settled = self._readings >= _SETTLED
        margin = _MARGIN_NS if settled else _UNSETTLED_MARGIN_NS
        margin += _MARGIN_RATE * max(0, middle - self._host_ns)
        early, late = self.bus_time(sent_ns), self.bus_time(answered_ns)
        if not early - margin <= bus_ns <= late + margin:
            return False
        predicted = self.bus_time(middle)
        error = float(bus_ns - predicted)
        if settled:
            error = min(_ERROR_LIMIT_NS, max(-_ERROR_LIMIT_NS, error))
        trust = min(1.0, _CERTAIN_NS / max(1, answered_ns - sent_ns))
        gain = trust * max(_GAIN, 1.0 / (self._readings + 1))
        since = middle - self._host_ns
        exact = since * self._rate + self._fraction_ns + gain * error
        whole = round(exact)
        self._host_ns, self._bus_ns = middle, self._bus_ns + since + whole
        self._fraction_ns = exact - whole
        if settled:
            rate = self._rate + trust * _RATE_GAIN * error / self._period_ns
            self._rate = min(_RATE_LIMIT, max(-_RATE_LIMIT, rate))
            self._slow_rate += _REPORT_GAIN * (self._rate - self._slow_rate)
        self._readings += 1
        return True


class CyclePacer:
    """Start times of the cycles, by this computer's clock without a bus clock, and their count."""

    def __init__(self, period_ns: int, now_ns: int) -> None:
        self._period_ns = period_ns
        self.deadline_ns = now_ns
        self.phase_ns = 0.0
        """Smoothed deviation of the cycle starts from their target on the bus clock."""

    def begin(self, now_ns: int) -> int:
        """Start the due cycle; return the elapsed cycles, 1 if none was missed."""
        elapsed = 1 + max(0, now_ns - self.deadline_ns) // self._period_ns
        self.deadline_ns += elapsed * self._period_ns
        return elapsed

    def passed(self, now_ns: int) -> int:
        """Return the number of cycles that passed without an exchange."""
        elapsed = max(0, now_ns - self.deadline_ns) // self._period_ns
        self.deadline_ns += elapsed * self._period_ns
        return elapsed

    def follow(self, clock: BusClock, target_ns: int) -> None:
        """Move the next cycle towards the bus time `target_ns` modulo the period."""
        bus_ns = clock.bus_time(self.deadline_ns)
        cycles = (bus_ns - target_ns + self._period_ns // 2) // self._period_ns
        wanted = clock.host_time(target_ns + cycles * self._period_ns)
        off = self.deadline_ns - wanted
        self.phase_ns += 0.02 * (off - self.phase_ns)
        self.deadline_ns -= min(_SLEW_NS, max(-_SLEW_NS, off))
