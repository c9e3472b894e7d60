/* Preloaded into a run: kills it by SIGKILL at the BS_KILL_AT-th time it is about to change the file whose path ends in
 * BS_KILL_FILE. BS_KILL_COUNT names a file that receives the number of such changes of a run that ends by itself. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/uio.h>
#include <unistd.h>

static long changes;

static int watched(int handle) {
  const char* end = getenv("BS_KILL_FILE");
  char link[64], path[4096];
  if (!end) return 0;
  snprintf(link, sizeof link, "/proc/self/fd/%d", handle);
  const ssize_t length = readlink(link, path, sizeof path - 1);
  const size_t tail = strlen(end);
  if (length < (ssize_t)tail) return 0;
  path[length] = 0;
  return strcmp(path + length - tail, end) == 0;
}

static void count(int handle) {
  const char* at = getenv("BS_KILL_AT");
  if (!watched(handle)) return;
  if (at && changes == atol(at)) kill(getpid(), SIGKILL);
  ++changes;
}

__attribute__((destructor)) static void tell(void) {
  const char* name = getenv("BS_KILL_COUNT");
  FILE* file = name && changes > 0 ? fopen(name, "w") : NULL;
  if (!file) return;
  fprintf(file, "%ld\n", changes);
  fclose(file);
}

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

ssize_t write(int handle, const void* data, size_t size) { return count(handle), REAL(write)(handle, data, size); }
ssize_t writev(int handle, const struct iovec* parts, int n) { return count(handle), REAL(writev)(handle, parts, n); }
ssize_t pwrite(int handle, const void* data, size_t size, off_t at) { return count(handle), REAL(pwrite)(handle, data, size, at); }
ssize_t pwritev(int handle, const struct iovec* parts, int n, off_t at) { return count(handle), REAL(pwritev)(handle, parts, n, at); }
ssize_t pwrite64(int handle, const void* data, size_t size, off64_t at) { return count(handle), REAL(pwrite64)(handle, data, size, at); }
ssize_t pwritev64(int handle, const struct iovec* parts, int n, off64_t at) { return count(handle), REAL(pwritev64)(handle, parts, n, at); }
int ftruncate(int handle, off_t size) { return count(handle), REAL(ftruncate)(handle, size); }
int ftruncate64(int handle, off64_t size) { return count(handle), REAL(ftruncate64)(handle, size); }

/* A killed process leaves its written pages to the system: what the test looks at needs no disk. */
int fsync(int handle) { return (void)handle, 0; }
int fdatasync(int handle) { return (void)handle, 0; }
