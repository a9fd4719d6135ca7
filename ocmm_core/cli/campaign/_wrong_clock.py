"""A clock of the computer that can be set by this program alone, in its own process."""

from __future__ import annotations

import ctypes
import os
from datetime import UTC, datetime, timedelta

WRONG_CLOCK = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <sys/time.h>
#include <time.h>

static volatile long long shift_us;

void ocmm_shift_clock(long long us) { shift_us = us; }

static void moved(long long *s, long long *us)
{
    long long all = *s * 1000000 + *us + shift_us;
    *s = all / 1000000; *us = all % 1000000;
    if (*us < 0) { *us += 1000000; *s -= 1; }
}
int clock_gettime(clockid_t which, struct timespec *at)
{
    static int (*real)(clockid_t, struct timespec *);
    if (!real) real = (int (*)(clockid_t, struct timespec *))dlsym(RTLD_NEXT, "clock_gettime");
    int code = real(which, at);
    if (code == 0 && (which == CLOCK_REALTIME || which == CLOCK_REALTIME_COARSE)) {
        long long s = at->tv_sec, us = at->tv_nsec / 1000, rest = at->tv_nsec % 1000;
        moved(&s, &us);
        at->tv_sec = s; at->tv_nsec = us * 1000 + rest;
    }
    return code;
}
int gettimeofday(struct timeval *restrict at, void *restrict zone)
{
    struct timespec now;
    int code = clock_gettime(CLOCK_REALTIME, &now);
    (void)zone;
    if (code == 0) { at->tv_sec = now.tv_sec; at->tv_usec = now.tv_nsec / 1000; }
    return code;
}
time_t time(time_t *at)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (at) *at = now.tv_sec;
    return now.tv_sec;
}
"""
"""Whoever asks for the time of day gets a shifted one; the monotonic clock is not touched."""

_SECOND = timedelta(seconds=1)


class WrongClock:
    """The clock in a process that was started with the library before the system."""

    def __init__(self) -> None:
        self._library = ctypes.CDLL(os.environ["LD_PRELOAD"])
        self._shift = timedelta()

    def set_to(self, moment: datetime) -> None:
        """Set the clock; it goes on from there."""
        self._shift += moment - datetime.now(UTC)
        self._library.ocmm_shift_clock(ctypes.c_longlong(self._shift // (_SECOND / 1_000_000)))

    def jump(self, by: timedelta) -> None:
        """Set the clock forwards or backwards."""
        self.set_to(datetime.now(UTC) + by)
