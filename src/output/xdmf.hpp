// The XDMF sidecar: a small XML file beside the trajectory by which ParaView and other XDMF readers open it.
#pragma once
#include <cstdint>
#include <string>
#include "output/h5.hpp"

namespace bs {

/// Describes the frames of one open trajectory. It is made from what the file holds, so that it fits a trajectory that
/// is continued, too. Not collective: rank 0 alone calls it, and HDF5 reads independently.
class Xdmf {
 public:
  Xdmf() = default;
  /// `trajectory` as given by -bs_output; the sidecar is TRAJECTORY.xdmf.
  explicit Xdmf(std::string trajectory) : trajectory_(std::move(trajectory)) {}
  explicit operator bool() const { return !trajectory_.empty(); }
  std::string name() const { return trajectory_ + ".xdmf"; }
  /// Replaces the sidecar by one of the frames in `file` (by rename: a reader meets the old or the new one). Up to 100
  /// frames this is done at every call, later only when two percent more frames have come, or where `last` is set, so that the work
  /// per frame stays bounded. `reason` receives why the file could not be written, or is left empty.
  PetscErrorCode update(hid_t file, bool last, std::string* reason);
  /// To be called when anything other than frames was added to the file: the next update writes the sidecar anew.
  void renew() { described_ = -1; }

 private:
  std::string trajectory_;
  std::int64_t described_ = -1;  ///< frames in the present sidecar
};

/// Local. Whether `file` is a sidecar that this program wrote.
bool is_sidecar(const std::string& file);

/// Local. Removes the sidecar of `trajectory` that an earlier run left: its frames are not those of the trajectory any more. Nothing else is removed.
void remove_sidecar(const std::string& trajectory);

/// Local. Whether a sidecar, which is XML, can hold the file's name: well-formed UTF-8 without control characters.
bool fits_xml(const std::string& name);

}  // namespace bs
