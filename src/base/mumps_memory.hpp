// What MUMPS says by INFOG(1) of memory that it did not get.
#pragma once
#include <string>

namespace bs {

/// The analysis, the factorisation or the solve ended for want of memory or of work space.
inline bool mumps_lacks_memory(long infog) {
  for (const long code : {-5, -7, -8, -9, -11, -12, -13, -14, -15, -17, -19, -20})
    if (infog == code) return true;
  return false;
}

/// "-9": raise what; `prefix` of the options of these factors.
inline std::string mumps_memory_remedy(long infog, const std::string& prefix) {
  if (infog == -19) return "give a larger -" + prefix + "mat_mumps_icntl_23 (MB a rank), or leave it out";
  if (infog == -5 || infog == -7 || infog == -13) return "raise the memory limit";
  return "give a larger -" + prefix + "mat_mumps_icntl_14 (percent)";
}

}  // namespace bs
