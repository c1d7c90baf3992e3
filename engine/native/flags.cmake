# How everything of ours is compiled, the library and its tests alike.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
# Equal input must give bitwise equal output on every machine: no contraction, no fast-math.
set(CMAKE_CXX_FLAGS_RELEASE "-O3 -DNDEBUG")
if(CMAKE_SYSTEM_NAME STREQUAL "WASI")
  set(CMAKE_CXX_FLAGS_RELEASE "-Os -DNDEBUG -msimd128")  # the reader's browser loads it first
endif()
# A kind that a switch forgets is an error, not a default.
add_compile_options(-Wall -Wextra -Werror=switch -Werror=return-type -ffp-contract=off)
# The standard library's headers are half of what most sources cost: read once, unless a cache of compilations, which
# cannot look into what was read before, stands in front of the compiler.
set(SPOOK_STANDARD_HEADERS <algorithm> <array> <chrono> <cmath> <cstdint> <functional> <limits> <map> <numeric>
  <optional> <span> <stdexcept> <string> <string_view> <utility> <vector>)
