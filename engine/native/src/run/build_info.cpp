#include "run/build_info.hpp"

#include "build_facts.inc"

namespace spook {

std::vector<std::pair<const char*, const char*>> build_facts() {
    return {{"git_hash", SPOOK_GIT_HASH}, {"dirty", SPOOK_DIRTY},       {"commit_time", SPOOK_COMMIT_TIME},
            {"parents", SPOOK_PARENTS},   {"describe", SPOOK_DESCRIBE}, {"shallow", SPOOK_SHALLOW},
            {"count", SPOOK_COUNT},       {"compiler", SPOOK_COMPILER}, {"flags", SPOOK_FLAGS},
            {"version", SPOOK_VERSION}};
}

}  // namespace spook
