/* Stands between a process and its disk: LD_PRELOAD. It counts the calls that change or open what lies below one folder,
 * makes one of them fail or end the process, and writes down what reached the kernel and what was told to be durable.
 * Compiled by the tests (cc -shared -fPIC -O1 disk_shim.c -ldl). The tests call disk_arm() in the process that they forked. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

enum { NOTHING, KILL, FULL, FAULTY, INTERRUPTED, SHORT };
static char root[PATH_MAX];
static size_t root_n;
static long calls, fault_at;
static int fault_kind, journal = -1, repeats;

/* From now on calls below `folder` count; the one numbered `at` (from 1; 0: none) meets `kind`. With `repeating`, those
 * after it of the same kind do too, as on a disk that stays full. What happens is appended to the file descriptor
 * `journal_fd` (-1: nowhere). */
void disk_arm(const char *folder, long at, int kind, int repeating, int journal_fd) {
    root_n = strlen(folder);
    memcpy(root, folder, root_n + 1);
    calls = 0;
    fault_at = at;
    fault_kind = kind;
    repeats = repeating;
    journal = journal_fd;
}

long disk_calls(void) { return calls; }

static int below(const char *path) {
    return root_n && !strncmp(path, root, root_n) && (path[root_n] == '/' || !path[root_n]);
}

static const char *of_descriptor(int fd, char *path) {
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t n = syscall(SYS_readlink, link, path, PATH_MAX - 1);
    path[n < 0 ? 0 : n] = 0;
    return path;
}

static const char *at_folder(int fd, const char *name, char *path) {
    if (name[0] == '/' || fd == AT_FDCWD) {
        snprintf(path, PATH_MAX, "%s", name);
    } else {
        char folder[PATH_MAX];
        of_descriptor(fd, folder);
        if (snprintf(path, PATH_MAX, "%s/%s", folder, name) >= PATH_MAX) path[0] = 0;
    }
    return path;
}

/* What the next call meets; -1 where errno is set for it. */
static int meets(int writes) {
    calls++;
    int here = fault_at && (calls == fault_at || (repeats && calls > fault_at));
    if (!here) return NOTHING;
    switch (fault_kind) {
    case KILL: syscall(SYS_kill, syscall(SYS_getpid), SIGKILL); pause(); break;
    case FULL: errno = ENOSPC; return -1;
    case FAULTY: errno = EIO; return -1;
    case INTERRUPTED: errno = EINTR; return -1;
    case SHORT: return writes ? SHORT : NOTHING;
    }
    return NOTHING;
}

static void put(const void *data, size_t n) {
    const char *next = data;
    while (n) {
        ssize_t done = syscall(SYS_write, journal, next, n);
        if (done <= 0) return;
        next += done;
        n -= done;
    }
}

/* One record: what, then three fields with their lengths. */
static void note(char what, const char *path, const char *other, const void *data, uint32_t n) {
    if (journal < 0) return;
    uint32_t lengths[3] = {strlen(path), strlen(other), n};
    put(&what, 1);
    put(lengths, sizeof lengths);
    put(path, lengths[0]);
    put(other, lengths[1]);
    put(data, n);
}

static int opened(int fd, const char *path, int flags) {
    if (fd >= 0 && (flags & (O_CREAT | O_TRUNC))) note(flags & O_TRUNC ? 't' : 'c', path, "", "", 0);
    return fd;
}

static int open_at(int folder, const char *name, int flags, mode_t mode) {
    char path[PATH_MAX];
    at_folder(folder, name, path);
    if (!below(path)) return syscall(SYS_openat, folder, name, flags, mode);
    if (meets(0) < 0) return -1;
    return opened(syscall(SYS_openat, folder, name, flags, mode), path, flags);
}

