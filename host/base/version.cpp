#include "qjulia/base/version.hpp"

namespace qjulia {

const char* version() { return QJULIA_VERSION; }

}  // namespace qjulia
