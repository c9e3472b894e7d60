#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>
#include <sstream>
#include "base/text.hpp"
#include "output/fresh_file.hpp"
#include "output/output_locks.hpp"

namespace bs {

namespace {

const std::string first_line = "backspring lock";

/// Whose run it is, as its lock file says.
struct Owner {
  std::string host, since;
  long process = 0;
};

std::string this_host() {
  char name[256] = "";
  if (gethostname(name, sizeof name - 1) != 0) return "an unnamed host";
  return name;
}

std::string owner_text() {
  char since[64] = "";
  const std::time_t now = std::time(nullptr);
  struct tm local;
  if (localtime_r(&now, &local)) (void)std::strftime(since, sizeof since, "%Y-%m-%d %H:%M:%S", &local);
  return first_line + "\nhost " + this_host() + "\nprocess " + std::to_string(static_cast<long>(getpid())) + "\nsince " + since + "\n";
}

std::string text_of(int handle) {
  char text[1024];
  const ssize_t size = pread(handle, text, sizeof text, 0);
  return size > 0 ? std::string(text, static_cast<std::size_t>(size)) : std::string();
}

/// A lock file of this program's, or one that is just being written.
bool ours(const std::string& text) {
  const std::size_t length = std::min(text.size(), first_line.size());
  return text.compare(0, length, first_line, 0, length) == 0;
}

bool read_owner(const std::string& text, Owner* owner) {
  std::istringstream in(text);
  std::string line;
  while (std::getline(in, line)) {
    if (line.rfind("host ", 0) == 0) owner->host = line.substr(5);
    if (line.rfind("process ", 0) == 0) owner->process = std::atol(line.c_str() + 8);
    if (line.rfind("since ", 0) == 0) owner->since = line.substr(6);
  }
  return !owner->host.empty() && owner->process > 0 && !owner->since.empty();
}

std::string busy(int handle, const std::string& file, const char* option) {
  Owner owner;
  const timespec tenth = {0, 100000000};
  for (int k = 0; k < 20 && !read_owner(text_of(handle), &owner); ++k) nanosleep(&tenth, nullptr);  // it is just writing
  const std::string who = owner.process > 0 ? format("process %ld on host %s since %s", owner.process, owner.host.c_str(), owner.since.c_str())
                                            : "which does not identify itself";
  return file + ": another run writes it, " + who + ": wait for its end, or give another " + option;
}

int write_owner(int handle) {
  const std::string text = owner_text();
  if (ftruncate(handle, 0) != 0) return errno;
  return pwrite(handle, text.data(), text.size(), 0) == static_cast<ssize_t>(text.size()) ? 0 : (errno ? errno : EIO);
}

/// Without locks: is the process that the file names still there, as far as this host can tell?
bool owner_lives(int handle) {
  Owner owner;
  if (!read_owner(text_of(handle), &owner) || owner.host != this_host() || owner.process == static_cast<long>(getpid())) return false;
  return kill(static_cast<pid_t>(owner.process), 0) == 0 || errno == EPERM;
}

/// Why `path` cannot be opened as a lock file.
std::string unopened(const std::string& path, const std::string& file, const char* option) {
  const int why = errno;
  Owner owner;
  const int handle = why == EACCES ? open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK) : -1;
  const bool known = handle >= 0 && read_owner(text_of(handle), &owner);
  if (handle >= 0) close(handle);
  if (known)
    return format("%s: the lock file of another user's run (process %ld on host %s): remove it if that run has ended, or give another %s",
                  path.c_str(), owner.process, owner.host.c_str(), option);
  if (why == ELOOP) return path + ", the lock of " + file + ", is a symbolic link: remove it, or give another " + option;
  return "cannot write the lock " + path + ": " + std::strerror(why) + ": give another " + option;
}

}  // namespace

std::string lock_name(const std::string& file) { return real_name(file) + ".lock"; }

std::string RunLock::acquire(const std::string& file, const char* option, std::string* warning) {
  const std::string path = lock_name(file);
  for (const Held& held : held_)
    if (held.path == path) return {};
  for (int attempt = 0; attempt < 100; ++attempt) {
    const int handle = open(path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK, 0666);
    if (handle < 0) return unopened(path, file, option);
    const auto give_up = [handle](const std::string& text) {
      close(handle);
      return text;
    };
    struct stat status;
    if (fstat(handle, &status) != 0 || !S_ISREG(status.st_mode) || !ours(text_of(handle)))
      return give_up(path + " is not a lock file of this program: move it away, or give another " + option);
    if (flock(handle, LOCK_EX | LOCK_NB) != 0) {
      if (errno == EINTR) {
        close(handle);
        continue;
      }
      if (errno == EWOULDBLOCK) return give_up(busy(handle, file, option));
      *warning =
          path + ": this file system has no locks (" + std::strerror(errno) + "): another host's run with the same " + option + " is not noticed";
      if (owner_lives(handle)) return give_up(busy(handle, file, option));
    }
    // whoever held it may have removed the name on the way out: then this lock is on a file that no other run finds
    FileIdentity present;
    const FileIdentity mine{status.st_dev, status.st_ino};
    if (!identity_of(path, false, &present) || !(present == mine)) {
      close(handle);
      continue;
    }
    if (const int why = write_owner(handle)) return give_up("cannot write the lock " + path + ": " + std::strerror(why) + ": give another " + option);
    held_.push_back({path, handle});
    return {};
  }
  return "cannot get the lock " + path + ": other runs keep taking it: give another " + option;
}

std::string RunLock::held_elsewhere(const std::string& file, const char* option) const {
  const int handle = open(lock_name(file).c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK);
  if (handle < 0) return {};
  struct stat status;
  std::string fault;
  const bool known = fstat(handle, &status) == 0 && S_ISREG(status.st_mode) && ours(text_of(handle));
  const bool mine = known && std::any_of(held_.begin(), held_.end(), [&status](const Held& held) {
                      struct stat own;
                      return fstat(held.handle, &own) == 0 && FileIdentity{own.st_dev, own.st_ino} == FileIdentity{status.st_dev, status.st_ino};
                    });
  if (known && !mine) {
    const bool locked = flock(handle, LOCK_SH | LOCK_NB) != 0;
    if (locked && (errno == EWOULDBLOCK || owner_lives(handle))) fault = busy(handle, file, option);
  }
  close(handle);  // and frees it
  return fault;
}

RunLock::~RunLock() {
  for (const Held& held : held_) {
    FileIdentity present;
    struct stat status;
    if (fstat(held.handle, &status) == 0 && identity_of(held.path, false, &present) && present == FileIdentity{status.st_dev, status.st_ino})
      (void)unlink(held.path.c_str());
    close(held.handle);
  }
}

}  // namespace bs
