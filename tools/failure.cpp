#include "failure.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <new>

#include "exit_code.hpp"
#include "qjulia/error.hpp"

namespace qjulia::tools {

int exit_code_of(const std::exception& error) {
  if (dynamic_cast<const InputError*>(&error) != nullptr) return kBadInput;
  if (dynamic_cast<const NoDeviceError*>(&error) != nullptr) return kNoDevice;
  if (dynamic_cast<const Interrupted*>(&error) != nullptr) return kInterrupted;
  return kFailed;
}

void say(const std::exception& error) {
  const bool no_memory = dynamic_cast<const std::bad_alloc*>(&error) != nullptr;
  fmt::print(stderr, "qjulia: {}\n",
             no_memory ? "out of memory; try a lower resolution or fewer factors" : error.what());
}

}  // namespace qjulia::tools
