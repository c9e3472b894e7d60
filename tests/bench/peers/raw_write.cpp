// The same bytes as a trajectory's frames, written as fast as the libraries allow: rows of 3 doubles, two datasets a
// frame, each rank its own slab, flushed to disk after every frame. --mode 0: collective HDF5; 1: collective MPI-IO.
//   mpirun -n 2 raw_write FILE --particles 1e6 --frames 5 --mode 0
#include <hdf5.h>
#include <mpi.h>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

struct Writer {
  virtual ~Writer() = default;
  virtual bool write(int frame, int field, const std::vector<double>& rows) = 0;
  virtual bool flush() = 0;
};

struct Slab {
  long long total, first, count;
  int frames;
};

class Hdf5Writer final : public Writer {
 public:
  Hdf5Writer(const char* path, const Slab& slab) : slab_(slab) {
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS), create = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_fapl_mpio(access, MPI_COMM_WORLD, MPI_INFO_NULL);
    file_ = H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, access);
    H5Pset_fill_time(create, H5D_FILL_TIME_NEVER);
    const hsize_t size[3] = {static_cast<hsize_t>(slab.frames), static_cast<hsize_t>(slab.total), 3};
    space_ = H5Screate_simple(3, size, nullptr);
    for (int k = 0; k < 2; ++k) set_[k] = H5Dcreate2(file_, k ? "velocity" : "position", H5T_NATIVE_DOUBLE, space_, H5P_DEFAULT, create, H5P_DEFAULT);
    const hsize_t mine[2] = {static_cast<hsize_t>(slab.count), 3};
    memory_ = H5Screate_simple(2, mine, nullptr);
    transfer_ = H5Pcreate(H5P_DATASET_XFER);
    H5Pset_dxpl_mpio(transfer_, H5FD_MPIO_COLLECTIVE);
    H5Pclose(access);
    H5Pclose(create);
  }
  ~Hdf5Writer() override {
    for (hid_t set : set_) H5Dclose(set);
    H5Sclose(space_);
    H5Sclose(memory_);
    H5Pclose(transfer_);
    H5Fclose(file_);
  }
  bool write(int frame, int field, const std::vector<double>& rows) override {
    const hsize_t start[3] = {static_cast<hsize_t>(frame), static_cast<hsize_t>(slab_.first), 0};
    const hsize_t count[3] = {1, static_cast<hsize_t>(slab_.count), 3};
    H5Sselect_hyperslab(space_, H5S_SELECT_SET, start, nullptr, count, nullptr);
    return H5Dwrite(set_[field], H5T_NATIVE_DOUBLE, memory_, space_, transfer_, rows.data()) >= 0;
  }
  bool flush() override { return H5Fflush(file_, H5F_SCOPE_GLOBAL) >= 0; }

 private:
  Slab slab_;
  hid_t file_, space_, memory_, transfer_, set_[2];
};

class MpiWriter final : public Writer {
 public:
  MpiWriter(const char* path, const Slab& slab) : slab_(slab) {
    MPI_File_open(MPI_COMM_WORLD, path, MPI_MODE_CREATE | MPI_MODE_WRONLY, MPI_INFO_NULL, &file_);
  }
  ~MpiWriter() override { MPI_File_close(&file_); }
  bool write(int frame, int field, const std::vector<double>& rows) override {
    const MPI_Offset at = ((2LL * frame + field) * slab_.total + slab_.first) * 24;
    return MPI_File_write_at_all(file_, at, rows.data(), static_cast<int>(rows.size()), MPI_DOUBLE, MPI_STATUS_IGNORE) == MPI_SUCCESS;
  }
  bool flush() override { return MPI_File_sync(file_) == MPI_SUCCESS; }

 private:
  Slab slab_;
  MPI_File file_ = MPI_FILE_NULL;
};

static bool run(const char* path, double particles, int frames, bool hdf5, std::vector<double>* seconds) {
  int rank = 0, size = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  Slab slab{static_cast<long long>(particles), 0, 0, frames};
  slab.first = slab.total * rank / size;
  slab.count = slab.total * (rank + 1) / size - slab.first;
  std::vector<double> rows(static_cast<std::size_t>(3 * slab.count));
  for (std::size_t k = 0; k < rows.size(); ++k) rows[k] = 1e-3 * static_cast<double>(k);
  Writer* writer = hdf5 ? static_cast<Writer*>(new Hdf5Writer(path, slab)) : new MpiWriter(path, slab);
  bool good = true;
  for (int frame = 0; frame < frames; ++frame) {
    MPI_Barrier(MPI_COMM_WORLD);
    const double start = MPI_Wtime();
    good = writer->write(frame, 0, rows) && writer->write(frame, 1, rows) && writer->flush() && good;
    MPI_Barrier(MPI_COMM_WORLD);
    seconds->push_back(MPI_Wtime() - start);
  }
  delete writer;
  return good;
}

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  std::map<std::string, double> given = {{"--particles", 1e5}, {"--frames", 5}, {"--mode", 0}};
  for (int k = 2; k + 1 < argc; k += 2) given[argv[k]] = std::atof(argv[k + 1]);
  std::vector<double> seconds;
  const bool good = argc > 1 && run(argv[1], given["--particles"], static_cast<int>(given["--frames"]), given["--mode"] == 0, &seconds);
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  if (rank == 0 && good) {
    std::printf("{\"seconds\": [");
    for (std::size_t k = 0; k < seconds.size(); ++k) std::printf("%s%.6g", k ? ", " : "", seconds[k]);
    std::printf("]}\n");
  }
  MPI_Finalize();
  return good ? 0 : 1;
}
