// What this library was built from; the values are written by build_info.cmake at every build.
#pragma once

#include <utility>
#include <vector>

namespace spook {

/// Name and text: git_hash, dirty, commit_time, parents, describe, shallow, count, compiler, flags, version. Empty: not known.
std::vector<std::pair<const char*, const char*>> build_facts();

}  // namespace spook
