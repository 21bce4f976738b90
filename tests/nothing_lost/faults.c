/* Lets one call of a program fail, or ends the program there, to see what is left of its files.
 *
 *     cc -shared -fPIC -O1 -o faults.so faults.c -ldl
 *     LD_PRELOAD=./faults.so FAULT_ROOT=/tmp/x FAULT_AT=7 FAULT_ERRNO=28 program
 *
 * Calls are counted that open, write, sync, rename, link or remove something below FAULT_ROOT, or make a folder or change
 * permissions there. FAULT_AT is the number of the call that fails, from 1; 0 or nothing lets all of them pass. It fails with
 * FAULT_ERRNO, or with FAULT_KILL=1 the process is killed in its stead. FAULT_NO_EXCHANGE=1 lets every exchange of two names
 * fail as on a file system that knows no such thing. FAULT_LOG names a file to which the counted calls are written. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

static atomic_int counted;

static long setting(const char *name) {
    const char *text = getenv(name);
    return text ? atol(text) : 0;
}

static int below(const char *path) {
    const char *root = getenv("FAULT_ROOT");
    return root && path && strncmp(path, root, strlen(root)) == 0;
}

/* The path that a name relative to an open folder stands for. */
static int concerns(int folder, const char *name) {
    char link[64], path[2 * PATH_MAX];
    ssize_t length;
    if (name && name[0] == '/')
        return below(name);
    if (folder == AT_FDCWD) {
        if (!getcwd(path, PATH_MAX))
            return 0;
    } else {
        snprintf(link, sizeof link, "/proc/self/fd/%d", folder);
        length = readlink(link, path, PATH_MAX - 1);
        if (length < 0)
            return 0;
        path[length] = 0;
    }
    if (name && name[0]) {
        strcat(path, "/");
        strncat(path, name, PATH_MAX - 1);
    }
    return below(path);
}

/* Counts a call; not zero if it is to fail. */
static int fails(const char *what, const char *path) {
    int number = atomic_fetch_add(&counted, 1) + 1;
    const char *log = getenv("FAULT_LOG");
    if (log) {
        static int (*real_open)(const char *, int, ...);
        if (!real_open)
            real_open = (int (*)(const char *, int, ...))dlsym(RTLD_NEXT, "open");
        int file = real_open(log, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
        if (file >= 0) {
            dprintf(file, "%d %s %s\n", number, what, path ? path : "");
            close(file);
        }
    }
    if (number != setting("FAULT_AT"))
        return 0;
    if (setting("FAULT_KILL"))
        kill(getpid(), SIGKILL);
    errno = (int)setting("FAULT_ERRNO");
    return 1;
}

#define REAL(name) \
    static __typeof__(name) *real; \
    if (!real) real = (__typeof__(name) *)dlsym(RTLD_NEXT, #name)


#define ON_PATH(name, parameters, arguments, folder, path) \
    int name parameters { \
        REAL(name); \
        if (concerns(folder, path) && fails(#name, path)) return -1; \
        return real arguments; \
    }

#define OPEN(name) \
    int name(const char *path, int flags, ...) { \
        va_list list; \
        REAL(name); \
        va_start(list, flags); \
        mode_t mode = flags & (O_CREAT | __O_TMPFILE) ? va_arg(list, mode_t) : 0; \
        va_end(list); \
        if (concerns(AT_FDCWD, path) && fails("open", path)) return -1; \
        return real(path, flags, mode); \
    }

#define OPEN_AT(name) \
    int name(int folder, const char *path, int flags, ...) { \
        va_list list; \
        REAL(name); \
        va_start(list, flags); \
        mode_t mode = flags & (O_CREAT | __O_TMPFILE) ? va_arg(list, mode_t) : 0; \
        va_end(list); \
        if (concerns(folder, path) && fails("open", path)) return -1; \
        return real(folder, path, flags, mode); \
    }

OPEN(open)
OPEN(open64)
OPEN_AT(openat)
OPEN_AT(openat64)

#define SIZED(name, parameters, arguments) \
    ssize_t name parameters { \
        REAL(name); \
        if (concerns(file, "") && fails(#name, "")) return -1; \
        return real arguments; \
    }

SIZED(write, (int file, const void *bytes, size_t length), (file, bytes, length))
SIZED(writev, (int file, const struct iovec *parts, int count), (file, parts, count))
SIZED(pwrite64, (int file, const void *bytes, size_t length, off64_t at), (file, bytes, length, at))

#define ON_OPEN(name, parameters, arguments) \
    int name parameters { \
        REAL(name); \
        if (concerns(file, "") && fails(#name, "")) return -1; \
        return real arguments; \
    }

ON_OPEN(fsync, (int file), (file))
ON_OPEN(fdatasync, (int file), (file))
ON_OPEN(fchmod, (int file, mode_t mode), (file, mode))
ON_OPEN(ftruncate64, (int file, off64_t length), (file, length))

ON_PATH(mkdir, (const char *path, mode_t mode), (path, mode), AT_FDCWD, path)
ON_PATH(rmdir, (const char *path), (path), AT_FDCWD, path)
ON_PATH(unlink, (const char *path), (path), AT_FDCWD, path)
ON_PATH(unlinkat, (int folder, const char *path, int flags), (folder, path, flags), folder, path)
ON_PATH(chmod, (const char *path, mode_t mode), (path, mode), AT_FDCWD, path)
ON_PATH(fchmodat, (int folder, const char *path, mode_t mode, int flags), (folder, path, mode, flags), folder, path)
ON_PATH(link, (const char *from, const char *to), (from, to), AT_FDCWD, to)
ON_PATH(linkat, (int a, const char *from, int b, const char *to, int flags), (a, from, b, to, flags), b, to)
ON_PATH(rename, (const char *from, const char *to), (from, to), AT_FDCWD, to)
ON_PATH(renameat, (int a, const char *from, int b, const char *to), (a, from, b, to), b, to)

int renameat2(int a, const char *from, int b, const char *to, unsigned flags) {
    REAL(renameat2);
    if (concerns(b, to)) {
        if ((flags & 2) && setting("FAULT_NO_EXCHANGE")) {
            errno = EINVAL;
            return -1;
        }
        if (fails("renameat2", to))
            return -1;
    }
    return real(a, from, b, to, flags);
}
