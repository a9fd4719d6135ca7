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
