#include "qjulia/map/provenance.hpp"

#include <nlohmann/json.hpp>

#include "qjulia/base/error.hpp"

namespace qjulia {

Provenance::Provenance() : Provenance(nlohmann::json::object()) {}

Provenance::Provenance(const nlohmann::json& value)
    : json_(std::make_shared<const nlohmann::json>(value)) {}

void Provenance::set(const std::string& key, const nlohmann::json& value) {
  if (!json_->is_object()) throw InputError("the map's provenance must be a JSON object");
  auto changed = std::make_shared<nlohmann::json>(*json_);
  (*changed)[key] = value;
  json_ = std::move(changed);
}

}  // namespace qjulia