#define MODE(last) mode_t mode = 0; if (flags & (O_CREAT | O_TMPFILE)) { va_list more; va_start(more, last); mode = va_arg(more, mode_t); va_end(more); }
int open(const char *name, int flags, ...) { MODE(flags) return open_at(AT_FDCWD, name, flags, mode); }
int open64(const char *name, int flags, ...) { MODE(flags) return open_at(AT_FDCWD, name, flags | O_LARGEFILE, mode); }
int openat(int folder, const char *name, int flags, ...) { MODE(flags) return open_at(folder, name, flags, mode); }
int openat64(int folder, const char *name, int flags, ...) { MODE(flags) return open_at(folder, name, flags | O_LARGEFILE, mode); }

ssize_t write(int fd, const void *data, size_t n) {
    char path[PATH_MAX];
    if (!root_n || fd < 3 || fd == journal || !below(of_descriptor(fd, path))) return syscall(SYS_write, fd, data, n);
    int met = meets(1);
    if (met < 0) return -1;
    if (met == SHORT && n > 1) n /= 2;
    char place[32];
    snprintf(place, sizeof place, "%lld", (long long)lseek(fd, 0, SEEK_CUR));
    ssize_t done = syscall(SYS_write, fd, data, n);
    if (done > 0) note('w', path, place, data, done);
    return done;
}

static int synced(int fd, long number) {
    char path[PATH_MAX];
    if (!root_n || !below(of_descriptor(fd, path))) return syscall(number, fd);
    if (meets(0) < 0) return -1;
    int done = syscall(number, fd);
    if (!done) note('s', path, "", "", 0);
    return done;
}
int fsync(int fd) { return synced(fd, SYS_fsync); }
int fdatasync(int fd) { return synced(fd, SYS_fdatasync); }

static int moved(int from, const char *one, int to, const char *other) {
    char a[PATH_MAX], b[PATH_MAX];
    at_folder(from, one, a);
    at_folder(to, other, b);
    if (!below(a) && !below(b)) return syscall(SYS_renameat, from, one, to, other);
    if (meets(0) < 0) return -1;
    int done = syscall(SYS_renameat, from, one, to, other);
    if (!done) note('r', a, b, "", 0);
    return done;
}
int rename(const char *one, const char *other) { return moved(AT_FDCWD, one, AT_FDCWD, other); }
int renameat(int from, const char *one, int to, const char *other) { return moved(from, one, to, other); }

static int removed(int folder, const char *name, int flags) {
    char path[PATH_MAX];
    at_folder(folder, name, path);
    if (!below(path)) return syscall(SYS_unlinkat, folder, name, flags);
    if (meets(0) < 0) return -1;
    int done = syscall(SYS_unlinkat, folder, name, flags);
    if (!done) note('u', path, "", "", 0);
    return done;
}
int unlink(const char *name) { return removed(AT_FDCWD, name, 0); }
int rmdir(const char *name) { return removed(AT_FDCWD, name, AT_REMOVEDIR); }
int unlinkat(int folder, const char *name, int flags) { return removed(folder, name, flags); }

static int made(int folder, const char *name, mode_t mode) {
    char path[PATH_MAX];
    at_folder(folder, name, path);
    if (!below(path)) return syscall(SYS_mkdirat, folder, name, mode);
    if (meets(0) < 0) return -1;
    int done = syscall(SYS_mkdirat, folder, name, mode);
    if (!done) note('m', path, "", "", 0);
    return done;
}
int mkdir(const char *name, mode_t mode) { return made(AT_FDCWD, name, mode); }
int mkdirat(int folder, const char *name, mode_t mode) { return made(folder, name, mode); }

static int cut(int fd, off_t size) {
    char path[PATH_MAX];
    if (!root_n || !below(of_descriptor(fd, path))) return syscall(SYS_ftruncate, fd, size);
    if (meets(0) < 0) return -1;
    int done = syscall(SYS_ftruncate, fd, size);
    char place[32];
    snprintf(place, sizeof place, "%lld", (long long)size);
    if (!done) note('f', path, place, "", 0);
    return done;
}
int ftruncate(int fd, off_t size) { return cut(fd, size); }
int ftruncate64(int fd, off_t size) { return cut(fd, size); }
