#pragma once
/// How a map came about.

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace qjulia {

/// A JSON object of any content; never changed by the library. Copies share it.
class Provenance {
 public:
  Provenance();                             ///< an empty object
  Provenance(const nlohmann::json& value);  // NOLINT(google-explicit-constructor)

  const nlohmann::json& json() const { return *json_; }
  /// Adds or replaces a member. @throws InputError when the provenance is not an object.
  void set(const std::string& key, const nlohmann::json& value);

 private:
  std::shared_ptr<const nlohmann::json> json_;
};

}  // namespace qjulia
