// The rigid-body pipeline for Python.
#include "bindings_common.hpp"

namespace spook {

void bind_rigid(nb::module_&) {}

}  // namespace spook
