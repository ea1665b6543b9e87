#pragma once
/// What a batch does with an entry: a mesh in, a map, a surface and a picture out.

#include <memory>
#include <string>

#include "batch/batch.hpp"

namespace qjulia::tools {

/// Hashes of the mesh's bytes and of every option the results depend on.
batch::FitKey fit_key(const batch::BatchEntry& entry);

/// @param device as `Device::choose` takes it. @throws Error
std::unique_ptr<batch::BatchWorker> make_fit_worker(const std::string& device);

}  // namespace qjulia::tools
