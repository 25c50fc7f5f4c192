/* Makes the disk of a process fail. It is loaded before the C library. The N-th call of a kind on a
 * file below a directory fails. For a full disk all later calls fail too.
 *
 * FAULT_DIR  the directory
 * FAULT_KIND full (writes, ENOSPC, from the N-th on), write (one write, EIO), sync (one sync, EIO),
 *            lie (fsync and fdatasync succeed and do nothing), count (nothing fails)
 * FAULT_AT   N, counted from 1
 * FAULT_MARK a file outside the directory: the path of the file whose call failed first; with
 *            `count`, at the end, the numbers of writes and syncs
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

static const char *dir, *mark;
static enum { NONE, FULL, WRITE, SYNC, LIE, COUNT } kind;
static long at;
static atomic_long writes, syncs;

__attribute__((constructor)) static void begin(void) {
    const char *word = getenv("FAULT_KIND"), *number = getenv("FAULT_AT");
    dir = getenv("FAULT_DIR");
    mark = getenv("FAULT_MARK");
    at = number ? atol(number) : 0;
    if (!dir || !mark || !word) return;
    kind = !strcmp(word, "full") ? FULL : !strcmp(word, "write") ? WRITE
         : !strcmp(word, "sync") ? SYNC : !strcmp(word, "lie") ? LIE : !strcmp(word, "count") ? COUNT : NONE;
}

/* The path of the file, if it lies below the directory. */
static int ours(int fd, char *path, size_t size) {
    char link[64];
    if (kind == NONE) return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(link, path, size - 1);
    if (length < 0) return 0;
    path[length] = 0;
    return !strncmp(path, dir, strlen(dir));
}

static void say(const char *text) {
    /* The C library's functions, not ours. */
    int fd = (int)syscall(SYS_openat, AT_FDCWD, mark, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    if (fd < 0) return;
    if (syscall(SYS_write, fd, text, strlen(text)) < 0) { /* nobody to tell */ }
    syscall(SYS_close, fd);
}

/* The error with which this call must fail, or 0. */
static int fails(int fd, int is_sync) {
    char path[4096], text[64];
    if (!ours(fd, path, sizeof path)) return 0;
    long number = 1 + atomic_fetch_add(is_sync ? &syncs : &writes, 1);
    if (kind == COUNT) {
        snprintf(text, sizeof text, "%ld %ld", atomic_load(&writes), atomic_load(&syncs));
        say(text);
        return 0;
    }
    if (kind == LIE || is_sync != (kind == SYNC) || (kind == FULL ? number < at : number != at)) return 0;
    if (number == at) say(path);
    return kind == FULL ? ENOSPC : EIO;
}

static int lies(int fd) {
    char path[4096];
    return kind == LIE && ours(fd, path, sizeof path);
}

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))
#define GUARD(fd, is_sync) \
    do { int error = fails(fd, is_sync); if (error) { errno = error; return -1; } } while (0)

ssize_t write(int fd, const void *bytes, size_t size) {
    GUARD(fd, 0);
    return REAL(write)(fd, bytes, size);
}
ssize_t pwrite(int fd, const void *bytes, size_t size, off_t place) {
    GUARD(fd, 0);
    return REAL(pwrite)(fd, bytes, size, place);
}
ssize_t pwrite64(int fd, const void *bytes, size_t size, off64_t place) {
    GUARD(fd, 0);
    return REAL(pwrite64)(fd, bytes, size, place);
}
ssize_t writev(int fd, const struct iovec *parts, int count) {
    GUARD(fd, 0);
    return REAL(writev)(fd, parts, count);
}
ssize_t pwritev(int fd, const struct iovec *parts, int count, off_t place) {
    GUARD(fd, 0);
    return REAL(pwritev)(fd, parts, count, place);
}
int ftruncate(int fd, off_t size) {
    GUARD(fd, 0);
    return REAL(ftruncate)(fd, size);
}
int ftruncate64(int fd, off64_t size) {
    GUARD(fd, 0);
    return REAL(ftruncate64)(fd, size);
}
int fsync(int fd) {
    GUARD(fd, 1);
    if (lies(fd)) return 0;
    return REAL(fsync)(fd);
}
int fdatasync(int fd) {
    GUARD(fd, 1);
    if (lies(fd)) return 0;
    return REAL(fdatasync)(fd);
}
int sync_file_range(int fd, off64_t from, off64_t size, unsigned int flags) {
    GUARD(fd, 1);
    return REAL(sync_file_range)(fd, from, size, flags);
}
