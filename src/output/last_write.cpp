#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <vector>
#include "output/h5.hpp"

namespace bs {

namespace {

struct Held {
  haddr_t at;
  std::vector<char> bytes;
};

struct File {
  H5FD_t base;  ///< HDF5's own part comes first
  int handle;
  haddr_t allocated, written;  ///< ends
  haddr_t begin, end;          ///< the range that is written last
  bool first;                  ///< or first: all else waits for the flush
  std::vector<Held>* held;
  dev_t device;
  ino_t inode;
};

File* of(H5FD_t* file) { return reinterpret_cast<File*>(file); }
const File* of(const H5FD_t* file) { return reinterpret_cast<const File*>(file); }

bool put(int handle, haddr_t at, std::size_t size, const char* data) {
  while (size > 0) {
    const ssize_t done = pwrite(handle, data, size, static_cast<off_t>(at));
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return false;
    data += done;
    at += static_cast<haddr_t>(done);
    size -= static_cast<std::size_t>(done);
  }
  return true;
}

/// Lets the disk begin with what is large at once, so that an fsync at the end waits for less.
void start_disk(int handle, haddr_t at, std::size_t size) {
  constexpr std::size_t LARGE = 1 << 18;
  if (size >= LARGE) (void)sync_file_range(handle, static_cast<off_t>(at), static_cast<off_t>(size), SYNC_FILE_RANGE_WRITE);
}

herr_t failed(const char* what) {
  H5Epush2(H5E_DEFAULT, __FILE__, "last_write", __LINE__, H5E_ERR_CLS, H5E_IO, H5E_WRITEERROR, "%s: %s", what, std::strerror(errno));
  return -1;
}

H5FD_t* open_file(const char* name, unsigned flags, hid_t, haddr_t) {
  struct stat status;
  const int handle = ::open(name, ((flags & H5F_ACC_RDWR) ? O_RDWR : O_RDONLY) | O_CLOEXEC);
  if (handle < 0 || fstat(handle, &status) != 0) {
    failed("open");
    if (handle >= 0) (void)::close(handle);
    return nullptr;
  }
  auto* file = new File{};
  file->handle = handle;
  file->written = static_cast<haddr_t>(status.st_size);
  file->held = new std::vector<Held>;
  file->device = status.st_dev;
  file->inode = status.st_ino;
  return &file->base;
}

herr_t write_held(File* file) {
  for (const Held& one : *file->held)
    if (!put(file->handle, one.at, one.bytes.size(), one.bytes.data())) return failed("write");
  file->held->clear();
  return 0;
}

herr_t close_file(H5FD_t* base) {
  File* file = of(base);
  herr_t result = write_held(file);
  if (::close(file->handle) != 0) result = failed("close");
  delete file->held;
  delete file;
  return result;
}

int compare(const H5FD_t* a, const H5FD_t* b) {
  const File *x = of(a), *y = of(b);
  if (x->device != y->device) return x->device < y->device ? -1 : 1;
  return x->inode == y->inode ? 0 : x->inode < y->inode ? -1 : 1;
}

// Without HDF5's accumulator of metadata, which would join the header's write with its neighbours'.
herr_t features(const H5FD_t*, unsigned long* flags) {
  *flags = H5FD_FEAT_AGGREGATE_METADATA | H5FD_FEAT_DATA_SIEVE | H5FD_FEAT_AGGREGATE_SMALLDATA | H5FD_FEAT_DEFAULT_VFD_COMPATIBLE;
  return 0;
}

haddr_t get_allocated(const H5FD_t* file, H5FD_mem_t) { return of(file)->allocated; }
haddr_t get_written(const H5FD_t* file, H5FD_mem_t) { return of(file)->written; }
herr_t set_allocated(H5FD_t* file, H5FD_mem_t, haddr_t end) {
  of(file)->allocated = end;
  return 0;
}
herr_t get_handle(H5FD_t* file, hid_t, void** handle) {
  *handle = file;
  return 0;
}

herr_t read_some(H5FD_t* base, H5FD_mem_t, hid_t, haddr_t at, std::size_t size, void* buffer) {
  File* file = of(base);
  auto* to = static_cast<char*>(buffer);
  for (std::size_t got = 0; got < size;) {
    const ssize_t done = pread(file->handle, to + got, size - got, static_cast<off_t>(at + got));
    if (done < 0 && errno == EINTR) continue;
    if (done < 0) return failed("read");
    if (done == 0) std::memset(to + got, 0, size - got);  // behind the end
    got = done == 0 ? size : got + static_cast<std::size_t>(done);
  }
  for (const Held& one : *file->held) {
    const haddr_t begin = std::max(at, one.at), end = std::min<haddr_t>(at + size, one.at + one.bytes.size());
    if (begin < end) std::memcpy(to + (begin - at), one.bytes.data() + (begin - one.at), end - begin);
  }
  return 0;
}

herr_t write_some(H5FD_t* base, H5FD_mem_t, hid_t, haddr_t at, std::size_t size, const void* buffer) {
  File* file = of(base);
  const auto* from = static_cast<const char*>(buffer);
  file->written = std::max<haddr_t>(file->written, at + size);
  const bool within = at < file->end && at + size > file->begin;
  if (within != file->first) {
    file->held->push_back({at, std::vector<char>(from, from + size)});
    return 0;
  }
  if (!put(file->handle, at, size, from)) return failed("write");
  start_disk(file->handle, at, size);
  return 0;
}

herr_t flush(H5FD_t* file, hid_t, hbool_t) { return write_held(of(file)); }

herr_t shorten(H5FD_t* base, hid_t, hbool_t) {
  File* file = of(base);
  if (file->allocated == file->written) return 0;
  if (ftruncate(file->handle, static_cast<off_t>(file->allocated)) != 0) return failed("truncate");
  file->written = file->allocated;
  return 0;
}

hid_t driver() {
  static const H5FD_class_t type = [] {
    H5FD_class_t made{};
#ifdef H5FD_CLASS_VERSION  // HDF5 1.14 and later ask
    made.version = H5FD_CLASS_VERSION;
    made.value = static_cast<H5FD_class_value_t>(511);  // of those that are for testing, and registered for no driver
#endif
    made.name = "last_write";
    made.maxaddr = (haddr_t(1) << 62);
    made.fc_degree = H5F_CLOSE_WEAK;
    made.open = open_file;
    made.close = close_file;
    made.cmp = compare;
    made.query = features;
    made.get_eoa = get_allocated;
    made.set_eoa = set_allocated;
    made.get_eof = get_written;
    made.get_handle = get_handle;
    made.read = read_some;
    made.write = write_some;
    made.flush = flush;
    made.truncate = shorten;
    const H5FD_mem_t map[H5FD_MEM_NTYPES] = H5FD_FLMAP_DICHOTOMY;
    std::copy(std::begin(map), std::end(map), made.fl_map);
    return made;
  }();
  static const hid_t id = H5FDregister(&type);
  return id;
}

}  // namespace

PetscErrorCode use_last_write(hid_t access) {
  PetscFunctionBegin;
  BS_H5(driver());
  BS_H5(H5Pset_driver(access, driver(), nullptr));
  PetscFunctionReturn(0);
}

PetscErrorCode write_header(hid_t file, hid_t object, Order order) {
  void* handle = nullptr;
  haddr_t header = 0;
  PetscFunctionBegin;
  BS_H5(find_h5_header(object, &header));
  BS_H5(H5Fget_vfd_handle(file, H5P_DEFAULT, &handle));
  File* own = of(static_cast<H5FD_t*>(handle));
  own->first = order == Order::first;
  own->begin = header;
  own->end = header + 1;  // the header's first part, where the length is
  PetscFunctionReturn(0);
}

}  // namespace bs
