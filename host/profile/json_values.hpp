#pragma once
/// Figures that may be unknown, as JSON: null where they are.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "profile/command_profile.hpp"

namespace qjulia::profiling {

template <class Number>
nlohmann::json or_null(const std::optional<Number>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json(nullptr);
}

inline nlohmann::json or_null(const std::string& word) {
  return word.empty() ? nlohmann::json(nullptr) : nlohmann::json(word);
}

inline nlohmann::json or_null(const std::vector<double>& values) {
  return values.empty() ? nlohmann::json(nullptr) : nlohmann::json(values);
}

/// A limit, which is 0 where it is not known.
inline nlohmann::json positive_or_null(double value) {
  return value > 0 ? nlohmann::json(value) : nlohmann::json(nullptr);
}

inline nlohmann::json to_json(const std::vector<CacheRoof>& caches) {
  nlohmann::json list = nlohmann::json::array();
  for (const CacheRoof& cache : caches) {
    list.push_back({{"level", cache.level},
                    {"bytes_per_second", cache.bytes_per_second},
                    {"bytes_per_cpu_second", positive_or_null(cache.bytes_per_cpu_second)}});
  }
  return list;
}

inline nlohmann::json to_json(const LaunchSize& size) {
  return {{"parts", size.parts},
          {"terms", size.terms},
          {"terms_are", size.terms_are},
          {"points", size.points}};
}

inline nlohmann::json or_null(const std::optional<LaunchSizes>& sizes) {
  if (!sizes) return nullptr;
  return {{"least", to_json(sizes->least)}, {"most", to_json(sizes->most)}};
}

inline nlohmann::json or_null(const std::optional<ProcessorUse>& use) {
  if (!use) return nullptr;
  return {{"seconds", use->seconds},
          {"processors", use->processors},
          {"others", use->others},
          {"stolen", use->stolen},
          {"throttled_times", use->throttled_times},
          {"throttled_seconds", use->throttled_seconds}};
}

inline nlohmann::json or_null(const std::optional<InstructionMix>& mix) {
  return mix ? qjulia::to_json(*mix) : nlohmann::json(nullptr);
}

}  // namespace qjulia::profiling
