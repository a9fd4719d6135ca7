#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

enum { OPEN, WRITE, PWRITE, FSYNC, FDATASYNC, FTRUNCATE, RENAME, LINK, UNLINK, MKDIR, CALLS };
static char folder[4096];
static long counts[CALLS], nth = -1, hits, again;
static int wanted = -1, code, stay;
static unsigned char failed[65536];

void ocmm_fault(const char *below, int call, long number, int error, int on)
{
    snprintf(folder, sizeof folder, "%s", below);
    memset(counts, 0, sizeof counts);
    wanted = call; nth = number; code = error; stay = on; hits = again = 0;
}
long ocmm_count(int call) { return counts[call]; }
long ocmm_hits(void) { return hits; }
long ocmm_again(void) { return again; }

static int below(const char *path)
{
    return folder[0] && path && strncmp(path, folder, strlen(folder)) == 0;
}
static int fd_below(int fd)
{
    char link[64], path[4096];
    if (!folder[0] || fd < 0) return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t n = readlink(link, path, sizeof path - 1);
    if (n < 0) return 0;
    path[n] = 0;
    return below(path);
}
/* Whether this call shall fail. */
static int fails(int call)
{
    long number = ++counts[call];
    if (call != wanted || !(number == nth || (stay && number > nth))) return 0;
    hits++;
    errno = code;
    return 1;
}
#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))
#define SYNC(name, call) \
    int name(int fd) \
    { \
        if (fd_below(fd)) { \
            if (fd < 65536 && failed[fd]) again++; \
            if (fails(call)) { if (fd < 65536) failed[fd] = 1; return -1; } \
        } \
        return REAL(name)(fd); \
    }
SYNC(fsync, FSYNC)
SYNC(fdatasync, FDATASYNC)
int close(int fd)
{
    if (fd >= 0 && fd < 65536) failed[fd] = 0;
    return REAL(close)(fd);
}
#define OPENER(name) \
    int name(const char *path, int flags, ...) \
    { \
        mode_t mode = 0; \
        if (flags & (O_CREAT | __O_TMPFILE)) { \
            va_list a; va_start(a, flags); mode = va_arg(a, mode_t); va_end(a); \
        } \
        if ((flags & (O_WRONLY | O_RDWR)) && below(path) && fails(OPEN)) return -1; \
        return REAL(name)(path, flags, mode); \
    }
OPENER(open)
OPENER(open64)
ssize_t write(int fd, const void *content, size_t n)
{
    if (fd_below(fd) && fails(WRITE)) return -1;
    return REAL(write)(fd, content, n);
}
#define PWRITER(name, type) \
    ssize_t name(int fd, const void *content, size_t n, type at) \
    { \
        if (fd_below(fd) && fails(PWRITE)) return -1; \
        return REAL(name)(fd, content, n, at); \
    }
PWRITER(pwrite, off_t)
PWRITER(pwrite64, off64_t)
#define TRUNCATER(name, type) \
    int name(int fd, type n) \
    { \
        if (fd_below(fd) && fails(FTRUNCATE)) return -1; \
        return REAL(name)(fd, n); \
    }
TRUNCATER(ftruncate, off_t)
TRUNCATER(ftruncate64, off64_t)
#define NAMER(name, call) \
    int name(const char *from, const char *to) \
    { \
        if (below(to) && fails(call)) return -1; \
        return REAL(name)(from, to); \
    }
NAMER(rename, RENAME)
NAMER(link, LINK)
int unlink(const char *path)
{
    if (below(path) && fails(UNLINK)) return -1;
    return REAL(unlink)(path);
}
int mkdir(const char *path, mode_t mode)
{
    if (below(path) && fails(MKDIR)) return -1;
    return REAL(mkdir)(path, mode);
}
