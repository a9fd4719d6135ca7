/* A GenTL producer (.cti) of software cameras, for the tests of the client that reads producers.

Each camera is a file NAME.memory in the folder OCMM_TEST_CAMERAS, its registers (`ocmm_sim.genicam`),
and a file NAME.images, its images one after the other. Exposures are at multiples of the period on
the clock of this computer, so that all cameras expose together. A code at LIE makes a camera lie. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <glob.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

typedef int32_t GC_ERROR;
enum { OK = 0, NOT_IMPLEMENTED = -1003, IN_USE = -1004, INVALID_ID = -1007, INVALID_ADDRESS = -1015,
       TIMED_OUT = -1011, NOT_AVAILABLE = -1014, TOO_SMALL = -1016, INVALID_INDEX = -1017 };
enum { STRING = 1, INT32 = 5, UINT32 = 6, UINT64 = 8, PTR = 10, BOOL8 = 11, SIZET = 12 };
enum { MEMORY = 0x40000, LIE = 0xF000, URL = 0x200, PAYLOAD = 0x10038, RATE = 0x10048,
       WIDTH = 0x10000, HEIGHT = 0x10008, FORMAT = 0x10030, MOST = 64, BUFFERS = 256 };
enum { WIDER = 1, HALF_FILLED = 2, OVERFILLED = 3, BUSY = 4, NO_TIME = 5 };

typedef struct { uint8_t *memory, *base; size_t size; void *user; uint64_t frame, time_ns; size_t filled; } Buffer;
typedef struct {
    uint8_t *memory, *images;
    size_t n_bytes;
    int opened, grabbing;
    uint64_t last, first;
    Buffer buffers[BUFFERS];
    int n_buffers, queue[BUFFERS], n_queued;
} Camera;

static Camera cameras[MOST];
static int n_cameras;
static int tl, iface;
#define API __attribute__((visibility("default"))) GC_ERROR

static uint64_t big(const uint8_t *at, int n) { uint64_t v = 0; for (int i = 0; i < n; i++) v = v << 8 | at[i]; return v; }
static GC_ERROR put(const void *from, size_t n, int type, int32_t *told, void *to, size_t *size) {
    if (told) *told = type;
    if (to && *size < n) return TOO_SMALL;
    if (to) memcpy(to, from, n);
    *size = n;
    return OK;
}
#define PUT(ctype, code, value) do { ctype v = (ctype)(value); return put(&v, sizeof v, code, type, to, size); } while (0)
#define TEXT(value) do { const char *v = (value); return put(v, strlen(v) + 1, STRING, type, to, size); } while (0)

static void *mapped(const char *path, size_t *n) {
    struct stat about;
    int file = open(path, O_RDWR);
    if (file < 0 || fstat(file, &about)) return NULL;
    *n = about.st_size;
    void *at = mmap(NULL, *n, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    return at == MAP_FAILED ? NULL : at;
}
static const char *text(Camera *c, int at) { return (const char *)c->memory + at; }
static int lie(Camera *c) { return (int)big(c->memory + LIE, 4); }

API GCInitLib(void) { return OK; }
API GCCloseLib(void) { return OK; }
API GCGetLastError(GC_ERROR *code, char *to, size_t *size) { *code = OK; return put("", 1, STRING, NULL, to, size); }
static GC_ERROR about(int cmd, int32_t *type, void *to, size_t *size) {
    if (cmd == 9 || cmd == 10) PUT(uint32_t, UINT32, cmd == 9 ? 1 : 5);
    if (cmd == 8) PUT(int32_t, INT32, 0);
    TEXT(cmd == 4 ? "GEV" : "Software Producer");
}
API GCGetInfo(int32_t cmd, int32_t *type, void *to, size_t *size) { return about(cmd, type, to, size); }
API TLOpen(void **handle) {
    glob_t found;
    char pattern[4096];
    const char *folder = getenv("OCMM_TEST_CAMERAS");
    *handle = &tl;
    if (n_cameras || !folder) return OK;
    snprintf(pattern, sizeof pattern, "%s/*.memory", folder);
    if (glob(pattern, 0, NULL, &found)) return OK;
    for (size_t i = 0; i < found.gl_pathc && n_cameras < MOST; i++) {
        Camera *c = &cameras[n_cameras];
        size_t n;
        c->memory = mapped(found.gl_pathv[i], &n);
        strcpy(strrchr(strcpy(pattern, found.gl_pathv[i]), '.'), ".images");
        c->images = mapped(pattern, &c->n_bytes);
        if (c->memory && c->images && n == MEMORY) n_cameras++;
    }
    globfree(&found);
    return OK;
}
API TLClose(void *h) { return OK; }
API TLGetInfo(void *h, int32_t cmd, int32_t *type, void *to, size_t *size) { return about(cmd, type, to, size); }
API TLGetNumInterfaces(void *h, uint32_t *n) { *n = 1; return OK; }
API TLGetInterfaceID(void *h, uint32_t i, char *to, size_t *size) { return put("one", 4, STRING, NULL, to, size); }
API TLGetInterfaceInfo(void *h, const char *id, int32_t cmd, int32_t *type, void *to, size_t *size) { TEXT(cmd == 2 ? "GEV" : "one"); }
API TLOpenInterface(void *h, const char *id, void **to) { *to = &iface; return OK; }
API TLUpdateInterfaceList(void *h, uint8_t *changed, uint64_t ms) { if (changed) *changed = 0; return OK; }
API IFClose(void *h) { return OK; }
API IFGetInfo(void *h, int32_t cmd, int32_t *type, void *to, size_t *size) { TEXT(cmd == 2 ? "GEV" : "one"); }
API IFGetNumDevices(void *h, uint32_t *n) { *n = n_cameras; return OK; }
API IFGetDeviceID(void *h, uint32_t i, char *to, size_t *size) {
    if ((int)i >= n_cameras) return INVALID_INDEX;
    const char *id = text(&cameras[i], 0xD8);
    return put(id, strlen(id) + 1, STRING, NULL, to, size);
}
API IFUpdateDeviceList(void *h, uint8_t *changed, uint64_t ms) { if (changed) *changed = 1; return OK; }
API IFGetParentTL(void *h, void **to) { *to = &tl; return OK; }
static Camera *named(const char *id) {
    for (int i = 0; i < n_cameras; i++) if (!strcmp(text(&cameras[i], 0xD8), id)) return &cameras[i];
    return NULL;
}
API DevGetInfo(void *h, int32_t cmd, int32_t *type, void *to, size_t *size) {
    Camera *c = h;
    if (cmd == 5) PUT(int32_t, INT32, c->opened || lie(c) == BUSY ? 4 : 1);
    if (cmd == 9) PUT(uint64_t, UINT64, big(c->memory + 0x93C, 8));
    if (cmd == 6) return NOT_AVAILABLE;
    TEXT(cmd == 1 ? text(c, 0x48) : cmd == 2 ? text(c, 0x68) : cmd == 3 ? "GEV" : text(c, 0xD8));
}
API IFGetDeviceInfo(void *h, const char *id, int32_t cmd, int32_t *type, void *to, size_t *size) {
    Camera *c = named(id);
    return c ? DevGetInfo(c, cmd, type, to, size) : INVALID_ID;
}
API IFOpenDevice(void *h, const char *id, int32_t flags, void **to) {
    Camera *c = named(id);
    if (!c) return INVALID_ID;
    if (c->opened || lie(c) == BUSY) return IN_USE;
    c->opened = 1;
    *to = c;
    return OK;
}
API DevGetPort(void *h, void **to) { *to = h; return OK; }
API DevGetNumDataStreams(void *h, uint32_t *n) { *n = 1; return OK; }
API DevGetDataStreamID(void *h, uint32_t i, char *to, size_t *size) { return put("stream", 7, STRING, NULL, to, size); }
API DevOpenDataStream(void *h, const char *id, void **to) { ((Camera *)h)->n_buffers = ((Camera *)h)->n_queued = 0; *to = h; return OK; }
API DevClose(void *h) { ((Camera *)h)->opened = 0; return OK; }
API DevGetParentIF(void *h, void **to) { *to = &iface; return OK; }

static Camera *camera_of(void *h) { return h == &tl || h == &iface ? NULL : h; }
/* The other modules have no features, but need a description. */
static const char NONE[] =
    "<?xml version=\"1.0\"?><RegisterDescription ModelName=\"M\" VendorName=\"OCMM\" StandardNameSpace=\"GEV\" "
    "SchemaMajorVersion=\"1\" SchemaMinorVersion=\"1\" SchemaSubMinorVersion=\"0\" MajorVersion=\"1\" "
    "MinorVersion=\"0\" SubMinorVersion=\"0\" ProductGuid=\"0\" VersionGuid=\"0\" "
    "xmlns=\"http://www.genicam.org/GenApi/Version_1_1\"><Category Name=\"Root\" NameSpace=\"Standard\"/>"
    "<Port Name=\"Device\"/></RegisterDescription>";
