// The end of the file that its superblock tells, once nothing is to be allocated any more.
#pragma once
#include <cstdint>
#include <string>

namespace bs {

/// Local. The superblock tells that the file ends at byte `end`. errno, or 0.
int store_end(const std::string& path, std::int64_t end);

/// Local. Takes away what lies behind the end that the superblock tells, and what was reserved there. errno, or 0.
int cut_behind_end(const std::string& path);

}  // namespace bs
