// The datasets of a trajectory that grow with it.
#pragma once
#include <petscsys.h>

#include <string>
#include <vector>

#include "output/h5.hpp"
#include "output/trajectory.hpp"

namespace bs {

/// A dataset that grows, and the rows it had at the mark.
struct Growing {
  std::string path;
  bool log, clock;  ///< of the log of steps; its length tells how many frames are whole
  std::int64_t rows;
  bool times() const { return clock && path.compare(path.size() - 5, 5, "/time") == 0; }
};

/// The growing datasets of an open file, in the same order on every rank. `fault`: one of them, or a group, is not within
/// the file itself (a link, external storage): writing it would change another file; else empty.
std::vector<Growing> growing_of(hid_t file, const TrajectoryMark& mark, std::string* fault);

/// Rows of a dataset.
PetscErrorCode count_rows(hid_t file, const std::string& path, std::int64_t* rows);

/// Local. Copies what is in `trajectory` behind the mark to a new file beside it, whose name is returned. Rows that cannot be
/// read are left out. `reason`: why there is no such file, or nothing.
std::string keep_tail(const std::string& trajectory, const TrajectoryMark& mark, std::string* reason);

}  // namespace bs
