/* A file system that shows new names late, for tests: a process does not see files that another one created or renamed below the folder
   LATE_BELOW within the last LATE_SECONDS. Locks and the catalog are seen at once, for what is older than the plan is not new.
   cc -shared -fPIC -o late.so late.c -ldl; LD_PRELOAD=late.so LATE_SECONDS=2 LATE_BELOW=/shared tetdb ... */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#define OWN 4096
static unsigned long own[OWN];
static int n_own;
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;

static int plain_stat(const char *path, struct stat *found) {
    return syscall(SYS_newfstatat, AT_FDCWD, path, found, AT_SYMLINK_NOFOLLOW);
}

/* Files that this process created: it sees them. */
static void remember(const char *path) {
    struct stat found;
    if (plain_stat(path, &found)) return;
    pthread_mutex_lock(&lock);
    own[n_own++ % OWN] = found.st_ino;
    pthread_mutex_unlock(&lock);
}

static int is_hidden(const char *path) {
    const char *below = getenv("LATE_BELOW"), *seconds = getenv("LATE_SECONDS");
    struct stat found;
    if (!below || !seconds || !path || strncmp(path, below, strlen(below))) return 0;
    if (strstr(path, ".lock") || strstr(path, "catalog.redb") || plain_stat(path, &found) || !S_ISREG(found.st_mode)) return 0;
    pthread_mutex_lock(&lock);
    for (int i = 0; i < OWN && i < n_own; i++)
        if (own[i] == found.st_ino) { pthread_mutex_unlock(&lock); return 0; }
    pthread_mutex_unlock(&lock);
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    double age = now.tv_sec - found.st_ctim.tv_sec + 1e-9 * (now.tv_nsec - found.st_ctim.tv_nsec);
    return age < atof(seconds);
}

static int open_as(const char *name, int dir, const char *path, int flags, mode_t mode) {
    if (!(flags & O_CREAT) && is_hidden(path)) { errno = ENOENT; return -1; }
    int fd = syscall(SYS_openat, dir, path, flags, mode);
    if (fd >= 0 && (flags & O_CREAT)) remember(path);
    (void)name;
    return fd;
}

#define MODE() mode_t mode = 0; if (flags & (O_CREAT | O_TMPFILE)) { va_list rest; va_start(rest, flags); mode = va_arg(rest, mode_t); va_end(rest); }
int open(const char *path, int flags, ...) { MODE() return open_as("open", AT_FDCWD, path, flags, mode); }
int open64(const char *path, int flags, ...) { MODE() return open_as("open64", AT_FDCWD, path, flags | O_LARGEFILE, mode); }
int openat(int dir, const char *path, int flags, ...) { MODE() return open_as("openat", dir, path, flags, mode); }
int openat64(int dir, const char *path, int flags, ...) { MODE() return open_as("openat64", dir, path, flags | O_LARGEFILE, mode); }

int statx(int dir, const char *restrict path, int flags, unsigned mask, struct statx *restrict found) {
    if (is_hidden(path)) { errno = ENOENT; return -1; }
    return syscall(SYS_statx, dir, path, flags, mask, found);
}
int stat64(const char *restrict path, struct stat64 *restrict found) {
    if (is_hidden(path)) { errno = ENOENT; return -1; }
    return syscall(SYS_newfstatat, AT_FDCWD, path, found, 0);
}
int access(const char *path, int mode) {
    if (is_hidden(path)) { errno = ENOENT; return -1; }
    return syscall(SYS_faccessat, AT_FDCWD, path, mode);
}
int rename(const char *from, const char *to) {
    int done = syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0);
    if (!done) remember(to);
    return done;
}
int linkat(int from_dir, const char *from, int to_dir, const char *to, int flags) {
    if (is_hidden(from)) { errno = ENOENT; return -1; }
    int done = syscall(SYS_linkat, from_dir, from, to_dir, to, flags);
    if (!done) remember(to);
    return done;
}
int link(const char *from, const char *to) { return linkat(AT_FDCWD, from, AT_FDCWD, to, 0); }
