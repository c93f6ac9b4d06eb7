/* Counts the system calls by which a process changes files, and ends or fails one of them.
 *
 * Preloaded by kill.py. FAULT_AT is the number of the call, from 1; FAULT_MODE says what happens there:
 *   kill  the process ends before the call, as by `kill -9`
 *   torn  of a write only half happens, then the process ends
 *   full  the call and all later ones fail, as on a full disk
 * FAULT_COUNT names a file for the number of calls that were made. Standard streams are left alone. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static atomic_long calls;

static long fault_at(void) {
  const char *text = getenv("FAULT_AT");
  return text ? atol(text) : 0;
}

static int mode_is(const char *mode) {
  const char *text = getenv("FAULT_MODE");
  return text && !strcmp(text, mode);
}

/* Counts a call. Returns 1 if it must fail; does not return if the process ends here. */
static int struck(int is_write) {
  long number = atomic_fetch_add(&calls, 1) + 1;
  long at = fault_at();
  if (at && mode_is("full") && number >= at) {
    errno = ENOSPC;
    return 1;
  }
  if (at && number == at && (mode_is("kill") || (mode_is("torn") && !is_write)))
    kill(getpid(), SIGKILL);
  return 0;
}

static int is_torn(void) { return mode_is("torn") && atomic_load(&calls) == fault_at(); }

__attribute__((destructor)) static void tell(void) {
  const char *path = getenv("FAULT_COUNT");
  if (path) {
    FILE *(*real)(const char *, const char *) = dlsym(RTLD_NEXT, "fopen");
    FILE *file = real(path, "w");
    if (file) {
      fprintf(file, "%ld\n", atomic_load(&calls));
      fflush(file);
    }
  }
}

#define REAL(name) __typeof__(&name) real = (__typeof__(&name))dlsym(RTLD_NEXT, #name)

#define OPEN(name)                                       \
  int name(const char *path, int flags, ...) {           \
    REAL(name);                                          \
    va_list rest;                                        \
    va_start(rest, flags);                               \
    mode_t mode = va_arg(rest, mode_t);                  \
    va_end(rest);                                        \
    if ((flags & O_CREAT) && struck(0)) return -1;       \
    return real(path, flags, mode);                      \
  }
OPEN(open)
OPEN(open64)

#define WRITE(name, PARAMETERS, ...)                     \
  ssize_t name PARAMETERS {                              \
    REAL(name);                                          \
    if (fd <= 2) return real(__VA_ARGS__);               \
    if (struck(1)) return -1;                            \
    if (is_torn()) {                                     \
      size /= 2;                                         \
      (void)!real(__VA_ARGS__);                          \
      kill(getpid(), SIGKILL);                           \
    }                                                    \
    return real(__VA_ARGS__);                            \
  }
WRITE(write, (int fd, const void *bytes, size_t size), fd, bytes, size)
WRITE(pwrite, (int fd, const void *bytes, size_t size, off_t at), fd, bytes, size, at)
WRITE(pwrite64, (int fd, const void *bytes, size_t size, off64_t at), fd, bytes, size, at)

#define PLAIN(name, PARAMETERS, ...)                     \
  int name PARAMETERS {                                  \
    REAL(name);                                          \
    return struck(0) ? -1 : real(__VA_ARGS__);           \
  }
PLAIN(mkdir, (const char *path, mode_t mode), path, mode)
PLAIN(rename, (const char *from, const char *to), from, to)
PLAIN(unlink, (const char *path), path)
PLAIN(fsync, (int fd), fd)
PLAIN(fdatasync, (int fd), fd)
PLAIN(ftruncate, (int fd, off_t size), fd, size)
PLAIN(ftruncate64, (int fd, off64_t size), fd, size)