static const char *url_of(void *h) {
    static char url[64];
    snprintf(url, sizeof url, "Local:none.xml;0;%zx", sizeof NONE - 1);
    return camera_of(h) ? text(h, URL) : url;
}
API GCReadPort(void *h, uint64_t at, void *to, size_t *size) {
    Camera *c = camera_of(h);
    uint64_t end = c ? MEMORY : sizeof NONE;
    if (at > end || *size > end - at) return INVALID_ADDRESS;
    memcpy(to, c ? (const char *)c->memory + at : NONE + at, *size);
    return OK;
}
API GCWritePort(void *h, uint64_t at, const void *from, size_t *size) {
    Camera *c = camera_of(h);
    if (!c || at > MEMORY || *size > MEMORY - at) return INVALID_ADDRESS;
    memcpy(c->memory + at, from, *size);
    return OK;
}
API GCReadPortStacked(void *h, void *entries, size_t *n) { return NOT_IMPLEMENTED; }
API GCWritePortStacked(void *h, void *entries, size_t *n) { return NOT_IMPLEMENTED; }
API GCGetPortInfo(void *h, int32_t cmd, int32_t *type, void *to, size_t *size) {
    if (cmd >= 5 && cmd <= 10) PUT(uint8_t, BOOL8, cmd == 6 || cmd == 7 || cmd == 8);
    TEXT(cmd == 4 ? (camera_of(h) ? "RemoteDevice" : "TLSystem") : cmd == 12 ? "Device" : "port");
}
API GCGetNumPortURLs(void *h, uint32_t *n) { *n = 1; return OK; }
API GCGetPortURL(void *h, char *to, size_t *size) { return put(url_of(h), strlen(url_of(h)) + 1, STRING, NULL, to, size); }
API GCGetPortURLInfo(void *h, uint32_t i, int32_t cmd, int32_t *type, void *to, size_t *size) {
    unsigned long address = 0, length = 0;
    if (cmd == 0) TEXT(url_of(h));
    sscanf(strchr(url_of(h), ';'), ";%lx;%lx", &address, &length);
    if (cmd == 7 || cmd == 8) PUT(uint64_t, UINT64, cmd == 7 ? address : length);
    if (cmd == 9) PUT(int32_t, INT32, 0);
    if (cmd >= 1 && cmd <= 5) PUT(int32_t, INT32, 1);
    if (cmd == 10) TEXT("camera.xml");
    return NOT_AVAILABLE;
}
API GCRegisterEvent(void *h, int32_t kind, void **to) { if (kind != 1) return NOT_IMPLEMENTED; *to = h; return OK; }
API GCUnregisterEvent(void *h, int32_t kind) { return OK; }
API EventFlush(void *h) { return OK; }
API EventKill(void *h) { return OK; }
API EventGetInfo(void *h, int32_t cmd, int32_t *type, void *to, size_t *size) {
    if (cmd == 0) PUT(int32_t, INT32, 1);
    PUT(size_t, SIZET, cmd >= 3 ? 2 * sizeof(void *) : 0);
}
API EventGetDataInfo(void *h, const void *in, size_t n, int32_t cmd, int32_t *type, void *to, size_t *size) {
    if (cmd == 0) PUT(void *, PTR, ((void *const *)in)[0]);
    if (cmd == 1) PUT(void *, PTR, ((void *const *)in)[1]);
    return NOT_AVAILABLE;
}
static uint64_t now_ns(void) { struct timespec t; clock_gettime(CLOCK_REALTIME, &t); return t.tv_sec * 1000000000ull + t.tv_nsec; }
API EventGetData(void *h, void *to, size_t *size, uint64_t ms) {
    Camera *c = h;
    union { uint64_t bits; double real; } rate = { big(c->memory + RATE, 8) };
    uint64_t period = 1e9 / rate.real, payload = big(c->memory + PAYLOAD, 8), frames = payload ? c->n_bytes / payload : 0;
    uint64_t until = now_ns() + (ms > 1000 ? 1000 : ms) * 1000000ull;
    while (!c->grabbing || !c->n_queued || !frames || now_ns() / period <= c->last) {
        if (now_ns() >= until) return TIMED_OUT;
        usleep(200);
    }
    uint64_t k = now_ns() / period;
    Buffer *b = &c->buffers[c->queue[0]];
    memmove(c->queue, c->queue + 1, --c->n_queued * sizeof c->queue[0]);
    if (!c->first) c->first = k - 1;
    c->last = k;
    b->frame = k - c->first;
    b->time_ns = k * period;
    b->filled = payload < b->size ? payload : b->size;
    memcpy(b->base, c->images + k % frames * payload, b->filled);
    void *data[2] = { b, b->user };
    return put(data, sizeof data, PTR, NULL, to, size);
}
API DSAnnounceBuffer(void *h, void *base, size_t size, void *user, void **to) {
    Camera *c = h;
    if (c->n_buffers == BUFFERS) return IN_USE;
    Buffer *b = &c->buffers[c->n_buffers++];
    *b = (Buffer){ .memory = c->memory, .base = base, .size = size, .user = user };
    *to = b;
    return OK;
}
API DSAllocAndAnnounceBuffer(void *h, size_t size, void *user, void **to) { return NOT_IMPLEMENTED; }
API DSRevokeBuffer(void *h, void *buffer, void **base, void **user) {
    if (base) *base = ((Buffer *)buffer)->base;
    if (user) *user = ((Buffer *)buffer)->user;
    return OK;
}
API DSQueueBuffer(void *h, void *buffer) { Camera *c = h; c->queue[c->n_queued++] = (int)((Buffer *)buffer - c->buffers); return OK; }
API DSFlushQueue(void *h, int32_t operation) { ((Camera *)h)->n_queued = 0; return OK; }
API DSStartAcquisition(void *h, int32_t flags, uint64_t n) { ((Camera *)h)->grabbing = 1; ((Camera *)h)->first = 0; return OK; }
API DSStopAcquisition(void *h, int32_t flags) { ((Camera *)h)->grabbing = 0; return OK; }
API DSClose(void *h) { return OK; }
API DSGetInfo(void *h, int32_t cmd, int32_t *type, void *to, size_t *size) {
    Camera *c = h;
    if (cmd == 0) TEXT("stream");
    if (cmd == 10) TEXT("GEV");
    if (cmd == 8 || cmd == 9) PUT(uint8_t, BOOL8, cmd == 8 && c->grabbing);
    PUT(size_t, SIZET, cmd == 3 ? c->n_buffers : cmd == 4 ? c->n_queued : cmd == 12 ? 2 : cmd == 13 ? 1 : 0);
}
API DSGetBufferID(void *h, uint32_t i, void **to) { *to = &((Camera *)h)->buffers[i]; return OK; }
API DSGetParentDev(void *h, void **to) { *to = h; return OK; }
API DSGetBufferInfo(void *h, void *buffer, int32_t cmd, int32_t *type, void *to, size_t *size) {
    Camera *c = h;
    Buffer *b = buffer;
    switch (cmd) {
    case 0: PUT(void *, PTR, b->base);
    case 1: PUT(size_t, SIZET, b->size);
    case 2: PUT(void *, PTR, b->user);
    case 3: case 28: if (lie(c) == NO_TIME) return NOT_AVAILABLE; PUT(uint64_t, UINT64, b->time_ns);
    case 4: case 17: PUT(uint8_t, BOOL8, 1);
    case 5: case 6: case 7: case 29: case 30: case 31: PUT(uint8_t, BOOL8, 0);
    case 8: TEXT("GEV");
    case 9: case 27: PUT(size_t, SIZET, lie(c) == HALF_FILLED ? b->filled / 2 : lie(c) == OVERFILLED ? 16 * b->size : b->filled);
    case 10: PUT(size_t, SIZET, big(c->memory + WIDTH, 8) * (lie(c) == WIDER ? 2 : 1));
    case 11: case 22: PUT(size_t, SIZET, big(c->memory + HEIGHT, 8));
    case 12: case 13: case 14: case 15: case 18: PUT(size_t, SIZET, 0);
    case 16: PUT(uint64_t, UINT64, b->frame);
    case 19: PUT(size_t, SIZET, 1);
    case 20: PUT(uint64_t, UINT64, big(c->memory + FORMAT, 8));
    case 21: PUT(uint64_t, UINT64, 4);
    }
    return NOT_AVAILABLE;
}
API DSGetBufferChunkData(void *h, void *buffer, void *chunks, size_t *n) { *n = 0; return OK; }
API DSGetNumBufferParts(void *h, void *buffer, uint32_t *n) { *n = 0; return NOT_IMPLEMENTED; }
API DSGetBufferPartInfo(void *h, void *buffer, uint32_t i, int32_t cmd, int32_t *type, void *to, size_t *size) { return NOT_IMPLEMENTED; }
